"""The result of a cycle as a command, with its diagnostics; why a vehicle stops, the first cause known."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf
from typing import NamedTuple

import numpy as np

from estimation import Judgement
from geometry import Pose2
from geometry.compiled import Array1, Out2, kernel
from rti_mpcc.clock import CycleClock
from rti_mpcc.config import ControllerConfig
from rti_mpcc.config.mpc import CONTACT_TOLERANCE
from rti_mpcc.course import collision_check
from rti_mpcc.course.collision_check import nearest_object
from rti_mpcc.course.context import PlanningContext
from rti_mpcc.drive import holding
from rti_mpcc.drive.fallback import ControlInput, stopping_motion
from rti_mpcc.drive.search import SqpResult
from rti_mpcc.iteration import Solution
from rti_mpcc.manoeuvre import SegmentEnd
from rti_mpcc.model.actuators import UNDISTURBED, Disturbance, going_out, measured_steering
from rti_mpcc.model.footprint import clearances
from rti_mpcc.model.layout import DELTA, DELTA_DOT, PHI, THETA, A, X, Y
from rti_mpcc.ocp.horizon import read_only, stage_times
from rti_mpcc.state import ControllerState, PlannedStop, Task
from rti_mpcc.types import (
    Array,
    Command,
    Diagnostics,
    EffectiveWeights,
    GoalOrigin,
    Objective,
    Reason,
    Source,
    Status,
    Trajectory,
    Verdict,
)


@dataclass(frozen=True, slots=True)
class ControlDecision:
    """The control of a cycle, why, its plan, and the search that was made for it, if any."""

    control: ControlInput
    verdict: Verdict
    trajectory: Trajectory
    attempt: SqpResult | None = None


class InputReport(NamedTuple):
    """Judgements of the detections of the goal, and remarks on all inputs of a cycle."""

    detections: tuple[Judgement, ...] = ()
    remarks: tuple[str, ...] = ()


def status_of(verdict: Verdict, task: Task) -> Status:
    """The status of a cycle with this verdict, after which the task is `task`."""
    if verdict.reason is Reason.SEARCHES_PLAN and task.stop_reason:
        return Status.FAILED
    follows = task.objective.kind is Objective.CONTOURING
    return verdict.reason.status or (Status.FOLLOWING if follows else Status.ARRIVING)


def diagnose(
    decision: ControlDecision,
    state: Array,
    target: Pose2,
    s: ControllerState,
    clock: CycleClock,
    report: InputReport,
) -> Diagnostics:
    """The diagnostics of a cycle whose control acts from `state` (6,) on."""
    attempt, arrives_at = decision.attempt, s.arrives_at
    solutions = attempt.solutions if attempt else ()
    iterations, prepare, feedback, solve, interior_point = 0, 0.0, 0.0, 0.0, False
    for each in solutions:
        iterations += each.iterations
        prepare, feedback = prepare + each.prepare_seconds, feedback + each.feedback_seconds
        solve, interior_point = solve + each.solve_seconds, interior_point or each.interior_point
    return Diagnostics(
        theta=float(state[THETA]),
        part=s.task.segment.index,
        objective=s.task.objective.kind,
        weights=_first_weights(solutions),
        failed=attempt is not None and bool(attempt.problem),
        solver_status=solutions[-1].status if solutions else "",
        iterations=iterations,
        residuals=solutions[-1].residuals if solutions else (0.0, 0.0),
        slack=solutions[-1].most_slack if solutions else 0.0,
        target=target,
        goal=s.goal.estimate,
        time_to_go=None if arrives_at is None else arrives_at - (s.clock.now + s.vehicle.dead_time),
        reason="; ".join(filter(None, (str(decision.verdict), *report.remarks))),
        detections=report.detections,
        prepare_ms=1e3 * prepare,
        feedback_ms=1e3 * feedback,
        solve_ms=1e3 * solve,
        step_ms=1e3 * clock.seconds,
        deadline_missed=clock.late(),
        disturbance=s.vehicle.disturbance.acceleration,
        steering_offset=s.vehicle.disturbance.steering,
        cause=decision.verdict.reason,
        interior_point=interior_point,
    )


def command(
    decision: ControlDecision, s: ControllerState, config: ControllerConfig, diagnostics: Diagnostics
) -> Command:
    """The command of a cycle."""
    control, plan, status = decision.control, decision.trajectory, status_of(decision.verdict, s.task)
    if s.clock.offset:
        times = plan.times - s.clock.offset
        read_only(times)
        plan = replace(plan, times=times)
    drive, wheels = going_out(s.sent, s.vehicle.actuators, config.cycle)
    return Command(
        acceleration=drive.acceleration,
        steering_rate=wheels.steering_rate,
        speed=drive.speed,
        steering=wheels.steering,
        status=status,
        source=control.source,
        docked=status is Status.DOCKED,
        trajectory=_as_sent(plan, s.vehicle.disturbance),
        diagnostics=diagnostics,
        goal=s.goal_setpoint,
        hold=control.source is Source.STANDSTILL and holding.stays_put(s),
    )


def emergency(
    control: ControlInput,
    state: Array,
    s: ControllerState,
    verdict: Verdict,
    config: ControllerConfig,
    clock: CycleClock,
) -> Command:
    """The command of a cycle with an internal error: only the estimated `state` (6,) is known."""
    pose = Pose2(float(state[X]), float(state[Y]), float(state[PHI]))
    times = stage_times(s.clock.now + s.vehicle.dead_time, np.full(config.stages, config.cycle))
    motion = stopping_motion(state, times, config.firm_deceleration, config.vehicle.wheelbase)
    decision = ControlDecision(control, verdict, motion, SqpResult(solutions=(), problem=str(verdict)))
    diagnostics = diagnose(decision, state, s.goal.pose or pose, s, clock, InputReport())
    return command(decision, s, config, diagnostics)


def _as_sent(plan: Trajectory, disturbance: Disturbance) -> Trajectory:
    """The plan with the accelerations to be commanded for it, and the steering as it is measured, (O4)."""
    if disturbance == UNDISTURBED:
        return plan
    states, controls = plan.states.copy(), plan.controls.copy()
    _turn_back(disturbance, plan.times, states, controls)
    read_only(states, controls)
    return Trajectory(times=plan.times, states=states, controls=controls)


@kernel
def _turn_back(disturbance: Disturbance, times: Array1, states: Out2, controls: Out2) -> None:
    """Equation (O4), from what acts to what is measured and commanded."""
    for k in range(len(controls)):
        controls[k, A] = (controls[k, A] - disturbance.acceleration) / disturbance.gain
        # As `Disturbance.commanded_rate`: the angles of the plan differ by its defects, too.
        length, acting = times[k + 1] - times[k], states[k, DELTA]
        end = measured_steering(disturbance, acting + length * controls[k, DELTA_DOT])
        states[k, DELTA] = measured_steering(disturbance, acting)
        controls[k, DELTA_DOT] = (end - states[k, DELTA]) / length
    states[-1, DELTA] = measured_steering(disturbance, states[-1, DELTA])


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


def why_stalled(s: ControllerState, context: PlanningContext) -> str:
    """Why no plan ends inside the tolerance, or ""."""
    config = context.config
    here = Pose2(*context.state[[X, Y, PHI]].tolist())
    setpoint = s.goal_setpoint
    at_end = setpoint is None or setpoint.source is GoalOrigin.PATH_END
    what = "the path's end" if at_end else "the goal"
    if s.task.end is not SegmentEnd.GOAL:
        what = "the end of this segment"
    near = _too_near(here, "here", s, config) or _too_near(context.target.pose, f"at {what}", s, config)
    if why := near or _narrow(s, context):
        return why
    manoeuvre = None if s.route is None else s.route.manoeuvre
    return "" if manoeuvre is None or manoeuvre.found else manoeuvre.reason


def _too_near(pose: Pose2, where: str, s: ControllerState, config: ControllerConfig) -> str:
    """What is too near to the body at a pose, or ""."""
    state, part = np.array([pose.x, pose.y, pose.phi]), s.task.segment.index
    apart = clearances(state[None], s.area.known, part, config.vehicle, config.clearance.least)[0]
    apart[0] += CONTACT_TOLERANCE  # of boundaries, which count later
    if apart.min() >= config.clearance.least:
        return ""
    apart[0] -= CONTACT_TOLERANCE
    side_clearance, obstacle = float(apart.min()), nearest_object(state, s.area, part, config)
    if side_clearance < 0.0:
        return f"the body {where} overlaps {obstacle} by {-side_clearance:.3f} m"
    return (
        f"the body {where} is {side_clearance:.3f} m from {obstacle} (at least {config.clearance.least:g} m)"
    )


def _narrow(s: ControllerState, context: PlanningContext) -> str:
    """Where the rest of the segment is narrower than the margin, or ""."""
    side_clearance, theta = context.mpcc.side_clearance, float(context.state[THETA])
    if side_clearance is None:
        return ""
    ahead = (side_clearance.theta >= theta) & (side_clearance.theta <= context.target.theta)
    if not ahead.any():
        return ""
    least = int(np.flatnonzero(ahead)[np.argmin(side_clearance.walls[ahead])])
    left, at = float(side_clearance.walls[least]), float(side_clearance.theta[least])
    if left >= context.config.clearance.wanted:
        return ""
    pose = s.task.segment.part.pose(at)
    return (
        f"the boundaries leave {left:.3f} m on either side of the body at ({pose.x:.2f}, {pose.y:.2f}), "
        f"{at - theta:.2f} m ahead, less than the margin of {context.config.clearance.wanted:g} m"
    )


# -- what is in the way -----------------------------------------------------------------------------------


def what_blocks(stop: PlannedStop, context: PlanningContext) -> str:
    """What blocks the route behind a stop, and how far ahead that is."""
    ahead = stop.at + collision_check.stop_clearance(context.config) - float(context.state[THETA])
    return f"{stop.obstacle}, {max(ahead, 0.0):.2f} m ahead"


def meeting(
    s: ControllerState, plan: Trajectory, distance: float, config: ControllerConfig
) -> ControllerState:
    """With the contact of a plan after `distance` [m]."""
    assert s.task.yielding is not None
    obstacle = f"{distance:.2f} m with {collision_check.object_ahead(s, plan, distance, config)}"
    return replace(s, task=replace(s.task, yielding=replace(s.task.yielding, obstacle=obstacle)))


def why_yielding(s: ControllerState, distance: float) -> Verdict:
    """Why a vehicle halts whose plan is clear over `distance` [m]."""
    yielding = s.task.yielding
    assert yielding is not None
    if distance < inf:
        return Verdict(Reason.CONTACT_AHEAD, yielding.obstacle)
    return Verdict(Reason.WAITS_UNTIL_CLEAR, yielding.obstacle and f" (last: contact in {yielding.obstacle})")
