"""What is left to a vehicle that gets no nearer, and the way back that it pulls out on."""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum

from geometry import Pose2
from rti_mpcc.config import ControllerConfig
from rti_mpcc.manoeuvre import Segment, SegmentEnd
from rti_mpcc.model.layout import PHI, THETA, X, Y
from rti_mpcc.planning.context import PlanningContext
from rti_mpcc.planning.state import ControllerState, Phase


class Recovery(Enum):
    """What a vehicle that gets no nearer does: the first of these that is left to it."""

    TRY_AGAIN = "plan again from where it is, `Retries.restarts` times"
    PULL_OUT = (
        "pull out by the next of `Retries.pull_out`, in lengths of its body, and come again, with as many "
        "tries as before"
    )
    STAY = "stay until the target moves, or the obstacles change"


def next_recovery(s: ControllerState, context: PlanningContext, config: ControllerConfig) -> Recovery:
    """The first that is left: to stay always is."""
    return next((each for each, is_left in _LEFT if is_left(s, context, config)), Recovery.STAY)


def way_back(s: ControllerState, context: PlanningContext, config: ControllerConfig) -> Segment | None:
    """The way back that a vehicle which has stalled is to drive next; None if it has to stay where it is."""
    if s.task.phase is not Phase.STALLED or next_recovery(s, context, config) is not Recovery.PULL_OUT:
        return None
    segment = s.task.segment
    return Segment(
        part=segment.part.driven_back(*_way_back(s, context, config)),
        index=segment.index,
        end=SegmentEnd.WAY_BACK,
        tolerance=config.behaviour.cusp_tolerance,
        speed=segment.speed,
        steering=segment.steering,
    )


def _may_try_again(s: ControllerState, context: PlanningContext, config: ControllerConfig) -> bool:
    # Without a planned arrival another try is the same again: only an arrival backs off and comes back.
    most = config.retries.restarts if config.arrival else 0
    return s.task.phase is not Phase.STALLED and s.task.restarts < most


def _may_pull_out(s: ControllerState, context: PlanningContext, config: ControllerConfig) -> bool:
    task, retries = s.task, config.retries
    if not (config.recovers and context.free and task.segment.end is not SegmentEnd.WAY_BACK):
        return False
    if task.pulled_out >= len(retries.pull_out):
        return False
    begin, end = _way_back(s, context, config)
    return begin - end >= retries.least_pull_out * _length(config)


_LEFT: tuple[tuple[Recovery, Callable[[ControllerState, PlanningContext, ControllerConfig], bool]], ...] = (
    (Recovery.TRY_AGAIN, _may_try_again),
    (Recovery.PULL_OUT, _may_pull_out),
)


def _way_back(s: ControllerState, context: PlanningContext, config: ControllerConfig) -> tuple[float, float]:
    """Progress [m] at which the next way back begins and ends."""
    part, task = s.task.segment.part, s.task
    *here, theta = context.state[[X, Y, PHI, THETA]].tolist()
    begin = part.progress(Pose2(*here), theta)
    return begin, max(begin - config.retries.pull_out[task.pulled_out] * _length(config), part.start)


def _length(config: ControllerConfig) -> float:
    """Of the body [m]."""
    return config.vehicle.front + config.vehicle.rear
