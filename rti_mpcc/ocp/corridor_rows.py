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
"""So long it may take to bring a body back that is over a boundary [s]."""


class CorridorRows(NamedTuple):
    """Slopes (N, discs, sides, 3) to x, y, phi of stages 1..N and lower bounds (N, discs, sides) of (H2)."""

    slopes: Array
    lower: Array


def corridor_rows(
    states: Array, planes: HalfPlanes, discs: Discs, margin: float, near: float
) -> CorridorRows:
    """Rows (H2) about `states` (N, 6) with `planes` of their N * discs centres (stage by stage).

    Args:
        margin: kept between disc and boundary [m]; near: farther boundaries do not act [m].
    """
    stages, count = len(states), len(discs.offsets)
    normal = planes.normal.reshape(stages, count, -1, 2)
    distance = planes.distance.reshape(stages, count, -1)
    c, s = np.cos(states[:, PHI])[:, None, None], np.sin(states[:, PHI])[:, None, None]
    slopes = np.empty((*normal.shape[:3], 3))
    slopes[..., :2] = normal
    slopes[..., 2] = discs.offsets[None, :, None] * (normal[..., 1] * c - normal[..., 0] * s)
    gap = discs.radius + margin - distance
    acts = gap > -near
    slopes *= acts[..., None]
    return CorridorRows(slopes, np.where(acts, gap, LOOSE))


def admitted(rows: CorridorRows, change: Array, elapsed: Array, margin: float) -> Array:
    """Lower bounds (N, discs, sides) that give back step by step what is missing.

    The plan begins `change` (3,) in x, y, phi beside the one linearised about. What is missing of the margin
    a moment ahead, by this or before, is out of reach by then: the exact penalty would answer each
    centimetre of measurement noise beside a boundary with all the steering there is. What is missing beyond
    the margin where the vehicle is, with the body over a boundary, takes longer to give back; a slack that
    nothing can make smaller would saturate the penalty all along the plan, and the solver with it.

    (H4)  lower - (1 - t / RETURN_TIME) min(m, margin) - (1 - t / WAY_BACK) min(max(0, m - margin), over),
          m = max(0, lower - slopes change),  over = the largest max(0, m - margin) of stage 1

    Args:
        elapsed: (N,) time of stages 1..N [s].
    """
    missing = np.maximum(rows.lower - rows.slopes @ change, 0.0)
    lacking = np.minimum(missing, margin)
    share = np.clip(1.0 - elapsed / RETURN_TIME, 0.0, 1.0)
    bounds: Array = rows.lower - share[:, None, None] * lacking
    over = float((missing[0] - lacking[0]).max(initial=0.0))
    if over > 0.0:
        share = np.clip(1.0 - elapsed / WAY_BACK, 0.0, 1.0)
        bounds -= share[:, None, None] * np.minimum(missing - lacking, over)
    return bounds
