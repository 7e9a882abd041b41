"""From one leg of the route to the next: when the direction may change, and what is forgotten then."""

from __future__ import annotations

from math import hypot

from geometry import PathPart, Pose2
from rti_mpcc.config import ControllerConfig
from rti_mpcc.planning.memory import ControllerMemory, Situation, renewed
from rti_mpcc.planning.route import STANDSTILL_SPEED, STANDSTILL_TIME, restart, stands

CUSP_REACH = 0.5
"""A vehicle that stands within this distance of a cusp may pass it [m]."""


def with_goal(memory: ControllerMemory, goal: Pose2 | None) -> ControllerMemory:
    """Another planned goal: what is known of the last one, or stands before it, is no longer meant."""
    if memory.stop is not None:
        memory = released(memory)
    return renewed(memory, unfinished=None, planned=goal, goal=goal, estimate=None, estimated_at=None)


def released(memory: ControllerMemory) -> ControllerMemory:
    """Make for the part's own target again."""
    return renewed(restart(memory), stop=None)


def may_change_direction(memory: ControllerMemory, situation: Situation, dead_time: float) -> bool:
    """Whether the next part may begin: standing at the cusp with nothing left in the queue."""
    if situation.last_part or not situation.free or not stands(memory, situation, dead_time):
        return False
    if abs(situation.measured_speed) > STANDSTILL_SPEED:
        return False
    if situation.inside(situation.error):
        return True
    near = hypot(situation.error.x, situation.error.y) <= CUSP_REACH
    return near and stands(memory, situation, max(STANDSTILL_TIME, dead_time))


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
        trust=memory.trust,
        unreadable=memory.unreadable,
        part=memory.part + (not staged),
        cartesian=staged,
        planned=memory.planned,
        goal=memory.goal,
        estimate=memory.estimate,
        estimated_at=memory.estimated_at,
        poses=memory.poses,
        queue=memory.queue,
        standing_since=memory.standing_since,
    )
