"""A planned way as rows of numbers: for its file, its picture, and how much room it leaves."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

import numpy as np
from numpy.typing import NDArray

from geometry import Area
from rti_mpcc.config import Vehicle
from rti_mpcc.manoeuvre import Manoeuvre
from rti_mpcc.simulation.solid import SolidThings
from rti_mpcc.types import Array

SPACING = 0.05
"""Between the rows of a way [m], at most."""
FINE = 0.01
"""Between those at which its least clearance is measured [m], at most."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannedWay:
    """A way in n rows; where a segment ends and the next one begins there is one for either.

    Attributes:
        s: (n,) way driven [m].
        poses: (n, 3) x [m], y [m], phi [rad] of the rear axle.
        curvature: (n,) positive when steered to the left [1/m].
        direction: (n,) 1 forward, -1 reverse.
        segment: (n,) index of the segment.
    """

    s: Array
    poses: Array
    curvature: Array
    direction: NDArray[np.int64]
    segment: NDArray[np.int64]

    @property
    def last_rows(self) -> NDArray[np.int64]:
        """(k,) the last row of each segment but the last one."""
        return np.flatnonzero(np.diff(self.segment) > 0)

    @property
    def is_cusp(self) -> NDArray[np.bool_]:
        """(k,) whether the direction changes behind these rows; else the vehicle only stops to steer."""
        rows = self.last_rows
        changes: NDArray[np.bool_] = self.direction[rows] != self.direction[rows + 1]
        return changes


def way_of(manoeuvre: Manoeuvre, spacing: float = SPACING) -> PlannedWay:
    """The way that was found, in rows at most `spacing` apart [m]; none where none was found."""
    parts = [segment.part for segment in manoeuvre.segments]
    places = [part.places(spacing) for part in parts]
    counts = [theta.size for theta in places]
    poses, curvature = [np.zeros((0, 3))], [np.zeros(0)]
    for part, theta in zip(parts, places, strict=True):
        at = part.reference(theta)
        poses.append(np.column_stack([at.x, at.y, at.phi]))
        curvature.append(part.curvature(theta))
    begin = parts[0].start if parts else 0.0
    return PlannedWay(
        s=np.concatenate([np.zeros(0), *places]) - begin,
        poses=np.concatenate(poses),
        curvature=np.concatenate(curvature),
        direction=np.repeat(np.array([part.direction for part in parts], dtype=np.int64), counts),
        segment=np.repeat(np.arange(len(parts), dtype=np.int64), counts),
    )


def least_clearance(manoeuvre: Manoeuvre, area: Area, vehicle: Vehicle) -> float | None:
    """Least distance of the body to all that is solid along the way [m]; None where there is no way."""
    poses = way_of(manoeuvre, FINE).poses
    if not len(poses):
        return None
    return float(SolidThings.of(area).clearance(poses, vehicle).min())


def no_way(manoeuvre: Manoeuvre) -> list[str]:
    """Why there is no way, and how far the search got, in lines."""
    lines = [f"no way was found: {manoeuvre.reason or manoeuvre.outcome.value}"]
    if manoeuvre.nodes and isfinite(manoeuvre.nearest):
        searched = f"{manoeuvre.nodes} poses in {manoeuvre.seconds:.1f} s"
        lines.append(f"the search came within {manoeuvre.nearest:.2f} m of the goal, {searched}")
    return lines
