"""DockingMission: a list of steps, driven by one controller, one command a cycle."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import cast

import numpy as np
from numpy.typing import ArrayLike

from estimation import GoalMeasurement, GoalStatus
from geometry import Pose2
from geometry.doors import door
from rti_mpcc.docking import DockingController
from rti_mpcc.mission.begin import Around, begin
from rti_mpcc.mission.checks import check
from rti_mpcc.mission.next_step import Next, after, ended
from rti_mpcc.mission.outcome import Outcome, outcome
from rti_mpcc.planning import validation
from rti_mpcc.planning.agenda import Agenda, Berth, Due, StepRecord
from rti_mpcc.planning.clock import CycleClock
from rti_mpcc.planning.state import ControllerState
from rti_mpcc.steps import AnyStep, Dock, DockKind, DriveTo, Step, Straight, Wait
from rti_mpcc.types import Array, Command, MissionReport, MissionResult, VehicleState

_BODY_MOVED = (0.1, 0.1, 0.05)
"""A dock that is detected farther than this from where it was is given again: longitudinal [m], lateral [m],
heading [rad]."""

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

    @door()
    def __init__(
        self,
        controller: DockingController,
        steps: Sequence[Step],
        *,
        home: DriveTo | Pose2 | None = None,
    ) -> None:
        self.controller, self.steps = controller, cast("tuple[AnyStep, ...]", tuple(steps))
        self.home = DriveTo(home) if isinstance(home, Pose2) else home
        check(self.steps, self.home, controller)
        due = tuple(Due(step=step, place=place) for place, step in enumerate(self.steps))
        agenda = Agenda(
            due=due,
            own_goal=controller.state.goal.planned,
            # A mission that has made no cycle has left nothing anywhere.
            bodies=_bodies(self.steps, controller.state.agenda if controller.has_stepped else None),
        )
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
        """What the mission has come to; RUNNING while a step is left. See `over` for whether it stands."""
        return MissionResult.RUNNING if self.agenda.due else self.agenda.result

    @property
    def over(self) -> bool:
        """Whether no step is left and the vehicle stands, with no command under way that was sent before.

        `result` alone does not say so: a mission that is cancelled, or out of time, still brakes.
        """
        s = self.controller.state
        return not self.agenda.due and s.vehicle.is_stationary(s.now, self.controller.config.dead_time)

    @property
    def log(self) -> tuple[StepRecord, ...]:
        """All steps that were begun, in order of time."""
        return self.agenda.log

    @property
    def docks(self) -> bool:
        """Whether the step under way makes for a dock that is not known: detections of it are of use."""
        step = self.agenda.step
        return isinstance(step, Dock) and step.kind is not DockKind.KNOWN

    @property
    def cancelling(self) -> bool:
        """Whether `cancel` was called since the last step."""
        return self._cancelled

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
        self._remember(goal)
        self._guarded(lambda: self._begin(now))
        command = self.controller.step(
            state,
            now=now,
            goal=self._own_goal(goal),
            measurements=measurements if self.docks else (),
            obstacles=self._obstacles(obstacles),
            clock=clock,
        )
        place = self.agenda.due[0] if self.agenda.due else None
        self._guarded(lambda: self._end(command, told))
        return replace(command, mission=self._report(place))

    # -- the three parts of a cycle --------------------------------------------------------------------

    def _begin(self, now: float) -> None:
        """Begin what is due, or end it all, in the cycle at `now` on the user's clock [s]."""
        agenda, controller = self.agenda, self.controller
        clock, _ = validation.timed(controller.state.clock, now, controller.config)
        if self._cancelled:
            self._cancelled = False
            if agenda.due:
                self._take(ended(agenda, MissionResult.CANCELLED, "", clock.now))
            return
        if not agenda.due or agenda.begun is not None:
            return
        s = replace(controller.state, clock=clock)
        found = begin(agenda, Around(s=s, config=controller.config, area=controller.area))
        self._take(Next(found.agenda, found.order))
        if found.problem:
            failed = Outcome(self.agenda, MissionResult.NOT_REACHED, found.problem)
            self._take(self._after(failed, clock.now))

    def _end(self, command: Command, told: bool) -> None:
        """See what the step has come to."""
        agenda, s = self.agenda, self.controller.state
        if agenda.begun is None or not agenda.due:
            return
        if isinstance(agenda.step, Dock):
            agenda = _making_for(agenda, agenda.step, s)
        settings = self.controller.config.mission
        self._take(self._after(outcome(agenda, command, told, s.now, settings), s.now))

    def _after(self, found: Outcome, now: float) -> Next:
        s, config = self.controller.state, self.controller.config
        return after(found, self.steps, self.home, s.task.segment.part.direction, now, config)

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
            why = f"mistake: {' '.join(str(error).split())}"
            self.controller.state = replace(before, agenda=self.agenda)
            self._take(ended(self.agenda, MissionResult.NOT_REACHED, why, before.now))

    # -- what comes in and goes out --------------------------------------------------------------------

    def _remember(self, goal: Pose2 | None) -> None:
        """Keep a goal that is told for the next `Dock` without a pose, if it is one to plan a way to."""
        usable = None if goal is None else validation.usable_goal(goal)
        if usable is not None:
            self._keep(replace(self.agenda, told=usable))

    def _own_goal(self, goal: Pose2 | None) -> Pose2 | None:
        """What the controller is told while it docks without a pose: the goal, or an earlier one."""
        agenda = self.agenda
        if not isinstance(agenda.step, Dock) or agenda.step.pose is not None:
            return None
        self._keep(replace(agenda, told=None))
        return agenda.told if goal is None else goal

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
        """What the controller is told: what was given last, and what stands at docks."""
        agenda = self.agenda
        agenda = replace(agenda, berth=agenda.berth and self._seen(agenda.berth))
        bodies = agenda.standing
        if given is not None:
            agenda = replace(agenda, obstacles=_listed(given))
        elif bodies and agenda.obstacles is None:
            known = [each.outline for each in self.controller.state.area.obstacles]
            others = tuple(each for each in known if not any(map(partial(np.array_equal, each), bodies)))
            agenda = replace(agenda, obstacles=others)
        self._keep(agenda)
        if not bodies or not isinstance(agenda.obstacles, tuple):
            return agenda.obstacles
        return (*agenda.obstacles, *bodies)

    def _seen(self, berth: Berth) -> Berth:
        """With what is docked at where the dock is detected to be.

        In between it is not told for a cycle: else it would be taken to move, and fast.
        """
        estimate, moved = self.controller.state.goal.estimate, _BODY_MOVED
        if berth.body_at is None:
            return replace(berth, body_at=berth.pose if estimate is None else estimate.pose or berth.pose)
        if not self.docks or estimate is None or estimate.pose is None:
            return berth
        known = estimate.status is GoalStatus.TRACKING
        if not known or estimate.pose.relative_to(berth.body_at).within(moved):
            return berth
        return replace(berth, body_at=None)

    def _report(self, due: Due | None) -> MissionReport:
        """How it goes on; `due` was under way in this cycle, or is to begin; None: no step was left."""
        agenda = self.agenda
        last = agenda.log[-1] if agenda.log else None
        if due is not None:
            ended = agenda.begun is None and last is not None and last.end == self.controller.state.now
            place, kind, attempt = due.place, due.step.word, due.attempt
            result = last.result if ended and last is not None else MissionResult.RUNNING
        elif last is not None:
            place, kind, attempt, result = last.place, last.kind, last.attempt, last.result
        else:  # it was cancelled before any step was begun
            place, kind, attempt, result = 0, self.steps[0].word, 0, agenda.result
        return MissionReport(
            step=place,
            kind=kind,
            result=result,
            mission_result=self.result,
            attempt=attempt,
            reason=agenda.reason,
        )


def _listed(given: Sequence[ArrayLike]) -> Sequence[ArrayLike]:
    """The outlines as a tuple; what is no list stays as it is: the controller says so."""
    try:
        return tuple(given)
    except Exception:
        return given


def _making_for(agenda: Agenda, dock: Dock, s: ControllerState) -> Agenda:
    """With the pose that is made for; of a dock without a pose also the goal that was given.

    Where that was not known when the step was begun, it is what the step is to end in.
    """
    pose = s.goal_pose or (None if s.on_planned_way else s.path.end)
    if pose is None:
        return agenda
    if agenda.berth is None:
        agenda = agenda.at(Berth(dock=dock, place=agenda.due[0].place, pose=pose, body_at=pose))
    berth = agenda.berth
    assert berth is not None
    own = s.goal.planned if dock.pose is None else agenda.own_goal
    *before, record = agenda.log
    if record.goal is None:
        record = replace(record, goal=pose, dock=pose)
    return replace(agenda, berth=replace(berth, pose=pose), own_goal=own, log=(*before, record))


def _bodies(steps: tuple[AnyStep, ...], last: Agenda | None) -> tuple[Array, ...]:
    """What stands at the docks of a mission, and where the last mission of its controller has left some."""
    left = () if last is None else last.standing
    docks = [step for step in steps if isinstance(step, Dock) and step.pose is not None]
    placed = [step.body_at(step.pose) for step in docks if step.pose is not None]
    return (*left, *(each for each in placed if each is not None))
