"""Start of each step: from the present state, the order for the controller."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple, assert_never

import numpy as np
import shapely

from geometry import Area, Pose2
from rti_mpcc.config import ControllerConfig
from rti_mpcc.mission.straight import straight_order
from rti_mpcc.mission.undock_ends import undock_ends
from rti_mpcc.model.footprint import body_polygons
from rti_mpcc.orders import GoOn, GoTo, Order, Stand
from rti_mpcc.planning import ways
from rti_mpcc.planning.agenda import Agenda, Berth, StepRecord
from rti_mpcc.planning.goals import GoalTerms, Outline
from rti_mpcc.planning.state import ControllerState, Phase
from rti_mpcc.steps import Dock, DockKind, DriveTo, Straight, Undock, Wait

_OUT_TOLERANCE = (0.2, 0.2, 0.1)  # at the end of an undocking: longitudinal [m], lateral [m], heading [rad]


class Started(NamedTuple):
    """The start of a step.

    Attributes:
        agenda: afterwards; order: for the controller, None: it continues.
        goal: pose that the step is to end in, or None; dock: that this is known by, or None.
        problem: why it cannot be started, or "".
    """

    agenda: Agenda
    order: Order | None = None
    goal: Pose2 | None = None
    dock: Pose2 | None = None
    problem: str = ""


def start_step(agenda: Agenda, s: ControllerState, config: ControllerConfig, area: Area | None) -> Started:
    """Start the step that is due; one that has to start at rest once the vehicle stands.

    If it does not come to rest in the step's time, or patience, the step cannot be started.

    Args:
        area: all that is solid, as far as it is known; None: the controller plans no routes.
    """
    due = agenda.due[0]
    from_rest = isinstance(due.step, Straight | Undock)
    if from_rest and (s.vehicle.monitor.state is None or not s.is_stationary):
        since = s.now if agenda.stopping_since is None else agenda.stopping_since
        agenda = replace(agenda, stopping_since=since)
        if s.now - since < min(due.step.timeout, due.step.patience):
            return Started(agenda, None if s.task.phase is Phase.WAITING else Stand())
        started = Started(agenda, Stand(), problem="the vehicle does not come to rest")
    else:
        started = _started(agenda, s, config, area)
    record = StepRecord(
        kind=due.step.word, place=due.place, attempt=due.attempt, begin=s.now, goal=started.goal,
        dock=started.dock,
    )  # fmt: skip
    agenda = replace(
        started.agenda,
        begun=s.now,
        stopping_since=None,
        docked_since=None,
        trouble=None,
        reason="",
        log=(*agenda.log, record),
    )
    return started._replace(agenda=agenda)


def _started(agenda: Agenda, s: ControllerState, config: ControllerConfig, area: Area | None) -> Started:
    step, berth = agenda.due[0].step, agenda.berth
    match step:
        case Dock():
            return _start_docking(step, agenda, s, config, area)
        case Wait():
            return Started(agenda, Stand())
        case Straight():
            axis = berth.pose if berth is not None and berth.reached else None
            order, problem = straight_order(step, axis, ways.here(s, config), area, config)
            if order is None:
                return Started(agenda, Stand(), problem=problem)
            if berth is not None and berth.reached:
                agenda = replace(agenda, berth=replace(berth, joined=True))
            return Started(agenda, order, order.manoeuvre.goal, axis)
        case Undock():
            here = ways.here(s, config)
            ends = () if area is None else undock_ends(here, step.distance, area, config)
            if not ends:
                return Started(agenda, Stand(), problem="no end of a route out of here is clear")
            return Started(replace(agenda, ways_out=ends), order_to_undock(ends[0]), ends[0])
        case DriveTo():
            terms = GoalTerms(tolerance=step.tolerance, detected=False)
            return Started(agenda.at(None), GoTo(goal=step.pose, terms=terms), step.pose)
    assert_never(step)


def order_to_undock(end: Pose2) -> GoTo:
    """The order to drive to the end of an undocking."""
    return GoTo(goal=end, terms=GoalTerms(tolerance=_OUT_TOLERANCE, detected=False))


def _start_docking(
    step: Dock, agenda: Agenda, s: ControllerState, config: ControllerConfig, area: Area | None
) -> Started:
    own = step.pose is None and agenda.own_goal == s.goal.planned  # that of its path, or given on the way
    if own or area is None:
        goal = s.goal_pose or (None if s.on_planned_way else s.path.end)
        order = GoOn() if s.task.phase is Phase.WAITING else None
        return Started(agenda.at(None), order, goal, goal)
    goal = step.pose or agenda.told or agenda.own_goal or (None if s.route is None else s.route.end)
    if goal is None:
        return Started(agenda, Stand(), problem="no goal was given")
    agenda = agenda.at(Berth(dock=step, place=agenda.due[0].place, pose=goal, body_at=goal))
    terms = GoalTerms(
        tolerance=step.tolerance,
        detected=None if step.kind is None else step.kind is not DockKind.KNOWN,
        approach=None if step.approach is None else (step.approach.length, step.approach.direction),
        uncertainty=step.uncertainty,
        keep_out=_keep_out(step, ways.here(s, config), config),
    )
    return Started(agenda, GoTo(goal=goal, terms=terms), goal, goal)


def _keep_out(step: Dock, here: Pose2, config: ControllerConfig) -> tuple[Outline, ...]:
    """Where the body of the dock may be; none where the vehicle stands there already."""
    body = body_polygons(np.array([[here.x, here.y, here.phi]]), config.vehicle)[0]
    near = shapely.Polygon(body).buffer(config.clearance.on_routes)
    return tuple(each for each in step.keep_out() if not near.intersects(shapely.Polygon(each)))
