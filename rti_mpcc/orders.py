"""Orders of a mission to the controller, in place of its path and goal, as data."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from geometry import Pose2
from rti_mpcc.course.transitions import Event, transition_on
from rti_mpcc.errors import InputError
from rti_mpcc.manoeuvre import Manoeuvre
from rti_mpcc.state import ControllerState
from rti_mpcc.types import GoalOrigin
from rti_mpcc.world.goals import NO_TERMS, GoalTerms
from rti_mpcc.world.world import GoalState

if TYPE_CHECKING:
    from rti_mpcc.course.replanning import Replanner


@dataclass(frozen=True, slots=True, kw_only=True)
class Stand:
    """Come to a standstill in comfort, or as soon as possible (`at_once`), and stand."""

    at_once: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Resume:
    """Resume the segment on which the vehicle was stopped."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GoTo:
    """Plan a route to a goal, a pose of the rear axle in the world frame, and drive it on these terms."""

    goal: Pose2
    terms: GoalTerms = NO_TERMS


@dataclass(frozen=True, slots=True, kw_only=True)
class Follow:
    """Drive this manoeuvre, which starts where the vehicle stands, and no other one, on these terms."""

    manoeuvre: Manoeuvre
    terms: GoalTerms = NO_TERMS


Order = Stand | Resume | GoTo | Follow


def carried_out(s: ControllerState, order: Order, replanner: Replanner | None) -> ControllerState:
    """The state after an order. Raises InputError for a goal or a manoeuvre without recovery."""
    if isinstance(order, Stand):
        s = transition_on(s, Event.COMMANDED_TO_STAND)
        return replace(s, task=replace(s.task, at_once=order.at_once))
    if isinstance(order, Resume):
        return transition_on(s, Event.COMMANDED_TO_RESUME if s.has_route else Event.ROUTE_LOST)
    if replanner is None:
        raise InputError("this controller drives its path only: its settings have no recovery")
    if isinstance(order, GoTo):
        return replanner.leaving(_with_goal(s, order.goal, order.terms), "another goal")
    return replanner.following(_with_goal(s, order.manoeuvre.goal, order.terms), order.manoeuvre)


def _with_goal(s: ControllerState, goal: Pose2, terms: GoalTerms) -> ControllerState:
    known = GoalState(planned=goal, dock=goal, pose=goal, origin=GoalOrigin.GIVEN, terms=terms)
    return replace(s, goal=known)
