"""Where to change direction: at a cusp's pose, or beside it where the body is in the way of the next part.

The boundaries of the next part act from the change on. A body that stands exactly at the cusp may reach over
one of them, of a narrowing or an obstacle just there, without the part that ends there knowing it.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from geometry import Corridor, Pose2
from rti_mpcc.config import ControllerConfig
from rti_mpcc.manoeuvre import Segment
from rti_mpcc.model.footprint import clearances
from rti_mpcc.types import Array

_STEPS = sorted(product((0.0, -0.5, 0.5, -1.0, 1.0), repeat=3), key=np.linalg.norm)


def cusp_pose(cusp: Pose2, corridor: Corridor, segment: Segment, config: ControllerConfig) -> Pose2:
    """The pose to change direction at, at the end of a segment.

    It is the nearest one to `cusp` at which the body keeps the corridor's margin on this part and on the
    next, or, within `Behaviour.cusp_shift` of the tolerance, the one that comes nearest to that.
    """
    margin, index = config.clearance.wanted, segment.index
    if _room([cusp], corridor, index, config)[0] == margin:
        return cusp
    most = config.behaviour.cusp_shift
    poses = [cusp.compose(Pose2(*(most * np.multiply(segment.tolerance, step)).tolist())) for step in _STEPS]
    room = _room(poses, corridor, index, config)
    return poses[int(np.argmax(room))]  # the first of equals is the nearest


def _room(poses: list[Pose2], corridor: Corridor, index: int, config: ControllerConfig) -> Array:
    """Clearance (n,) of the body [m] on the part and on the next one, as far as the margin counts it."""
    at, margin = np.array([(pose.x, pose.y, pose.phi) for pose in poses]), config.clearance.wanted
    both = [clearances(at, corridor, part, config.vehicle, margin) for part in (index, index + 1)]
    room: Array = np.minimum(np.concatenate(both, axis=1).min(axis=1), margin)
    return room
