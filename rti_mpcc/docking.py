"""DockingController: from following a path to standing at the dock, one command a cycle.

It composes the layers below and decides nothing itself: `planning` decides what the cycle asks for and
finds a plan, `safety` decides what is driven.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import inf, isfinite

import numpy as np
from numpy.typing import ArrayLike

from estimation import GoalMeasurement, GoalPoseFilter, Judgement
from geometry import Corridor, Pose2, ReferencePath
from rti_mpcc.config import ControllerConfig
from rti_mpcc.controller import QpProblem, RtiMpcc
from rti_mpcc.model.delay import QueuedCommand, still_acting
from rti_mpcc.model.layout import DELTA_DOT, V
from rti_mpcc.ocp.horizon import resample, stage_lengths, stage_times
from rti_mpcc.planning import aim, route, search, sensing
from rti_mpcc.planning.clock import CycleClock
from rti_mpcc.planning.memory import ControllerMemory, Phase, Situation
from rti_mpcc.planning.search import Attempt
from rti_mpcc.planning.surroundings import Surroundings
from rti_mpcc.safety import contact, ladder
from rti_mpcc.safety.act import Act, command
from rti_mpcc.safety.stopping import stopping_motion
from rti_mpcc.types import Array, Command, Source, Status, Trajectory, VehicleState


class DockingController:
    """Drives a vehicle along a route and into its goal pose.

    Args:
        path: the route; corridor: its boundaries and obstacles; config: settings, all with defaults.

    Raises:
        CorridorError: the corridor is narrower than the body.
    """

    def __init__(
        self, path: ReferencePath, corridor: Corridor, config: ControllerConfig | None = None
    ) -> None:
        self.path = path
        self.config = config or ControllerConfig()
        self._surroundings = Surroundings.of(corridor, path, self.config)
        self._memory = ControllerMemory()
        tracking = self.config.goal_tracking
        self._filter = GoalPoseFilter(tracking.filter) if tracking.required else None
        self._mpcc = self._core()

    @property
    def memory(self) -> ControllerMemory:
        """What this controller remembers from cycle to cycle."""
        return self._memory

    def clear_goal(self) -> None:
        """Forget the goal and its detections: the path's last pose is the goal again."""
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

        Args:
            state: measured at `now`.
            now: on any clock that runs on [s].
            goal: pose to end in; None keeps the last one. Without any it is the path's last pose. With
                detections it is the planned goal, made for until they say better; another one than the last
                is another dock, whose detections begin anew.
            measurements: detections of the goal that arrived since the last step, in any order.
            obstacles: polygons (m, 2) [m] to keep out of; None keeps the last ones.
            clock: decides what depends on time in this cycle; None: the wall clock and `config.deadline`. For
                recordings and tests.
        """
        clock = clock or CycleClock(self.config.deadline)
        changes = self._surroundings.changes
        self._receive(goal, obstacles)
        detections = self._locate_goal(measurements, state, now)
        self._aim(now)
        if _is_finite(state):
            situation = self._situation(state, now)
            self._memory = route.decide(self._memory, situation, self.config)
            act = self._act(situation, clock, new_obstacles=self._surroundings.changes > changes)
        else:
            reached = sensing.reckoned_state(now, self._memory, self._mpcc.part, self.config)
            situation = self._assess(reached, now, float(reached[V]))
            wanted = ladder.braking(self.config)
            act = self._stop(situation, Status.FAILED, f"not a finite state: {state}", wanted)
        self._remember(act, situation)
        return command(act, situation, self._memory, detections, self.config, clock)

    def problem(self) -> QpProblem:
        """The QP of the last cycle that solved one, for study off line."""
        return self._mpcc.problem()

    # -- what comes in ------------------------------------------------------------------------------

    def _receive(self, goal: Pose2 | None, obstacles: Sequence[ArrayLike] | None) -> None:
        """Take what is new of goal and obstacles."""
        before, self._surroundings = self._surroundings, self._surroundings.told(obstacles)
        if self._surroundings is not before:
            self._mpcc.set_obstacles(self._surroundings.corridor)
        if goal is not None and goal != self._memory.planned:
            self._plan_for(goal)

    def _plan_for(self, goal: Pose2 | None) -> None:
        self._memory = route.with_goal(self._memory, goal)
        if self._filter is not None:
            self._filter.reset()

    def _locate_goal(
        self, measurements: Sequence[GoalMeasurement], state: VehicleState, now: float
    ) -> tuple[Judgement, ...]:
        """Filter what was detected, and let the pose made for follow; says what became of the detections."""
        settings = self.config.goal_tracking.filter
        if _is_finite(state):
            self._memory = aim.noted(self._memory, state, now, settings.history)
        if measurements and self._filter is None:
            self._filter = GoalPoseFilter(settings)
        if self._filter is None:
            return ()
        self._filter.predict(now)
        judgements = tuple(self._filter.update(aim.placed(m, self._memory, settings)) for m in measurements)
        estimate = self._filter.estimate(now)
        self._memory = aim.aimed(self._memory, estimate, self.path.end, now, self.config)
        return judgements

    def _aim(self, now: float) -> None:
        """Give the core what the active part is to end in: a stop, its own end, or the goal."""
        if route.may_be_free(self._memory, now, self._surroundings.changes):
            self._memory = route.released(self._memory)
        if self._memory.stop_at is not None:
            self._mpcc.set_stop(self._memory.stop_at)
        else:
            self._mpcc.set_goal(self._memory.goal if self._on_last_part else None)

    @property
    def _on_last_part(self) -> bool:
        return self._memory.part == len(self.path.parts) - 1

    def _assess(self, reached: Array, now: float, speed: float) -> Situation:
        return sensing.assess(
            reached,
            now,
            speed,
            self._mpcc.part,
            self._mpcc.target,
            self.config,
            last_part=self._on_last_part,
            free=self._memory.stop_at is None,
        )

    def _core(self) -> RtiMpcc:
        index = self._memory.part
        return RtiMpcc(self.path.parts[index], self._surroundings.corridor, self.config, index=index)

    def _situation(self, state: VehicleState, now: float) -> Situation:
        """Where the command will begin to act, on the part that the vehicle is on by then."""
        reached = sensing.reached_state(state, now, self._memory, self._mpcc.part, self.config)
        situation = self._assess(reached, now, state.v)
        if not route.may_change_direction(self._memory, situation, self.config.dead_time):
            return situation
        self._memory = route.next_part(self._memory)
        self._mpcc = self._core()
        self._aim(now)
        reached = sensing.reached_state(state, now, self._memory, self._mpcc.part, self.config)
        return self._assess(reached, now, state.v)

    # -- what is driven -----------------------------------------------------------------------------

    def _act(self, situation: Situation, clock: CycleClock, *, new_obstacles: bool) -> Act:
        phase = self._memory.phase
        if phase is Phase.HOLDING:
            return self._hold(situation)
        waiting = aim.must_wait(self._memory, situation, self.config)
        if waiting and route.stands(self._memory, situation):
            self._memory = route.restart(self._memory)
            return self._stop(situation, Status.GOAL_LOST, waiting)
        if phase is Phase.STALLED:
            return self._stop(situation, Status.STALLED, "no plan from here ends inside the tolerance")
        if phase is Phase.SETTLING:
            wanted = ladder.landing(situation, self.config)
            return self._stop(situation, Status.SETTLING, "braking to rest at the target", wanted)
        if phase is Phase.STARTING:
            if not route.looks_again(self._memory, situation):
                return self._stop(situation, Status.BLOCKED, "standing before a contact, looks again soon")
            attempt, situation = self._begin(situation, clock)
            if self._memory.phase is Phase.HOLDING:
                return self._hold(situation)
            if self._memory.phase is Phase.STARTING:
                return self._stop(situation, Status.STARTING, attempt.problem, attempt=attempt)
            return self._judge(attempt, situation)
        if route.arrival_due(self._memory, situation, self.config) or (new_obstacles and self._plan_is_cut()):
            driving = self._memory
            attempt, other = self._begin(situation, clock)
            if not attempt.problem and self._memory.phase is not Phase.HOLDING:
                return self._judge(attempt, other)
            self._memory = driving
            self._aim(situation.now)
            if route.too_late(driving, situation, self.config):
                wanted = ladder.braking(self.config)
                return self._stop(situation, Status.FAILED, attempt.problem, wanted, attempt)
        attempt = search.converge(self._mpcc, self._memory, situation, None, clock)
        self._keep(attempt)
        return self._judge(attempt, situation)

    def _plan_is_cut(self) -> bool:
        """Whether something lies in the way of the plan being driven, however far along."""
        plan = self._memory.driven
        if plan is None:
            return False
        return (
            contact.way_to_contact(plan, self._surroundings.corridor, self._memory.part, self.config, inf)
            < inf
        )

    def _hold(self, situation: Situation) -> Act:
        if not situation.free:
            return self._stop(situation, Status.BLOCKED, "standing before something that fills the way")
        if not situation.last_part:
            return self._stop(situation, Status.CHANGING_DIRECTION, "standing at the cusp")
        if aim.never_seen(self._memory, self.config):
            return self._stop(situation, Status.SEARCHING, "standing at the planned goal, not detected yet")
        return self._stop(situation, Status.DOCKED, "standing inside the tolerance")

    def _begin(self, situation: Situation, clock: CycleClock) -> tuple[Attempt, Situation]:
        """Search from a first guess; where something fills the way, for a stop before it."""
        self._memory = route.begin_phase(self._memory, situation, self.config)
        guess = search.first_guess(self._mpcc, self._memory, situation)
        attempt = search.converge(self._mpcc, self._memory, situation, guess, clock)
        self._keep(attempt)
        if (attempt.problem or attempt.squeezed) and situation.free and self._surroundings.corridor.obstacles:
            way = contact.way_to_contact(
                guess, self._surroundings.corridor, self._memory.part, self.config, inf
            )
            if way < inf:
                return self._begin_stop(attempt, situation, way, clock)
        if not attempt.problem:
            self._memory = route.begun(self._memory, situation)
        return attempt, situation

    def _begin_stop(
        self, attempt: Attempt, situation: Situation, way: float, clock: CycleClock
    ) -> tuple[Attempt, Situation]:
        left = way - contact.stop_clearance(self.config)
        self._memory = route.stop_before(self._memory, situation, left, self._surroundings.changes)
        self._aim(situation.now)
        situation = self._assess(situation.state, situation.now, situation.measured_speed)
        if self._memory.phase is Phase.HOLDING:
            return attempt, situation
        return self._begin(situation, clock)

    def _keep(self, attempt: Attempt) -> None:
        """Go on from the last iterate that was solved."""
        solved = [solution for solution in attempt.solutions if solution.solved]
        if solved:
            self._memory = replace(self._memory, solution=solved[-1])

    def _judge(self, attempt: Attempt, situation: Situation) -> Act:
        """Take the first rung of the ladder that holds."""
        config, memory, now, problem = self.config, self._memory, situation.now, attempt.problem
        if not problem:
            plan, source = attempt.solutions[-1].trajectory, Source.SOLUTION
            self._memory = replace(memory, driven=plan, accepted_at=now)
        elif memory.driven is not None and now - (memory.accepted_at or 0.0) <= ladder.PLAN_LIFE:
            times = stage_times(situation.begin, np.diff(memory.driven.times))
            plan, source = resample(memory.driven, times, config.vehicle.wheelbase), Source.SHIFTED_PLAN
        else:
            return self._stop(situation, Status.FAILED, problem, ladder.braking(config), attempt)
        way = self._way_to_stop_in(plan, situation)
        self._memory = replace(self._memory, blocked=way is not None)
        if way is not None:
            wanted = ladder.before_contact(float(situation.state[V]), way, config)
            rate = float(plan.controls[0, DELTA_DOT])
            return self._stop(situation, Status.BLOCKED, f"contact in {way:.2f} m", wanted, attempt, rate)
        waiting = aim.must_wait(memory, situation, config)
        if waiting:
            rate = float(plan.controls[0, DELTA_DOT])
            return self._stop(situation, Status.GOAL_LOST, waiting, attempt=attempt, steering_rate=rate)
        return Act(
            drive=ladder.follow(plan.controls[0], situation.state, source, config),
            status=Status.FOLLOWING if memory.arrive_at is None else Status.ARRIVING,
            reason=problem
            or ("" if situation.free else "making for a stop before something in the way")
            or aim.remark(memory),
            trajectory=plan,
            solutions=attempt.solutions,
            failed=bool(problem),
        )

    def _way_to_stop_in(self, plan: Trajectory, situation: Situation) -> float | None:
        """Way to a contact that the vehicle must brake for now [m], or None."""
        need = contact.stopping_distance(float(situation.state[V]), self.config)
        reach = need + contact.CHECKED
        way = contact.way_to_contact(plan, self._surroundings.corridor, self._memory.part, self.config, reach)
        return way if way <= (reach if self._memory.blocked else need) else None

    def _stop(
        self,
        situation: Situation,
        status: Status,
        reason: str,
        deceleration: float | None = None,
        attempt: Attempt | None = None,
        steering_rate: float = 0.0,
    ) -> Act:
        """Brake at `deceleration` [m/s²], by default the comfort acceleration, and stand."""
        config, state = self.config, situation.state
        wanted = config.comfort_acceleration if deceleration is None else deceleration
        times = stage_times(
            situation.begin, stage_lengths(config.cruise_horizon, config.cycle, config.stages)
        )
        stands = route.stands(self._memory, situation)
        drive = ladder.hold(state, config) if stands else ladder.brake(state, wanted, config, steering_rate)
        return Act(
            drive=drive,
            status=status,
            reason=reason,
            trajectory=stopping_motion(state, times, wanted, config.vehicle.wheelbase),
            solutions=attempt.solutions if attempt else (),
            failed=status is Status.FAILED,
        )

    def _remember(self, act: Act, situation: Situation) -> None:
        """Queue the command; a vehicle that stands blocked begins afresh."""
        drive = act.drive
        sent = QueuedCommand(situation.begin, drive.acceleration, drive.steering_rate)
        queue = (*still_acting(self._memory.queue, situation.now), sent)
        waiting = act.status is Status.GOAL_LOST
        self._memory = replace(self._memory, queue=queue, reached=situation.state, waiting=waiting)
        blocked = act.status is Status.BLOCKED and self._memory.stop_at is None
        if not blocked:
            self._memory = replace(self._memory, looked_at=None)
        elif route.stands(self._memory, situation) and route.looks_again(self._memory, situation):
            self._memory = replace(route.restart(self._memory), looked_at=situation.now)


def _is_finite(state: VehicleState) -> bool:
    return all(map(isfinite, (state.x, state.y, state.phi, state.v, state.delta)))
