"""The files of a planned way: route.csv, plan.json, plan.png."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from geometry import Area
from rti_mpcc.config import ControllerConfig
from rti_mpcc.manoeuvre import Manoeuvre
from rti_mpcc.report import style
from rti_mpcc.report.files import write_json
from rti_mpcc.report.planned_way import least_clearance, way_of
from rti_mpcc.simulation.result import cusps_of

ROUTE_COLUMNS = ("s", "x", "y", "heading", "curvature", "direction", "segment")


def plan_figures(manoeuvre: Manoeuvre, area: Area, config: ControllerConfig) -> dict[str, Any]:
    """The figures of a search, as plan.json has them; those of a way that was not found are None."""
    found = manoeuvre.found
    return {
        "found": found,
        "seconds": manoeuvre.seconds,
        "length_m": manoeuvre.length if found else None,
        "cusps": cusps_of(segment.part for segment in manoeuvre.segments) if found else None,
        "min_clearance_m": least_clearance(manoeuvre, area, config.vehicle),
        "nodes": manoeuvre.nodes,
    }


def write_plan(
    name: str,
    figures: dict[str, Any],
    manoeuvre: Manoeuvre,
    area: Area,
    config: ControllerConfig,
    folder: Path,
) -> tuple[Path, ...]:
    """Write the files of a search into an existing folder and return their paths. Raises OSError."""
    from rti_mpcc.report.plan_figure import plan_figure

    written = (folder / "plan.json", folder / "route.csv", folder / "plan.png")
    write_json(figures, written[0])
    write_route(manoeuvre, written[1])
    plan_figure(name, area, manoeuvre, config).savefig(written[2], dpi=style.DPI)
    return written


def write_route(manoeuvre: Manoeuvre, file: Path) -> None:
    """The way as CSV, one header line, SI units; no rows where none was found. Raises OSError."""
    way = way_of(manoeuvre)
    table = np.column_stack([way.s, way.poses, way.curvature, way.direction, way.segment])
    # All digits of x and y: maps may lie far from (0, 0).
    formats = ["%.6f", "%.16g", "%.16g", "%.12g", "%.12g", "%d", "%d"]
    with file.open("w", encoding="utf-8", newline="") as stream:
        np.savetxt(stream, table, fmt=formats, delimiter=",", header=",".join(ROUTE_COLUMNS), comments="")
