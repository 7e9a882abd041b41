"""DockingController: from following a path to standing at the dock, one command a cycle.

It composes the layers below and decides nothing itself: `planning` decides what the cycle asks for,
`RtiMpcc` plans it, `safety` decides what is driven.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np
from numpy.typing import ArrayLike

from geometry import Corridor, CorridorError, Pose2, ReferencePath
from rti_mpcc.config import ControllerConfig
from rti_mpcc.controller import RtiMpcc, Solution, path_end
from rti_mpcc.model.delay import QueuedCommand, still_acting
from rti_mpcc.model.layout import DELTA, THETA, V
from rti_mpcc.ocp.horizon import resample, stage_lengths, stage_times
from rti_mpcc.planning import guess, route, sensing
from rti_mpcc.planning.memory import ControllerMemory, Phase, Situation
from rti_mpcc.safety import contact, ladder
from rti_mpcc.safety.stopping import stopping_motion
from rti_mpcc.types import (
    Command,
    Diagnostics,
    EffectiveWeights,
    Objective,
    Source,
    Status,
    Trajectory,
    VehicleState,
)

_log = logging.getLogger(__name__)

START_ITERATIONS = 10
"""Real-time iterations in one cycle, at most, while the first plan of a part is being found."""

START_DAMPING = 1e-2
"""Weight on the change (qp/filling.py) from a first guess on: it may be far from the optimum, and what is
far from a linearisation is not known to it."""
DAMPING = 1e-3
"""The same from cycle to cycle."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Act:
    """What a cycle came to: the drive, why, and the plan that it belongs to."""

    drive: ladder.Drive
    status: Status
    reason: str
    trajectory: Trajectory
    solutions: tuple[Solution, ...] = ()
    failed: bool = False


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
        self._corridor = corridor
        self._memory = ControllerMemory()
        self._check()
        self._mpcc = self._core(0)

    @property
    def memory(self) -> ControllerMemory:
        """What this controller remembers."""
        return self._memory

    def clear_goal(self) -> None:
        """Forget the goal: the path's last pose is the goal again."""
        self._memory = replace(self._memory, goal=None)

    def step(
        self,
        state: VehicleState,
        *,
        now: float,
        goal: Pose2 | None = None,
        obstacles: Sequence[ArrayLike] | None = None,
    ) -> Command:
        """One cycle: the command to apply from now until the next step.

        Args:
            state: measured at `now`.
            now: on any clock that runs on [s].
            goal: pose to end in; None keeps the last one. Without any it is the path's last pose.
            obstacles: polygons (m, 2) [m] to keep out of; None keeps the last ones.
        """
        begun = perf_counter()
        self._receive(goal, obstacles)
        situation = self._assess(state, now)
        if route.may_change_direction(self._memory, situation, self.config.dead_time):
            self._enter_next_part()
            situation = self._assess(state, now)
        self._memory = route.decide(self._memory, situation, self.config)
        act = self._act(situation)
        self._remember(act, situation)
        return self._command(act, situation, begun)

    # -- inputs -----------------------------------------------------------------------------------

    def _check(self) -> None:
        width, theta = self._corridor.narrowest()
        if width < self.config.vehicle.width:
            raise CorridorError(
                f"the corridor is {width:.3f} m wide at theta = {theta:.2f} m: "
                f"it must be wider than the body, {self.config.vehicle.width:.3f} m"
            )
        if self.path.max_curvature > self.config.max_curvature * (1.0 + 1e-6):
            _log.warning(
                "the path's curvature reaches %.3f 1/m, the vehicle can drive %.3f 1/m",
                self.path.max_curvature,
                self.config.max_curvature,
            )

    def _receive(self, goal: Pose2 | None, obstacles: Sequence[ArrayLike] | None) -> None:
        if goal is not None and goal != self._memory.goal:
            self._memory = replace(self._memory, goal=goal)
        if obstacles is not None:
            self._corridor = self._corridor.with_obstacles(obstacles)
            self._mpcc.set_obstacles(self._corridor)
        goal = self._memory.goal
        if self._memory.part < len(self.path.parts) - 1 or goal is None:
            self._mpcc.target = path_end(self._mpcc.part)
        elif goal != self._goal_taken:
            self._mpcc.set_goal(goal)
        self._goal_taken = goal

    def _assess(self, state: VehicleState, now: float) -> Situation:
        last = self._memory.part == len(self.path.parts) - 1
        mpcc = self._mpcc
        return sensing.assess(
            state, now, self._memory, mpcc.part, mpcc.target, self.config, last_part=last
        )

    def _core(self, index: int) -> RtiMpcc:
        self._goal_taken: Pose2 | None = None
        return RtiMpcc(self.path.parts[index], self._corridor, self.config, index=index)

    def _enter_next_part(self) -> None:
        self._memory = route.next_part(self._memory)
        self._mpcc = self._core(self._memory.part)
        self._receive(None, None)

    # -- acting -----------------------------------------------------------------------------------

    def _act(self, situation: Situation) -> Act:
        phase = self._memory.phase
        if phase is Phase.HOLDING:
            status = Status.DOCKED if situation.last_part else Status.CHANGING_DIRECTION
            return self._stop(situation, status, "standing inside the tolerance")
        if phase is Phase.STALLED:
            return self._stop(situation, Status.STALLED, "no plan from here ends inside the tolerance")
        if phase is Phase.SETTLING:
            return self._stop(situation, Status.SETTLING, "braking to rest inside the tolerance", land=True)
        if phase is Phase.STARTING:
            return self._start(situation)
        if route.arrival_due(self._memory, situation, self.config):
            contouring = self._memory
            solutions = self._begin(situation)
            if self._memory.phase is Phase.ARRIVING:
                return self._judge(solutions, situation)
            self._memory = contouring
        return self._judge(self._converge(situation, None), situation)

    def _start(self, situation: Situation) -> Act:
        """Begin from rest; stand still until there is a plan."""
        solutions = self._begin(situation)
        if self._memory.phase is Phase.STARTING:
            problem = ladder.complaint(solutions[-1], self.config)
            return self._stop(situation, Status.STARTING, problem, solutions=solutions)
        return self._judge(solutions, situation)

    def _begin(self, situation: Situation) -> tuple[Solution, ...]:
        """Iterate from a first guess; the phase changes once the plan obeys the dynamics."""
        self._memory = route.begin_phase(self._memory, situation, self.config)
        solutions = self._converge(situation, self._first_guess(situation))
        if not ladder.complaint(solutions[-1], self.config):
            phase = Phase.CONTOURING if self._memory.arrive_at is None else Phase.ARRIVING
            self._memory = replace(self._memory, phase=phase, driving_since=situation.now)
        return solutions

    def _converge(self, situation: Situation, guess: Trajectory | None) -> tuple[Solution, ...]:
        """One real-time iteration; more of them only until the plan obeys the dynamics."""
        least = 1 if guess is None else START_ITERATIONS // 3
        solutions: list[Solution] = []
        damping = DAMPING if guess is None else START_DAMPING
        for _ in range(START_ITERATIONS):
            solutions.append(self._iterate(situation, guess, damping))
            guess = None
            if len(solutions) >= least and not ladder.complaint(solutions[-1], self.config):
                break
        return tuple(solutions)

    def _first_guess(self, situation: Situation) -> Trajectory:
        config, arrive_at = self.config, self._memory.arrive_at
        part, target = self._mpcc.part, self._mpcc.target
        horizon = config.cruise_horizon if arrive_at is None else arrive_at - situation.begin
        times = stage_times(situation.begin, stage_lengths(horizon, config.cycle, config.stages))
        if arrive_at is None:
            return guess.cruise_guess(part, target, situation.state, times, config)
        return guess.arrival_guess(part, target, situation.state, times, situation.way, config)

    def _iterate(
        self, situation: Situation, plan: Trajectory | None, damping: float
    ) -> Solution:
        last = None if plan is not None else self._memory.solution
        self._mpcc.prepare(
            situation.begin,
            last=last,
            plan=plan,
            arrive_at=self._memory.arrive_at,
            retreat=route.retreat(self._memory, situation),
            damping=damping,
        )
        solution = self._mpcc.feedback(situation.state, situation.begin)
        if solution.solved:
            self._memory = replace(self._memory, solution=solution)
        return solution

    def _judge(self, solutions: tuple[Solution, ...], situation: Situation) -> Act:
        """Take the first rung of the ladder that holds."""
        config, now = self.config, situation.now
        problem = ladder.complaint(solutions[-1], config)
        accepted = self._memory.accepted_at
        if not problem:
            plan, source, reason = solutions[-1].trajectory, Source.SOLUTION, ""
            self._memory = replace(self._memory, accepted_at=now)
        elif (
            accepted is not None
            and now - accepted <= ladder.PLAN_LIFE
            and self._memory.solution is not None
        ):
            times = stage_times(situation.begin, np.diff(solutions[-1].trajectory.times))
            plan = resample(self._memory.solution.trajectory, times, config.vehicle.wheelbase)
            source, reason = Source.SHIFTED_PLAN, problem
        else:
            return self._stop(situation, Status.FAILED, problem, solutions=solutions, failed=True)
        blocked = self._blocked(plan, situation)
        self._memory = replace(self._memory, blocked=blocked is not None)
        if blocked is not None:
            reason = f"contact in {blocked:.2f} m"
            return self._stop(situation, Status.BLOCKED, reason, solutions=solutions, contact=blocked)
        following = self._memory.arrive_at is None
        return Act(
            drive=ladder.follow(plan.controls[0], source, config),
            status=Status.FOLLOWING if following else Status.ARRIVING,
            reason=reason,
            trajectory=plan,
            solutions=solutions,
            failed=bool(problem),
        )

    def _blocked(self, plan: Trajectory, situation: Situation) -> float | None:
        """Way to a contact that the vehicle must brake for [m], or None."""
        need = contact.stopping_distance(float(situation.state[V]), self.config)
        reach = need + contact.CHECKED
        way = contact.way_to_contact(plan, self._corridor, self._memory.part, self.config, reach)
        return way if way <= (reach if self._memory.blocked else need) else None

    def _stop(
        self,
        situation: Situation,
        status: Status,
        reason: str,
        *,
        land: bool = False,
        contact: float | None = None,
        solutions: tuple[Solution, ...] = (),
        failed: bool = False,
    ) -> Act:
        """Brake: at comfort, to land at the target's length, or to stand before a contact."""
        config, state = self.config, situation.state
        wanted, rate = config.comfort_acceleration, 0.0
        if land:
            wanted = ladder.landing(situation, config)
        if contact is not None:
            wanted = ladder.before_contact(float(state[V]), contact, config)
            rate = float(solutions[-1].trajectory.controls[0, 1])
        if failed:
            wanted = ladder.braking(config)
        standing = route.stands(self._memory, situation)
        lengths = stage_lengths(config.cruise_horizon, config.cycle, config.stages)
        motion = stopping_motion(state, stage_times(situation.begin, lengths), wanted, config.vehicle.wheelbase)
        return Act(
            drive=ladder.hold(state, config) if standing else ladder.brake(state, wanted, config, rate),
            status=status,
            reason=reason,
            trajectory=motion,
            solutions=solutions,
            failed=failed,
        )

    # -- outputs ----------------------------------------------------------------------------------

    def _remember(self, act: Act, situation: Situation) -> None:
        drive = act.drive
        sent = QueuedCommand(situation.begin, drive.acceleration, drive.steering_rate)
        queue = (*still_acting(self._memory.queue, situation.now), sent)
        self._memory = replace(self._memory, queue=queue)
        if act.status is Status.BLOCKED and route.stands(self._memory, situation):
            self._memory = route.restart(self._memory)

    def _command(self, act: Act, situation: Situation, begun: float) -> Command:
        config, drive = self.config, act.drive
        cycle = config.cycle
        seconds = perf_counter() - begun
        return Command(
            acceleration=drive.acceleration,
            steering_rate=drive.steering_rate,
            speed=float(situation.state[V]) + cycle * drive.acceleration,
            steering=float(situation.state[DELTA]) + cycle * drive.steering_rate,
            status=act.status,
            source=drive.source,
            docked=act.status is Status.DOCKED,
            trajectory=act.trajectory,
            diagnostics=_diagnose(act, situation, self._memory, config, seconds),
        )


def _diagnose(
    act: Act, situation: Situation, memory: ControllerMemory, config: ControllerConfig, seconds: float
) -> Diagnostics:
    solutions = act.solutions
    arriving = memory.arrive_at is not None
    return Diagnostics(
        theta=float(situation.state[THETA]),
        part=memory.part,
        objective=Objective.ARRIVAL if arriving else Objective.CONTOURING,
        weights=_first_weights(solutions),
        time_to_go=memory.arrive_at - situation.begin if memory.arrive_at is not None else None,
        failed=act.failed,
        solver_status=solutions[-1].status if solutions else "",
        iterations=sum(s.iterations for s in solutions),
        slack=float(solutions[-1].slack.max()) if solutions else 0.0,
        reason=act.reason,
        prepare_ms=1e3 * sum(s.prepare_seconds for s in solutions),
        feedback_ms=1e3 * sum(s.feedback_seconds for s in solutions),
        solve_ms=1e3 * sum(s.solve_seconds for s in solutions),
        step_ms=1e3 * seconds,
        deadline_missed=config.deadline is not None and seconds > config.deadline,
    )


def _first_weights(solutions: tuple[Solution, ...]) -> EffectiveWeights:
    if not solutions:
        return EffectiveWeights(lag=0.0, contouring=0.0, progress_reward=0.0, goal_position=0.0)
    weights = solutions[-1].weights
    return EffectiveWeights(
        lag=float(weights.lag[0]),
        contouring=float(weights.contouring[0]),
        progress_reward=float(weights.progress_reward[0]),
        goal_position=float(weights.goal[0]),
    )
