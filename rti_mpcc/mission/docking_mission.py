"""DockingMission: a list of steps, driven by one controller, one command a cycle."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from dataclasses import replace

from numpy.typing import ArrayLike

from estimation import GoalMeasurement, GoalStatus
from geometry import InputError, Pose2
from rti_mpcc.docking import DockingController
from rti_mpcc.mission.begin import Around, begin
from rti_mpcc.mission.next_step import Next, after, cancelled
from rti_mpcc.mission.outcome import Outcome, outcome
from rti_mpcc.orders import Stand
from rti_mpcc.planning.agenda import Agenda, Berth, Due, StepRecord
from rti_mpcc.planning.clock import CycleClock
from rti_mpcc.planning.state import ControllerState
from rti_mpcc.steps import AnyStep, Dock, DriveTo, Straight, Undock, Wait
from rti_mpcc.types import Command, MissionReport, MissionResult, VehicleState

_log = logging.getLogger(__name__)


class DockingMission:
    """Drives a mission: gives the controller its orders, one step after the other.

    What is left of the mission, and how it goes, is the `agenda` of `controller.state`.

    Args:
        controller: that drives; one that has a mission takes this one in its place.
        steps: at least one.
        home: where to drive after a step that failed for good and says `then="home"`.

    Attributes:
        controller, steps, home: as given.

    Raises:
        InputError: no step, one that is none, one to be tried again from a later one or to drive home
            without a home, or one that needs planned ways, where the controller plans none.
    """

    def __init__(
        self,
        controller: DockingController,
        steps: Sequence[AnyStep],
        *,
        home: DriveTo | Pose2 | None = None,
    ) -> None:
        self.controller, self.steps = controller, tuple(steps)
        self.home = DriveTo(home) if isinstance(home, Pose2) else home
        _check(self.steps, self.home, controller)
        due = tuple(Due(step=step, place=place) for place, step in enumerate(self.steps))
        agenda = Agenda(due=due, own_goal=controller.state.goal.planned)
        controller.state = replace(controller.state, agenda=agenda)
        self._cancelled = False

    @property
    def agenda(self) -> Agenda:
        """What is left of it, and how it goes."""
        agenda = self.controller.state.agenda
        assert agenda is not None
        return agenda

    @property
    def result(self) -> MissionResult:
        """What the mission has come to; RUNNING until it is over."""
        return MissionResult.RUNNING if self.agenda.due else self.agenda.result

    @property
    def log(self) -> tuple[StepRecord, ...]:
        """All steps that were begun, in order of time."""
        return self.agenda.log

    @property
    def docks(self) -> bool:
        """Whether the step under way makes for a dock: detections of it are of use."""
        return isinstance(self.agenda.step, Dock)

    def cancel(self) -> None:
        """End it with the next step: the vehicle brakes to a standstill as soon as can be, and stands."""
        self._cancelled = True

    def step(
        self,
        state: VehicleState,
        *,
        now: float,
        goal: Pose2 | None = None,
        measurements: Sequence[GoalMeasurement] = (),
        obstacles: Sequence[ArrayLike] | None = None,
        clock: CycleClock | None = None,
        signal: bool | None = None,
    ) -> Command:
        """One cycle, see `DockingController.step`; its command says how the mission goes on.

        1. Begin the step that is due, where nothing is under way: the controller gets its order.
        2. Let the controller make its cycle. Detections reach it while it docks, obstacles always.
        3. See what the step has come to, and what comes next.

        Args:
            goal: of a `Dock` without a pose.
            signal: what `until` of the step under way would say; None: it is asked.
        """
        told = self.told(signal)
        self._guarded(lambda: self._begin(goal if isinstance(goal, Pose2) else None))
        step = self.agenda.step
        command = self.controller.step(
            state,
            now=now,
            goal=goal if isinstance(step, Dock) and step.pose is None else None,
            measurements=measurements if self.docks else (),
            obstacles=self._obstacles(obstacles),
            clock=clock,
        )
        place = self.agenda.due[0] if self.agenda.due else None
        self._guarded(lambda: self._end(command, told))
        return replace(command, mission=self._report(place))

    # -- the three parts of a cycle --------------------------------------------------------------------

    def _begin(self, goal: Pose2 | None) -> None:
        """Begin what is due, or end it all; `goal` was told in this cycle."""
        agenda, controller = self.agenda, self.controller
        if self._cancelled:
            self._cancelled = False
            if agenda.due:
                self._take(cancelled(agenda, controller.state.now))
            return
        if not agenda.due or agenda.begun is not None:
            return
        around = Around(s=controller.state, config=controller.config, area=controller.area, told=goal)
        found = begin(agenda, around)
        self._take(Next(found.agenda, found.order))
        if found.problem:
            failed = Outcome(self.agenda, MissionResult.NOT_REACHED, found.problem)
            self._take(self._after(failed))

    def _end(self, command: Command, told: bool) -> None:
        """See what the step has come to."""
        agenda, s = self.agenda, self.controller.state
        if agenda.begun is None or not agenda.due:
            return
        if isinstance(agenda.step, Dock):
            agenda = _making_for(agenda, agenda.step, s)
        settings = self.controller.config.mission
        self._take(self._after(outcome(agenda, command, told, s.now, settings)))

    def _after(self, found: Outcome) -> Next:
        s, config = self.controller.state, self.controller.config
        return after(found, self.steps, self.home, s.task.segment.part.direction, s.now, config)

    def _take(self, following: Next) -> None:
        self._keep(following.agenda)
        if following.order is not None:
            self.controller.assign(following.order)

    def _keep(self, agenda: Agenda) -> None:
        self.controller.state = replace(self.controller.state, agenda=agenda)

    def _guarded(self, part: Callable[[], None]) -> None:
        """A mistake of this program ends the mission, not the control."""
        before = self.controller.state
        try:
            part()
        except Exception as error:
            _log.exception("mistake in a mission, the vehicle stands")
            agenda = replace(
                self.agenda, due=(), result=MissionResult.NOT_REACHED, reason=f"mistake: {error}"
            )
            self.controller.state = replace(before, agenda=agenda)
            self.controller.assign(Stand())

    # -- what comes in and goes out --------------------------------------------------------------------

    def told(self, signal: bool | None = None) -> bool:
        """Whether the step under way is told to be over: by its `until`, or by `signal` in the place of that.

        A user's function that raises says no.
        """
        agenda, step = self.agenda, self.agenda.step
        if agenda.begun is None or not isinstance(step, Straight | Wait) or step.until is None:
            return False
        try:
            return bool(step.until() if signal is None else signal)
        except Exception:
            _log.exception("`until` of a step raised: taken for not yet")
            return False

    def _obstacles(self, given: Sequence[ArrayLike] | None) -> Sequence[ArrayLike] | None:
        """What the controller is told: what was given last, and what is docked at."""
        agenda = self.agenda
        agenda = replace(agenda, berth=agenda.berth and self._seen(agenda.berth))
        body = None if agenda.berth is None else agenda.berth.body
        if given is not None:
            agenda = replace(agenda, obstacles=_listed(given))
        elif body is not None and agenda.obstacles is None:
            known = self.controller.state.area.obstacles
            agenda = replace(agenda, obstacles=tuple(each.outline for each in known))
        self._keep(agenda)
        if body is None or not isinstance(agenda.obstacles, tuple):
            return agenda.obstacles
        return (*agenda.obstacles, body)

    def _seen(self, berth: Berth) -> Berth:
        """With what is docked at where the dock is detected to be.

        In between it is not told for a cycle: else it would be taken to move, and fast.
        """
        estimate, moved = self.controller.state.goal.estimate, self.controller.config.mission.body_moved
        if berth.body_at is None:
            return replace(berth, body_at=berth.pose if estimate is None else estimate.pose or berth.pose)
        if not self.docks or estimate is None or estimate.pose is None:
            return berth
        known = estimate.status is GoalStatus.TRACKING
        if not known or estimate.pose.relative_to(berth.body_at).within(moved):
            return berth
        return replace(berth, body_at=None)

    def _report(self, due: Due | None) -> MissionReport:
        """How it goes on; `due` was under way in this cycle, or is to begin; None: the mission was over."""
        agenda = self.agenda
        last = agenda.log[-1] if agenda.log else None
        if due is None:
            place = len(self.steps) - 1 if last is None else last.place
            kind = self.steps[place].word if last is None else last.kind
            return MissionReport(step=place, kind=kind, result=agenda.result, reason=agenda.reason)
        ended = agenda.begun is None and last is not None and last.end == self.controller.state.now
        result = last.result if ended and last is not None else MissionResult.RUNNING
        return MissionReport(
            step=due.place, kind=due.step.word, result=result, attempt=due.attempt, reason=agenda.reason
        )


def _listed(given: Sequence[ArrayLike]) -> Sequence[ArrayLike]:
    """The outlines as a tuple; what is no list stays as it is: the controller says so."""
    try:
        return tuple(given)
    except TypeError:
        return given


def _making_for(agenda: Agenda, dock: Dock, s: ControllerState) -> Agenda:
    """With the pose that is made for; of a dock without a pose also the goal that was given."""
    pose = s.goal_pose or (None if s.on_planned_way else s.path.end)
    if pose is None:
        return agenda
    berth = agenda.berth or Berth(dock=dock, pose=pose, body_at=pose)
    own = s.goal.planned if dock.pose is None else agenda.own_goal
    return replace(agenda, berth=replace(berth, pose=pose), own_goal=own)


def _check(steps: tuple[AnyStep, ...], home: DriveTo | None, controller: DockingController) -> None:
    if not steps:
        raise InputError("steps: a mission needs one at least")
    if home is not None and not isinstance(home, DriveTo):
        raise InputError(f"home = {home!r}: must be a DriveTo or a Pose2")
    for place, step in enumerate(steps):
        name = f"steps[{place}]"
        if not isinstance(step, Dock | Wait | Straight | Undock | DriveTo):
            raise InputError(f"{name}: must be a Dock, Wait, Straight, Undock or DriveTo, is {step!r}")
        if step.retry_from is not None and step.retry_from > place:
            raise InputError(f"{name}.retry_from = {step.retry_from}: must not be a later step")
        if step.then == "home" and home is None:
            raise InputError(f"{name}.then = 'home': the mission has no home")
        drives = isinstance(step, Straight | Undock | DriveTo) or (isinstance(step, Dock) and step.pose)
        if drives and controller.area is None:
            raise InputError(f"{name}: needs planned ways, and this controller drives its path only")
