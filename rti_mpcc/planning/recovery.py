"""Segments that the controller makes by itself: the way back of a vehicle that has stalled."""

from __future__ import annotations

from geometry import Pose2
from rti_mpcc.config import ControllerConfig
from rti_mpcc.manoeuvre import Segment, SegmentEnd
from rti_mpcc.model.layout import PHI, THETA, X, Y
from rti_mpcc.planning.context import PlanningContext
from rti_mpcc.planning.state import ControllerState, Phase
from rti_mpcc.types import Array


def way_back(s: ControllerState, context: PlanningContext, config: ControllerConfig) -> Segment | None:
    """The way back that a vehicle which has stalled is to drive next; None if it has to stay where it is."""
    task, segment, retries = s.task, s.task.segment, config.retries
    stalled = task.phase is Phase.STALLED and context.free and segment.end is not SegmentEnd.WAY_BACK
    if not (stalled and config.recovers and task.pulled_out < len(retries.pull_out)):
        return None
    *here, theta = context.state[[X, Y, PHI, THETA]].tolist()
    begin = segment.part.progress(Pose2(*here), theta)
    length = config.vehicle.front + config.vehicle.rear
    end = max(begin - retries.pull_out[task.pulled_out] * length, segment.part.start)
    if begin - end < retries.least_pull_out * length:
        return None
    back = segment.part.driven_back(begin, end)
    return Segment(
        part=back,
        index=segment.index,
        end=SegmentEnd.WAY_BACK,
        tolerance=config.behaviour.cusp_tolerance,
        speed=segment.speed,
        steering=segment.steering,
    )


def placed(state: Array, theta: float) -> Array:
    """A state (6,) with its progress on another segment [m]."""
    state = state.copy()
    state[THETA] = theta
    return state
