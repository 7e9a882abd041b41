"""What a cycle came to, and the account that it gives of itself."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from estimation import Judgement
from geometry import Pose2
from rti_mpcc.config import ControllerConfig
from rti_mpcc.iteration import Solution
from rti_mpcc.model.disturbance import UNDISTURBED, Disturbance
from rti_mpcc.model.layout import DELTA, PHI, THETA, A, V, X, Y
from rti_mpcc.ocp.horizon import read_only, stage_times
from rti_mpcc.planning.clock import CycleClock
from rti_mpcc.planning.memory import ControllerMemory, PlanningContext
from rti_mpcc.planning.search import SqpResult
from rti_mpcc.safety.fallback import ControlInput, braking
from rti_mpcc.safety.stopping import stopping_motion
from rti_mpcc.types import Array, Command, Diagnostics, EffectiveWeights, Objective, Status, Trajectory

_AS_PULLING_OUT = (
    Status.FOLLOWING,
    Status.ARRIVING,
    Status.SETTLING,
    Status.STARTING,
    Status.CHANGING_DIRECTION,
    Status.STALLED,
)
"""What is not said of a way back: it has one status of its own."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ControlDecision:
    """The control of a cycle, why, the plan it belongs to, and the search that was made for it, if any."""

    control: ControlInput
    status: Status
    reason: str
    trajectory: Trajectory
    attempt: SqpResult | None = None

    def pulling_out(self, time: int) -> ControlDecision:
        """The same on, or just before, the way back that is driven for the first or second `time`."""
        remark = f"pulling out, to come again ({time}. time)"
        status = Status.PULLING_OUT if self.status in _AS_PULLING_OUT else self.status
        return replace(self, status=status, reason="; ".join(filter(None, (self.reason, remark))))


def command(
    decision: ControlDecision,
    situation: PlanningContext,
    memory: ControllerMemory,
    detections: tuple[Judgement, ...],
    remarks: tuple[str, ...],
    config: ControllerConfig,
    clock: CycleClock,
) -> Command:
    """The command of a cycle that was told `detections`, and has `remarks` on what else it was told."""
    plan = decision.trajectory
    if memory.clock_offset:
        times = plan.times - memory.clock_offset
        read_only(times)
        plan = replace(plan, times=times)
    diagnostics = _diagnose(decision, situation, memory, detections, remarks, clock)
    believed = memory.monitor.state
    return _command(
        decision.control,
        situation.state,
        believed,
        decision.status,
        plan,
        diagnostics,
        config,
        memory.disturbance,
    )


def emergency(
    control: ControlInput,
    state: Array,
    memory: ControllerMemory,
    reason: str,
    config: ControllerConfig,
    clock: CycleClock,
) -> Command:
    """The command of a cycle that went wrong: of the vehicle only the believed `state` (6,) is known."""
    pose = Pose2(float(state[X]), float(state[Y]), float(state[PHI]))
    begin = memory.now - memory.clock_offset + config.dead_time
    times = stage_times(begin, np.full(config.stages, config.cycle))
    motion = stopping_motion(state, times, braking(config), config.vehicle.wheelbase)
    diagnostics = Diagnostics(
        theta=float(state[THETA]),
        part=memory.part,
        objective=Objective.CONTOURING,
        weights=_first_weights(()),
        time_to_go=None,
        failed=True,
        solver_status="",
        iterations=0,
        residuals=(0.0, 0.0),
        retried=False,
        slack=0.0,
        reason=reason,
        aim=memory.goal or pose,
        goal=memory.estimate,
        detections=(),
        prepare_ms=0.0,
        feedback_ms=0.0,
        solve_ms=0.0,
        step_ms=1e3 * clock.seconds,
        deadline_missed=clock.late(),
        disturbance=memory.disturbance.acceleration,
        steering_offset=memory.disturbance.steering,
    )
    believed = memory.monitor.state
    return _command(control, state, believed, Status.FAILED, motion, diagnostics, config, memory.disturbance)


def _command(
    control: ControlInput,
    state: Array,
    believed: Array | None,
    status: Status,
    plan: Trajectory,
    diagnostics: Diagnostics,
    config: ControllerConfig,
    disturbance: Disturbance,
) -> Command:
    """`control`, as it is sent, from the state (6,) that it begins to act in; now `believed` (6,)."""
    d, o, gain = disturbance
    now = state if believed is None else believed
    speed = float(state[V]) + config.cycle * (gain * control.acceleration + d)
    steering = float(state[DELTA]) - o + config.cycle * control.steering_rate
    return Command(
        acceleration=control.acceleration,
        steering_rate=control.steering_rate,
        speed=_within(speed, config.limits.speed, float(now[V])),
        steering=_within(steering, config.limits.steering, float(now[DELTA])),
        status=status,
        source=control.source,
        docked=status is Status.DOCKED,
        trajectory=_as_sent(plan, disturbance),
        diagnostics=diagnostics,
    )


def _within(value: float, limit: float, now: float) -> float:
    """A planned value within its limit, or no farther beyond it than the vehicle is now."""
    return min(max(value, min(-limit, now)), max(limit, now))


def _as_sent(plan: Trajectory, disturbance: Disturbance) -> Trajectory:
    """The plan with the accelerations to be commanded for it, and the steering as it is measured, (O4)."""
    if disturbance == UNDISTURBED:
        return plan
    states, controls = disturbance.measured(plan.states), plan.controls.copy()
    controls[:, A] = (controls[:, A] - disturbance.acceleration) / disturbance.gain
    read_only(states, controls)
    return replace(plan, states=states, controls=controls)


def _diagnose(
    decision: ControlDecision,
    situation: PlanningContext,
    memory: ControllerMemory,
    detections: tuple[Judgement, ...],
    remarks: tuple[str, ...],
    clock: CycleClock,
) -> Diagnostics:
    solutions = decision.attempt.solutions if decision.attempt else ()
    arrive_at = memory.arrive_at
    return Diagnostics(
        theta=float(situation.state[THETA]),
        part=memory.part,
        objective=memory.objective,
        weights=_first_weights(solutions),
        time_to_go=None if arrive_at is None else arrive_at - situation.begin,
        failed=decision.attempt is not None and bool(decision.attempt.problem),
        solver_status=solutions[-1].status if solutions else "",
        iterations=sum(s.iterations for s in solutions),
        residuals=solutions[-1].residuals if solutions else (0.0, 0.0),
        retried=decision.attempt is not None and decision.attempt.retried,
        slack=float(solutions[-1].slack.max()) if solutions else 0.0,
        reason="; ".join(part for part in (decision.reason, *remarks) if part),
        aim=situation.target.pose,
        goal=memory.estimate,
        detections=detections,
        prepare_ms=1e3 * sum(s.prepare_seconds for s in solutions),
        feedback_ms=1e3 * sum(s.feedback_seconds for s in solutions),
        solve_ms=1e3 * sum(s.solve_seconds for s in solutions),
        step_ms=1e3 * clock.seconds,
        deadline_missed=clock.late(),
        disturbance=memory.disturbance.acceleration,
        steering_offset=memory.disturbance.steering,
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
