"""From one leg of the route to the next: when the direction may change, and what is forgotten then."""

from __future__ import annotations

from math import hypot

from geometry import PathPart, Pose2
from rti_mpcc.config import ControllerConfig
from rti_mpcc.model.layout import PHI, THETA, X, Y
from rti_mpcc.planning.memory import ControllerMemory, Phase, PlanningContext, PullOut, renewed
from rti_mpcc.planning.route import (
    PATIENCE,
    STANDSTILL_SPEED,
    STANDSTILL_TIME,
    is_stationary,
    recovery_enabled,
    restart,
)
from rti_mpcc.types import Array

CUSP_REACH = 0.5
"""A vehicle that stands within this distance of a cusp may pass it [m]."""
PULL_OUT = (1.8, 3.6)
"""How far back along its part a vehicle pulls out that has stalled, the first and the second time, in lengths
of its body: 8.1 and 16.1 m for the default one."""
LEAST_WAY = 0.45
"""A way back that is shorter is none, in the same: 2.0 m."""


def with_goal(memory: ControllerMemory, goal: Pose2 | None) -> ControllerMemory:
    """Another planned goal: what is known of the last one, or stands before it, is no longer meant."""
    if memory.stop is not None:
        memory = released(memory)
    return renewed(
        memory,
        unfinished=None,
        planned=goal,
        goal=goal,
        estimate=None,
        estimated_at=None,
        estimate_fit=None,
        followed=None,
        pulled_out=0,
    )


def released(memory: ControllerMemory) -> ControllerMemory:
    """Make for the part's own target again."""
    return renewed(restart(memory), stop=None)


def may_change_direction(memory: ControllerMemory, situation: PlanningContext, dead_time: float) -> bool:
    """Whether the next part may begin: standing at the cusp with nothing left in the queue."""
    if situation.last_part or not situation.free or not is_stationary(memory, situation, dead_time):
        return False
    if abs(situation.measured_speed) > STANDSTILL_SPEED:
        return False
    if situation.inside(situation.error):
        return True
    return _near(situation) and is_stationary(memory, situation, max(STANDSTILL_TIME, dead_time))


def way_back(
    memory: ControllerMemory, situation: PlanningContext, part: PathPart, config: ControllerConfig
) -> PullOut | None:
    """The way back that a vehicle which has stalled is to drive next; None if it has to stay where it is."""
    stalled = memory.phase is Phase.STALLED and situation.free and memory.pull_out is None
    if not (stalled and recovery_enabled(config) and memory.pulled_out < len(PULL_OUT)):
        return None
    *here, theta = situation.state[[X, Y, PHI, THETA]].tolist()
    begin = part.progress(Pose2(*here), theta)
    length = config.vehicle.front + config.vehicle.rear
    end = max(begin - PULL_OUT[memory.pulled_out] * length, part.start)
    return PullOut(begin=begin, end=end) if begin - end >= LEAST_WAY * length else None


def pulling_out(memory: ControllerMemory, situation: PlanningContext, way: PullOut) -> ControllerMemory:
    """The memory at the beginning of a way back."""
    return renewed(
        restart(memory),
        pull_out=way,
        restarts=0,
        standing_since=situation.now,
        reached=_placed(situation.state, way.begin),
    )


def has_pulled_out(memory: ControllerMemory, situation: PlanningContext, dead_time: float) -> bool:
    """Whether the way back is over: at its end, or where there is no getting on."""
    if memory.pull_out is None or not is_stationary(memory, situation, dead_time):
        return False
    there = situation.free and (_near(situation) or memory.phase is Phase.STALLED)
    return there or is_stationary(memory, situation, PATIENCE)


def coming_again(memory: ControllerMemory, situation: PlanningContext) -> ControllerMemory:
    """The memory at the end of a way back."""
    assert memory.pull_out is not None
    theta = 2.0 * memory.pull_out.begin - float(situation.state[THETA])
    return renewed(
        restart(memory),
        pull_out=None,
        pulled_out=memory.pulled_out + 1,
        restarts=0,
        stop=None,
        reached=_placed(situation.state, theta),
        latched="",
        looked_at=None,
    )


def _near(situation: PlanningContext) -> bool:
    """Whether the target, a cusp or the end of a way back, is near enough to go on from."""
    return hypot(situation.error.x, situation.error.y) <= CUSP_REACH


def _placed(state: Array, theta: float) -> Array:
    """A state (6,) with its progress on another part [m]."""
    placed = state.copy()
    placed[THETA] = theta
    return placed


def staging_stop(part: PathPart, goal: Pose2 | None, config: ControllerConfig) -> float:
    """Progress [m] at which `Method.SEPARATED` stops on its last part."""
    goal = goal or part.last
    theta = part.project(goal.x, goal.y, heading=goal.phi)
    return part.end if theta >= part.end else max(theta - config.staging, part.start)


def next_leg(memory: ControllerMemory, *, staged: bool) -> ControllerMemory:
    """The memory at the beginning of the next part, or after a stop at a staging pose."""
    return ControllerMemory(
        time=memory.time,
        clock_offset=memory.clock_offset,
        clock_at=memory.clock_at,
        clock_stood=memory.clock_stood,
        monitor=memory.monitor,
        offsets=memory.offsets,
        unreadable=memory.unreadable,
        part=memory.part + (not staged),
        cartesian=staged,
        planned=memory.planned,
        goal_fit=memory.goal_fit,
        given_fit=memory.given_fit,
        refusal=memory.refusal,
        goal=memory.goal,
        estimate=memory.estimate,
        estimated_at=memory.estimated_at,
        estimate_fit=memory.estimate_fit,
        followed=memory.followed,
        poses=memory.poses,
        queue=memory.queue,
        standing_since=memory.standing_since,
    )
