"""The last part of a given path, tried before the path is begun.

A goal beside the end of a path can be out of reach from where the path changes its direction last. That is
found out there, too, but then the vehicle has driven a way that is of no use: from where it stands now there
may be one that takes no longer than the path itself would.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rti_mpcc.config import ControllerConfig
from rti_mpcc.manoeuvre import Manoeuvre
from rti_mpcc.model.layout import V
from rti_mpcc.planning.schedule import apart
from rti_mpcc.planning.state import ControllerState, Phase, Plans, Task
from rti_mpcc.planning.timing import expected_docking_time
from rti_mpcc.types import Array

OUT_OF_REACH = "the goal is out of reach from the path's last change of direction"


def is_due(s: ControllerState, config: ControllerConfig) -> bool:
    """Whether it is to be tried now: at rest before a path that changes its direction, for a new goal."""
    route, goal, task, measured = s.route, s.goal_pose, s.task, s.vehicle.monitor.state
    if route is None or goal is None or measured is None:
        return False
    if s.on_planned_way or route.why or s.goal.rejected:
        return False
    stands = abs(float(measured[V])) <= config.behaviour.standstill_speed
    begins = task.phase is Phase.STARTING and task.stop is None and len(task.segments) > 1
    if not (stands and begins and config.objective.arrives_at_goal):
        return False
    before = route.rehearsed
    return before is None or apart(goal, before) > config.route.goal_moved[0]


def on_last(s: ControllerState) -> ControllerState:
    """The state with nothing to do but the last segment."""
    task = Task.begun((s.task.segments[-1],))
    return replace(s, task=task, plans=Plans(), begin=None)


def at_begin(s: ControllerState) -> Array:
    """The state (6,) of a vehicle at rest where the segment begins."""
    segment = s.task.segment
    first, wheels = segment.part.first, segment.wheels or 0.0
    return np.array([first.x, first.y, first.phi, 0.0, wheels, segment.part.start])


def judged(s: ControllerState, reaches: bool | None) -> ControllerState:
    """The state that asks for another way where the goal is not reached."""
    assert s.route is not None
    wanted = OUT_OF_REACH if reaches is False else s.route.wanted
    return replace(s, route=replace(s.route, rehearsed=s.goal_pose, wanted=wanted))


def takes_too_long(s: ControllerState, found: Manoeuvre, config: ControllerConfig) -> bool:
    """Whether a way that was found for want of reach takes too long to be driven in the path's place."""
    if s.route is None or s.route.why != OUT_OF_REACH:
        return False
    given = expected_docking_time(s.path, config, s.goal_pose)
    return expected_docking_time(found.path, config, found.goal) > config.route.instead * given
