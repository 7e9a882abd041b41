"""How each step is begun: from what is known, the order that the controller gets."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import shapely

from geometry import Area, Pose2
from rti_mpcc.config import ControllerConfig
from rti_mpcc.mission.straight import straight_on
from rti_mpcc.mission.way_out import ways_out
from rti_mpcc.model.footprint import body_polygons
from rti_mpcc.orders import GoOn, GoTo, Order, Stand
from rti_mpcc.planning import ways
from rti_mpcc.planning.agenda import Agenda, Berth, StepRecord
from rti_mpcc.planning.goals import GoalTerms, Outline
from rti_mpcc.planning.state import ControllerState, Phase
from rti_mpcc.steps import AnyStep, Dock, DockKind, DriveTo, Straight, Undock, Wait

_OUT_TOLERANCE = (0.2, 0.2, 0.1)  # at the end of a way out: longitudinal [m], lateral [m], heading [rad]


@dataclass(frozen=True, slots=True, kw_only=True)
class Around:
    """What a step is begun from.

    Attributes:
        s: state of the controller; config: its settings.
        area: all that stands, as far as is known; None: the controller plans no ways.
    """

    s: ControllerState
    config: ControllerConfig
    area: Area | None

    @property
    def here(self) -> Pose2:
        """Where the vehicle stands."""
        return ways.here(self.s, self.config)


class Begun(NamedTuple):
    """What beginning a step came to.

    Attributes:
        agenda: afterwards; order: for the controller, None: it goes on as it does.
        goal: pose that the step is to end in, or None; dock: that this is known by, or None.
        problem: why it cannot be begun, or "".
    """

    agenda: Agenda
    order: Order | None = None
    goal: Pose2 | None = None
    dock: Pose2 | None = None
    problem: str = ""


def begin(agenda: Agenda, around: Around) -> Begun:
    """Begin the step that is due; one that has to begin at rest once the vehicle stands.

    Where it does not come to rest in the step's time, or patience, the step cannot be begun.
    """
    due, s = agenda.due[0], around.s
    from_rest = isinstance(due.step, Straight | Undock)
    if from_rest and (s.vehicle.monitor.state is None or not s.is_stationary):
        since = s.now if agenda.stopping_since is None else agenda.stopping_since
        agenda = replace(agenda, stopping_since=since)
        if s.now - since < min(due.step.timeout, due.step.patience):
            return Begun(agenda, None if s.task.phase is Phase.WAITING else Stand())
        found = Begun(agenda, Stand(), problem="the vehicle does not come to rest")
    else:
        found = _BEGUN[type(due.step)](due.step, agenda, around)
    record = StepRecord(
        kind=due.step.word,
        place=due.place,
        attempt=due.attempt,
        begin=s.now,
        goal=found.goal,
        dock=found.dock,
    )
    begun = replace(
        found.agenda,
        begun=s.now,
        stopping_since=None,
        docked_since=None,
        trouble=None,
        reason="",
        log=(*agenda.log, record),
    )
    return found._replace(agenda=begun)


def _docking(step: Dock, agenda: Agenda, around: Around) -> Begun:
    s = around.s
    own = step.pose is None and agenda.own_goal == s.goal.planned  # that of its path, or told on the way
    if own or around.area is None:
        goal = s.goal_pose or (None if s.on_planned_way else s.path.end)
        order = GoOn() if s.task.phase is Phase.WAITING else None
        return Begun(agenda.at(None), order, goal, goal)
    goal = step.pose or agenda.told or agenda.own_goal or (None if s.route is None else s.route.end)
    if goal is None:
        return Begun(agenda, Stand(), problem="no goal was told")
    agenda = agenda.at(Berth(dock=step, place=agenda.due[0].place, pose=goal, body_at=goal))
    approach = None if step.approach is None else (step.approach.length, step.approach.direction)
    seen = None if step.kind is None else step.kind is not DockKind.KNOWN
    terms = GoalTerms(
        tolerance=step.tolerance, detected=seen, approach=approach, keep_out=_keep_out(step, around)
    )
    return Begun(agenda, GoTo(goal=goal, terms=terms), goal, goal)


def _keep_out(step: Dock, around: Around) -> tuple[Outline, ...]:
    """Where the body of the dock may be; none where the vehicle stands there already."""
    config = around.config
    body = body_polygons(np.array([[around.here.x, around.here.y, around.here.phi]]), config.vehicle)[0]
    near = shapely.Polygon(body).buffer(config.clearance.on_routes)
    return tuple(each for each in step.keep_out() if not near.intersects(shapely.Polygon(each)))


def _waiting(step: Wait, agenda: Agenda, around: Around) -> Begun:
    return Begun(agenda, Stand())


def _straight(step: Straight, agenda: Agenda, around: Around) -> Begun:
    berth = agenda.berth
    axis = berth.pose if berth is not None and berth.reached else None
    order, problem = straight_on(step, axis, around.here, around.area, around.config)
    if order is None:
        return Begun(agenda, Stand(), problem=problem)
    if berth is not None and berth.reached:
        agenda = replace(agenda, berth=replace(berth, joined=True))
    return Begun(agenda, order, order.manoeuvre.goal, axis)


def _undocking(step: Undock, agenda: Agenda, around: Around) -> Begun:
    ends = () if around.area is None else ways_out(around.here, step.distance, around.area, around.config)
    if not ends:
        return Begun(agenda, Stand(), problem="no end of a way out is clear")
    return Begun(replace(agenda, ways_out=ends), out_to(ends[0], around.config), ends[0])


def out_to(end: Pose2, config: ControllerConfig) -> GoTo:
    """The order to drive to the end of a way out."""
    return GoTo(goal=end, terms=GoalTerms(tolerance=_OUT_TOLERANCE, detected=False))


def _driving(step: DriveTo, agenda: Agenda, around: Around) -> Begun:
    order = GoTo(goal=step.pose, terms=GoalTerms(tolerance=step.tolerance, detected=False))
    return Begun(agenda.at(None), order, step.pose)


_BEGUN: dict[type[AnyStep], Callable[..., Begun]] = {
    Dock: _docking,
    Wait: _waiting,
    Straight: _straight,
    Undock: _undocking,
    DriveTo: _driving,
}
