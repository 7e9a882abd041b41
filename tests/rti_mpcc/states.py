"""States and contexts to decide in, on a straight path of 20 m."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import numpy as np

from geometry import Corridor, Pose2, ReferencePath
from rti_mpcc.behaviour.conditions import standing_since
from rti_mpcc.behaviour.transitions import transition_by_condition
from rti_mpcc.config import ControllerConfig
from rti_mpcc.manoeuvre import PlannedStop, Segment, SegmentEnd, segments_of
from rti_mpcc.model.layout import CONTROLS, STATES
from rti_mpcc.ocp.targets import Target, TargetKind
from rti_mpcc.planning.context import PlanningContext
from rti_mpcc.planning.pace import Pace
from rti_mpcc.planning.schedule import rescheduled
from rti_mpcc.planning.state import (
    Arrival,
    ClockState,
    ControllerState,
    GoalState,
    Phase,
    Plans,
    SuspendedSearch,
    Task,
    VehicleEstimate,
)
from rti_mpcc.planning.surroundings import Surroundings
from rti_mpcc.types import Trajectory
from tests.rti_mpcc.encounters import square

PATH = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 20.0)])
AREA = Surroundings.of(Corridor.from_offsets(PATH, left=5.0, right=-5.0), PATH, ControllerConfig())
SEGMENTS = segments_of(PATH, ControllerConfig())
BEFORE = Segment(part=PATH.parts[0], index=0, end=SegmentEnd.CUSP)
"""One that comes before the only other one."""
NOW = 10.0
"""Time of the usual cycle [s]."""
_PARTS: tuple[tuple[tuple[str, ...], type], ...] = (
    ((), ControllerState),
    (("clock",), ClockState),
    (("vehicle",), VehicleEstimate),
    (("goal",), GoalState),
    (("task",), Task),
    (("task", "arrival"), Arrival),
    (("plans",), Plans),
)
_PLACES = {field.name: path for path, part in _PARTS for field in fields(part)}
assert len(_PLACES) == sum(len(fields(part)) for _, part in _PARTS), "a name must say where a value belongs"


def put(s: ControllerState, **values: Any) -> ControllerState:
    """The state with these values, each in that part of it which has a field of this name.

    `stop` says which piece of its segment the vehicle is on.
    """
    for name, value in values.items():
        if name == "stop":
            s = replace(s, task=s.task.on(stopped(s.task.whole, value)))
        else:
            s = _put(s, _PLACES[name], name, value)
    return s


def stopped(whole: Segment, stop: PlannedStop | None) -> Segment:
    """Its piece up to a stop, or all of it."""
    return whole if stop is None else whole.stopped(stop, ControllerConfig().behaviour.stop_tolerance)


def _put(whole: Any, path: tuple[str, ...], name: str, value: Any) -> Any:
    if not path:
        return replace(whole, **{name: value})
    head, *rest = path
    return replace(whole, **{head: _put(getattr(whole, head), tuple(rest), name, value)})


def state(**values: Any) -> ControllerState:
    """A state in the usual cycle, with these values: see `put`."""
    return put(ControllerState(area=AREA, path=PATH, task=Task.begun(SEGMENTS)), **{"time": NOW, **values})


def after_changes(count: int) -> Surroundings:
    """What is around the vehicle, after so many changes of the obstacles."""
    return replace(AREA, changes=count)


def with_box(x: float) -> Surroundings:
    """What is around the vehicle where a box stands beside the path, that far along [m]."""
    return AREA.updated([square(x, 3.0, 0.5)], NOW, ControllerConfig())


def target_at(x: float) -> Target:
    """A goal pose `x` [m] along."""
    return Target(pose=Pose2(x, 0.0, 0.0), theta=x, theta_end=20.0, kind=TargetKind.POSE)


def arrival_at(at: float, **values: Any) -> Arrival:
    """At the goal."""
    return Arrival(**{"at": at, "timed_for": target_at(20.0).pose, **values})


def arrives_at(it: ControllerState | SuspendedSearch) -> float | None:
    """When it is to be at the target [s], or a plan that is looked for."""
    arrival = it.task.arrival if isinstance(it, ControllerState) else it.arrival
    return None if arrival is None else arrival.at


def arriving(**values: Any) -> ControllerState:
    """On the way to the goal, to be there at 20 s."""
    usual: dict[str, Any] = {"phase": Phase.ARRIVING, "target": target_at(20.0), "arrival": arrival_at(20.0)}
    return state(**{**usual, **values})


def contouring(**values: Any) -> ControllerState:
    """On the way along the path."""
    return arriving(**{"phase": Phase.CONTOURING, "arrival": None, **values})


def stop_at(theta: float) -> PlannedStop:
    """A stop that was found to be needed at the begin."""
    return PlannedStop(at=theta, goal=None, obstacles=0, since=0.0)


def begun_for(stop: PlannedStop | None, **values: Any) -> SuspendedSearch:
    """A search that ran out of time, for an arrival at a target 9 m along, at 12 s."""
    usual: dict[str, Any] = {"target": target_at(9.0), "arrival": arrival_at(12.0), "begin": 9.0}
    return SuspendedSearch(
        **{
            "solution": None,
            "iterations": 2,
            "iterate": None,
            "segment": stopped(SEGMENTS[0], stop),
            **usual,
            **values,
        }
    )


def some_plan() -> Trajectory:
    """Of one stage."""
    return Trajectory(times=np.zeros(2), states=np.zeros((2, STATES)), controls=np.zeros((1, CONTROLS)))


def decided(s: ControllerState, context: PlanningContext, config: ControllerConfig) -> ControllerState:
    """The state after what is decided in a cycle, with nothing in the way."""
    s = put(s, time=context.now)
    s = transition_by_condition(put(s, standing_since=standing_since(s, context, config)), context, config)
    return rescheduled(s, context, config)


class Contexts:
    """Makes contexts on the straight path; default: cruising forwards at 1 m/s, 10 m before the goal."""

    def __call__(self, **changes: Any) -> PlanningContext:
        usual: dict[str, Any] = {
            "now": NOW,
            "begin": NOW + 0.2,
            "state": np.array([10.0, 0.0, 0.0, 1.0, 0.0, 10.0]),
            "acceleration": 0.0,
            "doubt": "",
            "measured_speed": 1.0,
            "target": target_at(20.0),
            "direction": 1,
            "ends_at_goal": True,
            "free": True,
            "along": 10.0,
            "distance": 10.0,
            "speed": 1.0,
            "pace": Pace(theta=np.array([0.0, 20.0]), speed=np.array([10.0, 10.0])),
            "error": Pose2(-10.0, 0.0, 0.0),
            "stop_error": Pose2(-8.75, 0.0, 0.0),
            "tolerance": (0.05, 0.05, 0.035),
            "half_turn": 13.0,
        }
        values = {**usual, **changes}
        return PlanningContext(**{"standing_error": values["error"], **values})

    def standing(self, x: float = 20.0, **changes: Any) -> PlanningContext:
        """At rest `x` [m] along."""
        error = Pose2(x - 20.0, 0.0, 0.0)
        usual: dict[str, Any] = {
            "state": np.array([x, 0.0, 0.0, 0.0, 0.0, x]),
            "measured_speed": 0.0,
            "along": 20.0 - x,
            "distance": 20.0 - x,
            "speed": 0.0,
            "error": error,
            "stop_error": error,
        }
        return self(**{**usual, **changes})


contexts = Contexts()
