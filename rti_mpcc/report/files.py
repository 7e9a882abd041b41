"""The files of a run: summary.json, trajectory.csv, overview.png, timeline.png."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from rti_mpcc.report import style
from rti_mpcc.simulation import RunResult

TRAJECTORY_COLUMNS = ("t", "x", "y", "phi", "v", "delta", "theta", "a", "delta_dot")
_FAR = 1e5
"""From (0, 0) on a map [m]."""


def write_files(
    result: RunResult, summary: dict[str, Any], folder: Path, *, plots: bool = True
) -> tuple[Path, ...]:
    """Write the files of a run into an existing folder and return their paths. Raises OSError.

    Args:
        plots: the pictures too.
    """
    written = [folder / "summary.json", folder / "trajectory.csv"]
    write_json(summary, written[0])
    write_trajectory(result, written[1])
    if plots:
        # Not at the top: matplotlib takes longer to load than a run without pictures needs it.
        from rti_mpcc.report.overview import overview_figure
        from rti_mpcc.report.timeline import timeline_figure

        figures = {
            "overview": overview_figure(result),
            "timeline": timeline_figure(result, summary),
        }
        for name, figure in figures.items():
            written.append(folder / f"{name}.png")
            figure.savefig(written[-1], dpi=style.DPI)
    return tuple(written)


def make_writable(folder: Path) -> None:
    """Make a folder before the run, so that it is not driven in vain. Raises OSError."""
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryFile(dir=folder):
        pass


def write_json(figures: dict[str, Any] | list[dict[str, Any]], file: Path) -> None:
    """Figures as JSON; what is None becomes null. Raises OSError."""
    file.write_text(json.dumps(figures, indent=2, allow_nan=False) + "\n", encoding="utf-8")


def write_trajectory(result: RunResult, file: Path) -> None:
    """The truth at every plant step as CSV, one header line, SI units. Raises OSError."""
    truth = result.truth
    columns = [truth.times, *truth.poses.T, truth.v, truth.delta, truth.theta]
    table = np.stack([*columns, truth.acceleration, truth.steering_rate], axis=-1)
    # Far from (0, 0) twelve digits would be too few.
    digits = "%.16g" if np.abs(truth.poses[:, :2]).max() > _FAR else "%.12g"
    formats = [digits if name in ("x", "y") else "%.12g" for name in TRAJECTORY_COLUMNS]
    with file.open("w", encoding="utf-8", newline="") as stream:
        np.savetxt(
            stream, table, fmt=formats, delimiter=",", header=",".join(TRAJECTORY_COLUMNS), comments=""
        )
