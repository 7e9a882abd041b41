"""DockingController: from following a path to standing at the dock, one command a cycle.

It composes the layers below and decides nothing itself: what comes in is checked, set against the route
(`Navigator`), driven by (`Driver`: what the phase asks for, or the next rung of the fallback; `Scout` finds
its first plans), and checked again on its way out.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from estimation import GoalMeasurement, GoalPoseFilter, Judgement
from estimation.disturbance import load_library
from geometry import Corridor, Pose2, ReferencePath
from rti_mpcc.config import ControllerConfig
from rti_mpcc.driving import Driver
from rti_mpcc.model.delay import QueuedCommand, queued
from rti_mpcc.model.layout import PHI, STATES, X, Y
from rti_mpcc.planning import aim, goals, legs, offsets, route, validation
from rti_mpcc.planning.clock import CycleClock
from rti_mpcc.planning.memory import ControllerMemory, PlanningContext, renewed
from rti_mpcc.planning.plausibility import StateMonitor, by_commands, validate_measurement
from rti_mpcc.qp.problem import QpProblem
from rti_mpcc.safety import fallback, limiter
from rti_mpcc.safety.decision import ControlDecision, command, emergency
from rti_mpcc.types import Command, Status, VehicleState

_log = logging.getLogger(__name__)

MISTAKE = "mistake in this program"
"""Begin of the reason where the controller itself went wrong."""


class DockingController(Driver):
    """Drives a vehicle along a route and into its goal pose.

    Args:
        path: the route; corridor: its boundaries and obstacles; config: settings, all with defaults.

    Raises:
        CorridorError: the corridor is narrower than the body.
    """

    def __init__(
        self, path: ReferencePath, corridor: Corridor, config: ControllerConfig | None = None
    ) -> None:
        super().__init__(path, corridor, config or ControllerConfig())
        tracking = self.config.goal_tracking
        self._filter = GoalPoseFilter(tracking.filter) if tracking.required else None
        if self.config.disturbance.enabled:
            load_library()

    @property
    def memory(self) -> ControllerMemory:
        """What this controller remembers from cycle to cycle."""
        return self._memory

    @property
    def has_stepped(self) -> bool:
        """Whether it has made a cycle."""
        return self._memory.time is not None

    @property
    def corridor(self) -> Corridor:
        """Where the vehicle may be, with the obstacles that were told last."""
        return self._surroundings.known

    def clear_goal(self) -> None:
        """Forget the goal and its detections: the path's last pose is the goal again."""
        self._memory = renewed(self._memory, goal_fit=None, given_fit=None, refusal="")
        self._plan_for(None)

    def step(
        self,
        state: VehicleState,
        *,
        now: float,
        goal: Pose2 | None = None,
        measurements: Sequence[GoalMeasurement] = (),
        obstacles: Sequence[ArrayLike] | None = None,
        clock: CycleClock | None = None,
    ) -> Command:
        """One cycle: the command to apply from now until the next step.

        No value that comes in makes it raise: what is not fit to be used is left out, and said.

        Args:
            state: measured at `now`.
            now: on any clock that runs on [s].
            goal: pose to end in; None keeps the last one. Without any it is the path's last pose. One that is
                out of reach is not taken (`planning.goals`): the last one stays, and the reason says so. With
                detections it is the planned goal, made for until they say better; another one than the last
                is another dock, whose detections begin anew.
            measurements: detections of the goal that arrived since the last step, in any order.
            obstacles: polygons (m, 2) [m] to keep out of; None keeps the last ones.
            clock: decides what depends on time in this cycle; None: the wall clock and `config.deadline`. For
                recordings and tests.
        """
        clock = clock or CycleClock(self.config.deadline)
        before = self._memory
        try:
            return self._cycle(state, now, goal, measurements, obstacles, clock)
        except Exception as error:
            # A mistake of this program must not leave the vehicle without a command.
            _log.exception("mistake in a cycle, the vehicle is braked")
            return self._rescue(before, error, clock)

    def _cycle(
        self,
        state: VehicleState,
        now: float,
        goal: Pose2 | None,
        measurements: Sequence[GoalMeasurement],
        obstacles: Sequence[ArrayLike] | None,
        clock: CycleClock,
    ) -> Command:
        remarks = self._receive(state, now, goal, obstacles)
        measurements, unfit = validation.measurements_in(measurements)
        detections = self._locate_goal(measurements)
        self._aim()
        situation = self._situation()
        decision = self._driven(situation, clock)
        measured = self._memory.monitor.heeded(self.config)
        control = limiter.saturate_command(
            decision.control, situation.state, measured, self.config, self._memory.disturbance
        )
        decision = replace(decision, control=control)
        self._remember(decision, situation)
        remarks = (*remarks, unfit, *aim.remarks(self._memory))
        return command(decision, situation, self._memory, detections, remarks, self.config, clock)

    def _rescue(self, before: ControllerMemory, error: Exception, clock: CycleClock) -> Command:
        """Brake, and begin afresh in the next cycle with what was known before this one."""
        memory, config = self._memory, self.config
        reason = f"{MISTAKE}: {type(error).__name__}: {' '.join(str(error).split())}"
        reached, known = before.reached, memory.disturbance
        if memory.monitor.state is not None:
            begin = memory.now + config.dead_time
            reached = by_commands(memory.monitor.state, memory.queue, memory.now, begin, config, known)
            reached = known.effective(reached)
        if reached is None:
            reached = np.zeros(STATES)
        control = fallback.brake(reached, fallback.braking(config), config)
        control = limiter.saturate_command(control, reached, memory.monitor.heeded(config), config, known)
        self._memory = route.braked(memory, control.acceleration, reason, config)
        self._begin_leg()
        return emergency(control, reached, self._memory, reason, config, clock)

    def problem(self) -> QpProblem:
        """The QP of the last cycle that solved one, for study off line."""
        return self._mpcc.problem()

    # -- what comes in ------------------------------------------------------------------------------

    def _receive(
        self,
        state: VehicleState,
        now: float,
        goal: Pose2 | None,
        obstacles: Sequence[ArrayLike] | None,
    ) -> tuple[str, ...]:
        """Take what is new, in so far as it can be used; says what could not."""
        memory, clock_remark = validation.timed(self._memory, now, self.config.cycle)
        surroundings, unreadable = validation.surroundings_in(
            self._surroundings, obstacles, memory.now, self.config.caution
        )
        if obstacles is None:
            unreadable = memory.unreadable
        monitor = validate_measurement(
            memory.monitor, state, memory.queue, memory.now, self.config, memory.disturbance
        )
        known = offsets.learnt(memory, monitor, self.config)
        monitor = monitor.doubting(unreadable, memory.monitor)
        hint = self._heading_hint(memory, monitor)
        memory = renewed(memory, monitor=monitor, offsets=known, unreadable=unreadable, heading_hint=hint)
        self._memory, goal = validation.goal_in(goal, memory, self.path, surroundings, self.config)
        changed = surroundings.corridor is not self._surroundings.corridor
        self._surroundings = surroundings
        if changed:
            self._look_round()
        if goal is not None:
            self._plan_for(goal)
        return clock_remark, hint

    def _heading_hint(self, memory: ControllerMemory, monitor: StateMonitor) -> str:
        """What there is to say of the heading measured first, as long as one as large is measured."""
        state, measured = monitor.state, monitor.measured
        if state is None or measured is None or abs(float(measured[PHI])) <= goals.FULL_TURN:
            return ""
        if memory.monitor.state is not None:
            return memory.heading_hint
        here = Pose2(float(state[X]), float(state[Y]), float(state[PHI]))
        return goals.degrees_hint("heading", here, self.path.parts[memory.part])

    def _plan_for(self, goal: Pose2 | None) -> None:
        self._memory = legs.with_goal(self._memory, goal)
        if self._filter is not None:
            self._filter.reset()

    def _locate_goal(self, measurements: Sequence[GoalMeasurement]) -> tuple[Judgement, ...]:
        """Filter what was detected, and let the pose made for follow; says what became of the detections."""
        settings, now = self.config.goal_tracking.filter, self._memory.now
        self._memory = aim.noted(self._memory, settings.history)
        if measurements and self._filter is None:
            self._filter = GoalPoseFilter(settings)
        if self._filter is None:
            return ()
        self._filter.predict(now)
        judgements = []
        for measurement in measurements:
            own = validation.measurement_in(measurement, self._memory.clock_offset)
            judgement = self._filter.update(aim.placed(own, self._memory, settings))
            judgements.append(replace(judgement, stamp=measurement.stamp))
        estimate = self._filter.estimate(now)
        fit = None
        if estimate.pose is not None:
            last = self._memory.estimate_fit
            fit = goals.checked_again(last, estimate.pose, self.path, self._surroundings, self.config)
        self._memory = aim.rate_limited_goal(self._memory, estimate, self.path.end, now, self.config, fit)
        return tuple(judgements)

    def _situation(self) -> PlanningContext:
        """Where the command will begin to act, on the part that the vehicle is on by then."""
        if self._memory.monitor.found:
            self._memory = route.found(self._memory)
        situation = self._assess()
        memory = self._next_leg(situation)
        if memory is None:
            return situation
        self._memory = memory
        self._begin_leg()
        self._aim()
        return self._assess()

    def _remember(self, decision: ControlDecision, situation: PlanningContext) -> None:
        """Queue the command; a vehicle that stands blocked begins afresh."""
        control = decision.control
        sent = QueuedCommand(situation.begin, control.acceleration, control.steering_rate)
        queue = queued(self._memory.queue, sent, situation.now)
        waiting = decision.status is Status.GOAL_LOST
        self._memory = renewed(self._memory, queue=queue, reached=situation.state, waiting=waiting)
        looking = self._memory.stop is not None or self._memory.looks_past
        if decision.status is Status.BLOCKED and not looking:
            if route.is_stationary(self._memory, situation) and route.replan_due(self._memory, situation):
                self._memory = renewed(route.restart(self._memory), looked_at=situation.now)
        elif not self._memory.latched:
            self._memory = renewed(self._memory, looked_at=None)
