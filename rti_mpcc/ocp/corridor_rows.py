"""Half-plane rows that keep every disc of the body inside the corridor.

(H1)  n · (c - b) >= radius + margin,   c = (x, y) + o (cos phi, sin phi)
(H2)  n_x dx + n_y dy + o (n_y cos phi - n_x sin phi) dphi + slack >= radius + margin - n · (c - b)
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from geometry import HalfPlanes
from rti_mpcc.model.footprint import Discs
from rti_mpcc.model.layout import PHI
from rti_mpcc.types import Array

LOOSE = -100.0
"""Lower bound of a row that must not act [m]; finite, so that the solver keeps its factorisation. Its slopes
are 0 besides: a row that never binds still drags on the solver's steps."""


RETURN_TIME = 1.5
"""So long the plan may take to give the margin back that a measurement has taken from it [s]."""
WAY_BACK = 10.0
"""Way over which a body that is over a boundary is brought back, once it has turned [m]."""


class CorridorRows(NamedTuple):
    """Slopes (N, discs, sides, 3) to x, y, phi of stages 1..N and lower bounds (N, discs, sides) of (H2)."""

    slopes: Array
    lower: Array


def corridor_rows(
    states: Array, planes: HalfPlanes, discs: Discs, margin: float, near: float
) -> CorridorRows | None:
    """Rows (H2) about `states` (N, 6) with `planes` of their N * discs centres (stage by stage); None if none
    acts.

    Args:
        margin: kept between disc and boundary [m]; near: farther boundaries do not act [m].
    """
    stages, count = len(states), len(discs.offsets)
    gap = discs.radius + margin - planes.distance.reshape(stages, count, -1)
    acts = gap > -near
    if not acts.any():
        return None
    normal = planes.normal.reshape(stages, count, -1, 2)
    c, s = np.cos(states[:, PHI])[:, None, None], np.sin(states[:, PHI])[:, None, None]
    slopes = np.empty((*normal.shape[:3], 3))
    slopes[..., :2] = normal
    slopes[..., 2] = discs.offsets[None, :, None] * (normal[..., 1] * c - normal[..., 0] * s)
    slopes *= acts[..., None]
    return CorridorRows(slopes, np.where(acts, gap, LOOSE))


def lacking(rows: CorridorRows, change: Array) -> Array | None:
    """What of the corridor and its margin is missing (N, discs, sides) [m], or None if nothing is.

    The plan begins `change` (3,) in x, y, phi beside the one linearised about, and goes on beside it.
    """
    missing = rows.lower - rows.slopes @ change
    return np.maximum(missing, 0.0) if float(missing.max()) > 0.0 else None


def admitted(
    rows: CorridorRows, missing: Array, elapsed: Array, turned: Array, margin: float, over: Array
) -> Array:
    """Lower bounds (N, discs, sides) that give back step by step what is missing.

    What is `missing` of the margin a moment ahead (see `lacking`) is out of reach by then: the
    exact penalty would answer each centimetre of measurement noise beside a boundary with all the steering
    there is. A vehicle that is `over` a boundary lacks more, and gives it back by driving, not by waiting;
    one that turns away swings its other end out before. A slack that nothing can make smaller would
    saturate the penalty all along the plan, and the solver with it. So that boundary is taken to be where the
    vehicle has it now, and to come back from there: as a whole, for where it kept to what is missing at each
    stage it would bind at all of them, and hold the plan to the one linearised about. The other boundaries
    stay.

    (H4)  lower - r - (1 - s / WAY_BACK) (over + min(over, margin - r)),
          r = (1 - t / RETURN_TIME) min(m, margin),   m = missing = max(0, lower - slopes change)

    Args:
        elapsed: (N,) time t of stages 1..N [s].
        turned: (N,) way s that the plan has driven by then since its body can have turned away [m].
        over: (sides,) what the vehicle lacks beyond the margin [m].
    """
    share = np.clip(1.0 - elapsed / RETURN_TIME, 0.0, 1.0)
    relief = share[:, None, None] * np.minimum(missing, margin)
    if over.any():
        share = np.clip(1.0 - turned / WAY_BACK, 0.0, 1.0)
        relief += share[:, None, None] * (over + np.minimum(over, margin - relief))
    bounds: Array = rows.lower - relief
    return bounds
