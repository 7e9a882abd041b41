"""What this project is compared with: figures and trajectories of the paper and of its published code.

The data are in the folder `published`, with their origin.
"""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rti_mpcc.ocp.horizon import read_only
from rti_mpcc.types import Array

Figures = dict[str, Any]
_FOLDER = Path(__file__).parent / "published"
_COLUMNS = ("t", "x", "y", "phi", "v", "delta", "a", "delta_dot")
NEVER = {"time_in_paper_s": None, "direction_changes": None, "min_clearance_m": None}
"""What a run need not have, besides `rms` and `energy`."""


class Track(NamedTuple):
    """A trajectory of the published code, sampled every 0.1 s.

    Attributes:
        times: (n,) [s].
        poses: (n, 3) x [m], y [m], phi [rad] of the rear axle.
        v, delta: (n,) speed [m/s], steering angle [rad].
        acceleration, steering_rate: (n,) [m/s²], [rad/s].
    """

    times: Array
    poses: Array
    v: Array
    delta: Array
    acceleration: Array
    steering_rate: Array


def published() -> Figures:
    """All of published.toml: `origin`, `runs`, `constant`, `parameters`."""
    return tomllib.loads((_FOLDER / "published.toml").read_text(encoding="utf-8"))


def published_run(scenario: str, method: str) -> Figures:
    """The figures of a run, named as in `simulation.summary`, None where they are not known.

    Raises KeyError for a run that was not published.
    """
    runs = {(run["scenario"], run["method"]): run for run in published()["runs"]}
    return {**NEVER, "rms": {}, "energy": {}, **runs[scenario, method]}


def published_track(scenario: str, method: str) -> Track:
    """The trajectory of a run. Raises KeyError as `published_run`."""
    file = _FOLDER / published_run(scenario, method)["trajectory"]
    table = np.genfromtxt(file, delimiter=",", names=True, encoding="utf-8")
    times, x, y, phi, v, delta, acceleration, steering_rate = (table[name] for name in _COLUMNS)
    track = Track(times, np.stack([x, y, phi], axis=-1), v, delta, acceleration, steering_rate)
    read_only(*track)
    return track
