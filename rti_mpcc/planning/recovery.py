"""Segments that the controller makes by itself: the way back of a vehicle that has stalled."""

from __future__ import annotations

from geometry import Pose2
from rti_mpcc.config import ControllerConfig
from rti_mpcc.manoeuvre import Segment, SegmentEnd
from rti_mpcc.model.layout import PHI, THETA, X, Y
from rti_mpcc.planning.context import PlanningContext
from rti_mpcc.planning.state import ControllerState, Phase
from rti_mpcc.types import Array

PULL_OUT = (1.8, 3.6)
"""How far back along its segment a vehicle pulls out that has stalled, the first and the second time, in
lengths of its body: 8.1 and 16.1 m for the default one."""
LEAST_DISTANCE = 0.45
"""A shorter way back is not driven, in lengths of the body: 2.0 m."""


def way_back(s: ControllerState, context: PlanningContext, config: ControllerConfig) -> Segment | None:
    """The way back that a vehicle which has stalled is to drive next; None if it has to stay where it is."""
    task, segment = s.task, s.task.segment
    stalled = task.phase is Phase.STALLED and context.free and segment.end is not SegmentEnd.WAY_BACK
    if not (stalled and config.recovers and task.pulled_out < len(PULL_OUT)):
        return None
    *here, theta = context.state[[X, Y, PHI, THETA]].tolist()
    begin = segment.part.progress(Pose2(*here), theta)
    length = config.vehicle.front + config.vehicle.rear
    end = max(begin - PULL_OUT[task.pulled_out] * length, segment.part.start)
    if begin - end < LEAST_DISTANCE * length:
        return None
    back = segment.part.driven_back(begin, end)
    return Segment(
        part=back,
        index=segment.index,
        end=SegmentEnd.WAY_BACK,
        speed=segment.speed,
        steering=segment.steering,
    )


def placed(state: Array, theta: float) -> Array:
    """A state (6,) with its progress on another segment [m]."""
    state = state.copy()
    state[THETA] = theta
    return state
