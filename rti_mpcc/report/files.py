"""The files of a ride: summary.json, trajectory.csv, overview.png, timeline.png, page.html."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from rti_mpcc.recording import McapLog
from rti_mpcc.report.ride import Ride
from rti_mpcc.report.text import progress_bar
from rti_mpcc.types import Array

TRAJECTORY = ("t", "x", "y", "phi", "v", "delta", "theta", "a", "delta_dot")
"""Columns of trajectory.csv, SI units."""
_FAR = 1e5  # from (0, 0) on a map [m]; twelve digits would be too few there


def write_files(
    ride: Ride, summary: dict[str, Any], folder: Path, *, plots: bool = True, page: bool = False
) -> list[Path]:
    """Write the files of a ride into an existing folder: with `plots` the pictures, with `page` page.html,
    which needs moments. Raises OSError."""
    written = [folder / "summary.json", folder / "trajectory.csv"]
    write_json(summary, written[0])
    write_trajectory(ride, written[1])
    if plots:
        # Not at the top: matplotlib takes longer to load than a run without pictures needs it.
        from rti_mpcc.report import draw
        from rti_mpcc.report.overview import overview_figure
        from rti_mpcc.report.timeline import timeline_figure

        figures = {"overview": overview_figure(ride), "timeline": timeline_figure(ride, summary)}
        for name, figure in figures.items():
            written.append(folder / f"{name}.png")
            draw.save(figure, written[-1])
    if page:
        from rti_mpcc.report.ride_page import ride_page

        written.append(folder / "page.html")
        written[-1].write_text(ride_page(ride, summary), encoding="utf-8")
    return written


def write_extras(ride: Ride, mcap: Path | None, animation: Path | None = None) -> list[Path]:
    """Write the MCAP file and the animation that were asked for.

    Raises OSError, InputError, and MissingExtraError where the extra for MCAP is not installed.
    """
    written = []
    if mcap is not None:
        make_writable(mcap.parent)
        with McapLog(mcap) as log:
            for moment in ride.moments:
                log.write_moment(moment, ride.config)
        written.append(mcap)
    if animation is not None:
        # Not at the top: matplotlib takes long to load.
        from rti_mpcc.report.animation import animation_file, write_animation

        file = animation_file(animation, animation.parent)
        make_writable(file.parent)
        with progress_bar(file.name, "{task.completed:.1f} s") as progress:
            write_animation([ride], file, progress=progress)
        written.append(file)
    return written


def make_writable(folder: Path) -> None:
    """Make a folder, and write into it, before a run that would be lost otherwise. Raises OSError."""
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryFile(dir=folder):
        pass


def write_json(figures: dict[str, Any] | list[dict[str, Any]], file: Path) -> None:
    """Figures as JSON; None becomes null. Raises OSError."""
    file.write_text(json.dumps(figures, indent=2, allow_nan=False) + "\n", encoding="utf-8")


def write_trajectory(ride: Ride, file: Path) -> None:
    """The truth at every plant step as CSV, see `TRAJECTORY`. Raises OSError."""
    motion = ride.motion
    rates = (motion.acceleration, motion.steering_rate)
    values = [motion.times, *motion.poses.T, motion.v, motion.delta, motion.theta, *rates]
    digits = "%.16g" if np.abs(motion.poses[:, :2]).max() > _FAR else "%.12g"
    formats = {name: digits if name in ("x", "y") else "%.12g" for name in TRAJECTORY}
    write_csv(values, formats, file)


def write_csv(columns: Sequence[Array], formats: Mapping[str, str], file: Path) -> None:
    """Columns with one header line; `formats` by their names. Raises OSError."""
    look: dict[str, Any] = {"fmt": list(formats.values()), "header": ",".join(formats), "delimiter": ","}
    with file.open("w", encoding="utf-8", newline="") as stream:
        np.savetxt(stream, np.column_stack(columns), comments="", **look)
