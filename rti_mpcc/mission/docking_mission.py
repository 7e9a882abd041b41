"""DockingMission: a list of steps, driven by one controller, one command a cycle."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from estimation import GoalMeasurement, GoalStatus
from geometry import InputError, Pose2
from geometry.pose import degrees_hint
from geometry.validation import validated
from rti_mpcc.clock import CycleClock
from rti_mpcc.docking import DockingController
from rti_mpcc.mission.drive_to import DriveTo
from rti_mpcc.mission.progress import advance_mission, end_mission, start_step
from rti_mpcc.mission.state import DockState, MissionState, PendingStep, StepRecord
from rti_mpcc.mission.step import MissionCycle, Next, Step, StepOutcome, StepStart
from rti_mpcc.types import Command, MissionReport, MissionResult, VehicleState
from rti_mpcc.world import perception
from rti_mpcc.world.monitor import FARTHEST, LARGEST_HEADING

_BODY_MOVED = (0.1, 0.1, 0.05)
"""A body moves with a dock detected farther from it: longitudinal [m], lateral [m], heading [rad]."""

_log = logging.getLogger(__name__)


class DockingMission:
    """Drives a mission: gives the controller its orders, one step after the other.

    The steps that are left, and the progress, are the `mission_state` of `controller.state`.

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

    @validated()
    def __init__(
        self, controller: DockingController, steps: Sequence[Step], *, home: DriveTo | Pose2 | None = None
    ) -> None:
        self.controller, self.steps = controller, tuple(steps)
        self.home = DriveTo(home) if isinstance(home, Pose2) else home
        _check(self.steps, self.home, controller)
        # A mission that has made no cycle has left nothing anywhere.
        last = controller.state.mission_state if controller.has_stepped else None
        left = last.standing if isinstance(last, MissionState) else ()
        bodies = [step.body_at_pose for step in self.steps]
        mission_state = MissionState(
            pending=tuple(PendingStep(step=step, place=place) for place, step in enumerate(self.steps)),
            own_goal=controller.state.goal.planned,
            bodies=(*left, *(each for each in bodies if each is not None)),
        )
        controller.state = replace(controller.state, mission_state=mission_state)
        self.cancelling = False

    @property
    def mission_state(self) -> MissionState:
        """The steps that are left, and the progress."""
        mission_state = self.controller.state.mission_state
        assert isinstance(mission_state, MissionState)
        return mission_state

    @property
    def result(self) -> MissionResult:
        """Result of the mission; RUNNING while a step is left. See `over` for whether the vehicle stands."""
        return MissionResult.RUNNING if self.mission_state.pending else self.mission_state.result

    @property
    def over(self) -> bool:
        """Whether no step is left and the vehicle stands, with no command under way that was sent before.

        `result` alone does not say so: a mission that is cancelled, or out of time, still brakes.
        """
        s = self.controller.state
        return not self.mission_state.pending and s.vehicle.is_stationary(s.clock.now, s.vehicle.dead_time)

    @property
    def log(self) -> tuple[StepRecord, ...]:
        """All steps that were started, in order of time."""
        return self.mission_state.log

    @property
    def docks(self) -> bool:
        """Whether the step under way docks at a dock whose pose is not known: it needs detections."""
        step = self.mission_state.step
        return step is not None and step.detects

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
        over = self.signalled(signal)
        usable = None if goal is None else perception.usable_goal(goal)[0]
        if usable is not None:  # for the next dock without a pose
            self._keep(replace(self.mission_state, unused_goal=usable))
        self._guarded(lambda: self._start(now))
        command = self.controller.step(
            state,
            now=now,
            goal=self._own_goal(goal),
            measurements=measurements if self.docks else (),
            obstacles=self._obstacles(obstacles),
            clock=clock,
        )
        place = self.mission_state.pending[0] if self.mission_state.pending else None
        self._guarded(lambda: self._end(command, over))
        return replace(command, mission=self._report(place))

    # -- the parts of a cycle --------------------------------------------------------------------------

    def _start(self, now: float) -> None:
        """Start the step that is due, or end the mission, in the cycle at `now` on the user's clock [s]."""
        mission_state, controller = self.mission_state, self.controller
        clock, _ = perception.timed(controller.state.clock, now, controller.config)
        if self.cancelling:
            self.cancelling = False
            if mission_state.pending:
                self._take(end_mission(mission_state, MissionResult.CANCELLED, "", clock.now))
        elif mission_state.pending and mission_state.started is None:
            s = replace(controller.state, clock=clock)
            started = start_step(StepStart(mission_state, s, controller.config, controller.area))
            self._take(Next(started.mission_state, started.order))
            if started.problem:
                failed = StepOutcome(self.mission_state, MissionResult.NOT_REACHED, started.problem)
                self._advance(failed, clock.now)

    def _end(self, command: Command, over: bool) -> None:
        """Judge the step, and advance the mission."""
        mission_state, s, settings = self.mission_state, self.controller.state, self.controller.config.mission
        step = mission_state.step
        if mission_state.started is None or step is None:
            return
        cycle = MissionCycle(command, over, s.clock.now, settings.settled)
        self._advance(step.judged(step.observed(mission_state, s), cycle), s.clock.now)

    def _advance(self, outcome: StepOutcome, now: float) -> None:
        direction = self.controller.state.task.segment.part.direction
        back_off = self.controller.config.mission.back_off
        self._take(advance_mission(outcome, self.steps, self.home, direction, now, back_off))

    def _take(self, following: Next) -> None:
        self._keep(following.mission_state)
        if following.order is not None:
            self.controller.assign(following.order)

    def _keep(self, mission_state: MissionState) -> None:
        self.controller.state = replace(self.controller.state, mission_state=mission_state)

    def _guarded(self, part: Callable[[], None]) -> None:
        """An internal error ends the mission, not the control."""
        before = self.controller.state
        try:
            part()
        except Exception as error:
            _log.exception("internal error in a mission, the vehicle stops")
            reason = f"internal error: {' '.join(str(error).split())}"
            self.controller.state = replace(before, mission_state=self.mission_state)
            self._take(end_mission(self.mission_state, MissionResult.NOT_REACHED, reason, before.clock.now))

    # -- inputs and outputs ----------------------------------------------------------------------------

    def _own_goal(self, goal: Pose2 | None) -> Pose2 | None:
        """The goal for a controller that docks without a pose: the one given now, or an earlier one."""
        mission_state = self.mission_state
        if mission_state.step is None or not mission_state.step.takes_goal:
            return None
        self._keep(replace(mission_state, unused_goal=None))
        return mission_state.unused_goal if goal is None else goal

    def signalled(self, signal: bool | None = None) -> bool:
        """Whether `until` of the step under way, or `signal` in place of that, says that it is over.

        A user's function that raises says no.
        """
        until = getattr(self.mission_state.step, "until", None)
        if self.mission_state.started is None or until is None:
            return False
        try:
            return bool(until() if signal is None else signal)
        except Exception:
            _log.exception("`until` of a step raised: taken for not yet")
            return False

    def _obstacles(self, given: Sequence[ArrayLike] | None) -> Sequence[ArrayLike] | None:
        """Obstacles for the controller: those that were given last, and the bodies of docks."""
        dock_state = self.mission_state.dock_state
        mission_state = replace(self.mission_state, dock_state=dock_state and self._detected(dock_state))
        bodies = mission_state.standing
        if given is not None:
            # An input that is no list stays as it is: the controller refuses it.
            with suppress(Exception):
                given = tuple(given)
            mission_state = replace(mission_state, obstacles=given)
        elif bodies and mission_state.obstacles is None:
            known = [each.outline for each in self.controller.state.area.tracked.obstacles]
            others = (each for each in known if not any(np.array_equal(each, body) for body in bodies))
            mission_state = replace(mission_state, obstacles=tuple(others))
        self._keep(mission_state)
        if not bodies or not isinstance(mission_state.obstacles, tuple):
            return mission_state.obstacles
        return (*mission_state.obstacles, *bodies)

    def _detected(self, dock_state: DockState) -> DockState:
        """With the body of the dock where the dock is detected.

        It is missing for a cycle between two places: else it would be taken for a fast obstacle.
        """
        estimate = self.controller.state.goal.estimate
        pose = None if estimate is None else estimate.pose
        if dock_state.body_at is None:
            return replace(dock_state, body_at=pose or dock_state.pose)
        if not self.docks or estimate is None or pose is None or estimate.status is not GoalStatus.TRACKING:
            return dock_state
        near = pose.relative_to(dock_state.body_at).within(_BODY_MOVED)
        return dock_state if near else replace(dock_state, body_at=None)

    def _report(self, pending: PendingStep | None) -> MissionReport:
        """The progress; `pending` was under way in this cycle, or is to start; None: no step was left."""
        mission_state = self.mission_state
        last, now = mission_state.log[-1] if mission_state.log else None, self.controller.state.clock.now
        if pending is not None:
            place, kind, attempt = pending.place, pending.step.word, pending.attempt
            ended = last is not None and mission_state.started is None and last.end == now
            result = last.result if last is not None and ended else MissionResult.RUNNING
        elif last is not None:
            place, kind, attempt, result = last.place, last.kind, last.attempt, last.result
        else:  # it was cancelled before any step was started
            place, kind, attempt, result = 0, self.steps[0].word, 0, mission_state.result
        return MissionReport(
            step=place, kind=kind, result=result, mission_result=self.result, attempt=attempt,
            reason=mission_state.reason,
        )  # fmt: skip


def _check(steps: tuple[Step, ...], home: DriveTo | None, controller: DockingController) -> None:
    """Refuse steps that are no mission of this controller. Raises InputError, see `DockingMission`."""
    if not steps:
        raise InputError("steps: a mission needs at least one")
    if home is not None:
        if home.retry_from is not None:
            raise InputError(f"home.retry_from = {home.retry_from}: it has no place in the mission")
        _check_pose(home.pose, "home.pose")
    for place, step in enumerate(steps):
        name = f"steps[{place}]"
        if not isinstance(step, Step) or not step.word:
            raise InputError(f"{name}: must be a step such as Dock, Wait or DriveTo, is {step!r}")
        if isinstance(pose := getattr(step, "pose", None), Pose2):
            _check_pose(pose, f"{name}.pose")
        if step.retry_from is not None and step.retry_from > place:
            raise InputError(f"{name}.retry_from = {step.retry_from}: must not be a later step")
        if step.then == "home" and home is None:
            raise InputError(f"{name}.then = 'home': the mission has no home")
        if step.needs_routes and controller.area is None:
            raise InputError(f"{name}: needs planned routes; this controller drives its path only")


def _check_pose(pose: Pose2, name: str) -> None:
    if perception.usable_goal(pose)[0] is None:
        raise InputError(
            f"{name} = {pose}: its coordinates must be at most {FARTHEST:g} m, "
            f"its heading at most {LARGEST_HEADING:g} rad"
        )
    if hint := degrees_hint(f"{name}.phi", pose.phi):
        _log.warning("%s", hint)
