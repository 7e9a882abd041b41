"""What this project is compared with: figures and trajectories of the paper and of its published code.

The data are in the folder `published`, with their origin; the run that a scenario and method name is None
where there is none.
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


def published_run(scenario: str, method: str) -> Figures | None:
    """The figures of a run, named as in `simulation.summary`; None in it where they are not known."""
    for run in published()["runs"]:
        if (run["scenario"], run["method"]) == (scenario, method):
            return {**NEVER, "rms": {}, "energy": {}, **run}
    return None


def published_track(scenario: str, method: str) -> Track | None:
    """The trajectory of a run."""
    run = published_run(scenario, method)
    if run is None:
        return None
    lines = (_FOLDER / run["trajectory"]).read_text(encoding="utf-8").splitlines()
    table = np.genfromtxt(lines, delimiter=",", names=True)
    times, x, y, phi, v, delta, acceleration, steering_rate = (table[name] for name in _COLUMNS)
    track = Track(times, np.stack([x, y, phi], axis=-1), v, delta, acceleration, steering_rate)
    read_only(*track)
    return track
