"""DockingMission: a list of steps, driven by one controller, one command a cycle."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import cast

import numpy as np
from numpy.typing import ArrayLike

from estimation import GoalMeasurement, GoalStatus
from geometry import InputError, Pose2
from geometry.angles import degrees_hint
from geometry.doors import door
from rti_mpcc.docking import DockingController
from rti_mpcc.mission.progress import Next, StepOutcome, advance_mission, end_mission, judge_step
from rti_mpcc.mission.start import start_step
from rti_mpcc.planning import validation
from rti_mpcc.planning.agenda import Agenda, Berth, Due, StepRecord
from rti_mpcc.planning.clock import CycleClock
from rti_mpcc.planning.plausibility import FARTHEST, LARGEST_HEADING
from rti_mpcc.planning.state import ControllerState
from rti_mpcc.steps import AnyStep, Dock, DockKind, DriveTo, Step, Straight, Undock, Wait
from rti_mpcc.types import Command, MissionReport, MissionResult, VehicleState

_BODY_MOVED = (0.1, 0.1, 0.05)
"""A body is moved with its dock where that is detected farther than this from it: longitudinal [m],
lateral [m], heading [rad]."""

_log = logging.getLogger(__name__)


class DockingMission:
    """Drives a mission: gives the controller its orders, one step after the other.

    The steps that are left, and the progress, are the `agenda` of `controller.state`.

    Args:
        controller: that drives; one that has a mission takes this one in its place.
        steps: at least one.
        home: where to drive after a step that failed for good and says `then="home"`.

    Attributes:
        controller, steps, home: as given; cancelling: `cancel` was called since the last step.

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
        _check(self.steps, self.home, controller)
        # A mission that has made no cycle has left nothing anywhere.
        last = controller.state.agenda if controller.has_stepped else None
        docks = [step for step in self.steps if isinstance(step, Dock) and step.pose is not None]
        bodies = [step.body_at(step.pose) for step in docks if step.pose is not None]
        agenda = Agenda(
            due=tuple(Due(step=step, place=place) for place, step in enumerate(self.steps)),
            own_goal=controller.state.goal.planned,
            bodies=(*(last.standing if last else ()), *(each for each in bodies if each is not None)),
        )
        controller.state = replace(controller.state, agenda=agenda)
        self.cancelling = False

    @property
    def agenda(self) -> Agenda:
        """The steps that are left, and the progress."""
        agenda = self.controller.state.agenda
        assert agenda is not None
        return agenda

    @property
    def result(self) -> MissionResult:
        """Result of the mission; RUNNING while a step is left. See `over` for whether the vehicle stands."""
        return MissionResult.RUNNING if self.agenda.due else self.agenda.result

    @property
    def over(self) -> bool:
        """Whether no step is left and the vehicle stands, with no command under way that was sent before.

        `result` alone does not say so: a mission that is cancelled, or out of time, still brakes.
        """
        s = self.controller.state
        return not self.agenda.due and s.vehicle.is_stationary(s.now, s.vehicle.dead_time)

    @property
    def log(self) -> tuple[StepRecord, ...]:
        """All steps that were started, in order of time."""
        return self.agenda.log

    @property
    def docks(self) -> bool:
        """Whether the step under way docks at a dock whose pose is not known: it needs detections."""
        step = self.agenda.step
        return isinstance(step, Dock) and step.kind is not DockKind.KNOWN

    def cancel(self) -> None:
        """End it with the next cycle: the vehicle brakes to a standstill as soon as possible, and stands."""
        self.cancelling = True

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
        """One cycle, see `DockingController.step`; its command has the progress of the mission.

        1. Start the step that is due, if none is under way: the controller gets its order.
        2. The controller makes its cycle. Detections reach it while it docks, obstacles always.
        3. Judge the outcome of the step; advance the mission.

        Args:
            goal: of a `Dock` without a pose.
            signal: in place of `until` of the step under way; None: that is asked.
        """
        over = self.told(signal)
        usable = None if goal is None else validation.usable_goal(goal)
        if usable is not None:  # for the next dock without a pose
            self._keep(replace(self.agenda, told=usable))
        self._guarded(lambda: self._start(now))
        command = self.controller.step(
            state,
            now=now,
            goal=self._own_goal(goal),
            measurements=measurements if self.docks else (),
            obstacles=self._obstacles(obstacles),
            clock=clock,
        )
        place = self.agenda.due[0] if self.agenda.due else None
        self._guarded(lambda: self._end(command, over))
        return replace(command, mission=self._report(place))

    # -- the parts of a cycle --------------------------------------------------------------------------

    def _start(self, now: float) -> None:
        """Start the step that is due, or end the mission, in the cycle at `now` on the user's clock [s]."""
        agenda, controller = self.agenda, self.controller
        clock, _ = validation.timed(controller.state.clock, now, controller.config)
        if self.cancelling:
            self.cancelling = False
            if agenda.due:
                self._take(end_mission(agenda, MissionResult.CANCELLED, "", clock.now))
        elif agenda.due and agenda.begun is None:
            s = replace(controller.state, clock=clock)
            started = start_step(agenda, s, controller.config, controller.area)
            self._take(Next(started.agenda, started.order))
            if started.problem:
                failed = StepOutcome(self.agenda, MissionResult.NOT_REACHED, started.problem)
                self._advance(failed, clock.now)

    def _end(self, command: Command, over: bool) -> None:
        """Judge the step, and advance the mission."""
        agenda, s, settings = self.agenda, self.controller.state, self.controller.config.mission
        if agenda.begun is None or not agenda.due:
            return
        if isinstance(agenda.step, Dock):
            agenda = _with_dock_pose(agenda, agenda.step, s)
        self._advance(judge_step(agenda, command, over, s.now, settings), s.now)

    def _advance(self, outcome: StepOutcome, now: float) -> None:
        direction = self.controller.state.task.segment.part.direction
        back_off = self.controller.config.mission.back_off
        self._take(advance_mission(outcome, self.steps, self.home, direction, now, back_off))

    def _take(self, following: Next) -> None:
        self._keep(following.agenda)
        if following.order is not None:
            self.controller.assign(following.order)

    def _keep(self, agenda: Agenda) -> None:
        self.controller.state = replace(self.controller.state, agenda=agenda)

    def _guarded(self, part: Callable[[], None]) -> None:
        """An internal error ends the mission, not the control."""
        before = self.controller.state
        try:
            part()
        except Exception as error:
            _log.exception("internal error in a mission, the vehicle stops")
            reason = f"internal error: {' '.join(str(error).split())}"
            self.controller.state = replace(before, agenda=self.agenda)
            self._take(end_mission(self.agenda, MissionResult.NOT_REACHED, reason, before.now))

    # -- inputs and outputs ----------------------------------------------------------------------------

    def _own_goal(self, goal: Pose2 | None) -> Pose2 | None:
        """The goal for a controller that docks without a pose: the one given now, or an earlier one."""
        agenda = self.agenda
        if not isinstance(agenda.step, Dock) or agenda.step.pose is not None:
            return None
        self._keep(replace(agenda, told=None))
        return agenda.told if goal is None else goal

    def told(self, signal: bool | None = None) -> bool:
        """Whether `until` of the step under way, or `signal` in place of that, says that it is over.

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
        """Obstacles for the controller: those that were given last, and the bodies of docks."""
        agenda = self.agenda
        agenda = replace(agenda, berth=agenda.berth and self._detected(agenda.berth))
        bodies = agenda.standing
        if given is not None:
            # An input that is no list stays as it is: the controller refuses it.
            with suppress(Exception):
                given = tuple(given)
            agenda = replace(agenda, obstacles=given)
        elif bodies and agenda.obstacles is None:
            known = [each.outline for each in self.controller.state.area.obstacles]
            others = (each for each in known if not any(np.array_equal(each, body) for body in bodies))
            agenda = replace(agenda, obstacles=tuple(others))
        self._keep(agenda)
        if not bodies or not isinstance(agenda.obstacles, tuple):
            return agenda.obstacles
        return (*agenda.obstacles, *bodies)

    def _detected(self, berth: Berth) -> Berth:
        """With the body of the dock where the dock is detected.

        It is missing for a cycle between two places: else it would be taken for a fast obstacle.
        """
        estimate = self.controller.state.goal.estimate
        pose = None if estimate is None else estimate.pose
        if berth.body_at is None:
            return replace(berth, body_at=pose or berth.pose)
        if not self.docks or estimate is None or pose is None or estimate.status is not GoalStatus.TRACKING:
            return berth
        return berth if pose.relative_to(berth.body_at).within(_BODY_MOVED) else replace(berth, body_at=None)

    def _report(self, due: Due | None) -> MissionReport:
        """The progress; `due` was under way in this cycle, or is to start; None: no step was left."""
        agenda = self.agenda
        last = agenda.log[-1] if agenda.log else None
        if due is not None:
            ended = agenda.begun is None and last is not None and last.end == self.controller.state.now
            result = last.result if ended and last is not None else MissionResult.RUNNING
            place, kind, attempt = due.place, due.step.word, due.attempt
        elif last is not None:
            place, kind, attempt, result = last.place, last.kind, last.attempt, last.result
        else:  # it was cancelled before any step was started
            place, kind, attempt, result = 0, self.steps[0].word, 0, agenda.result
        return MissionReport(
            step=place, kind=kind, result=result, mission_result=self.result, attempt=attempt,
            reason=agenda.reason,
        )  # fmt: skip


def _with_dock_pose(agenda: Agenda, dock: Dock, s: ControllerState) -> Agenda:
    """With the present pose of the dock; of a dock without a pose also the goal that was given.

    Where that was not known at the start of the step, it is where the step is to end.
    """
    pose = s.goal_pose or (None if s.on_planned_way else s.path.end)
    if pose is None:
        return agenda
    berth = agenda.berth
    if berth is None:
        berth = Berth(dock=dock, place=agenda.due[0].place, pose=pose, body_at=pose)
        agenda = agenda.at(berth)
    own = s.goal.planned if dock.pose is None else agenda.own_goal
    *before, record = agenda.log
    if record.goal is None:
        record = replace(record, goal=pose, dock=pose)
    return replace(agenda, berth=replace(berth, pose=pose), own_goal=own, log=(*before, record))


def _check(steps: tuple[AnyStep, ...], home: DriveTo | None, controller: DockingController) -> None:
    """Refuse steps that are no mission of this controller. Raises InputError, see `DockingMission`."""
    if not steps:
        raise InputError("steps: a mission needs at least one")
    if home is not None:
        if home.retry_from is not None:
            raise InputError(f"home.retry_from = {home.retry_from}: it has no place in the mission")
        _check_pose(home.pose, "home.pose")
    for place, step in enumerate(steps):
        name = f"steps[{place}]"
        if not isinstance(step, Dock | Wait | Straight | Undock | DriveTo):
            raise InputError(f"{name}: must be a Dock, Wait, Straight, Undock or DriveTo, is {step!r}")
        if isinstance(step, Dock | DriveTo) and step.pose is not None:
            _check_pose(step.pose, f"{name}.pose")
        if step.retry_from is not None and step.retry_from > place:
            raise InputError(f"{name}.retry_from = {step.retry_from}: must not be a later step")
        if step.then == "home" and home is None:
            raise InputError(f"{name}.then = 'home': the mission has no home")
        drives = isinstance(step, Straight | Undock | DriveTo) or (isinstance(step, Dock) and step.pose)
        if drives and controller.area is None:
            raise InputError(f"{name}: needs planned routes; this controller drives its path only")


def _check_pose(pose: Pose2, name: str) -> None:
    if validation.usable_goal(pose) is None:
        raise InputError(
            f"{name} = {pose}: its coordinates must be at most {FARTHEST:g} m, "
            f"its heading at most {LARGEST_HEADING:g} rad"
        )
    if hint := degrees_hint(f"{name}.phi", pose.phi):
        _log.warning("%s", hint)
