"""What a cycle came to, and the account that it gives of itself."""

from __future__ import annotations

from dataclasses import dataclass

from estimation import Judgement
from rti_mpcc.config import ControllerConfig
from rti_mpcc.controller import Solution
from rti_mpcc.model.layout import DELTA, THETA, V
from rti_mpcc.planning.clock import CycleClock
from rti_mpcc.planning.memory import ControllerMemory, Situation
from rti_mpcc.safety.ladder import Drive
from rti_mpcc.types import Command, Diagnostics, EffectiveWeights, Objective, Status, Trajectory


@dataclass(frozen=True, slots=True, kw_only=True)
class Act:
    """The drive of a cycle, why, the plan it belongs to, and the QPs that were solved for it.

    `failed` says that a QP was solved for this cycle's drive and not accepted, `retried` that it was sought
    once more from a clean start.
    """

    drive: Drive
    status: Status
    reason: str
    trajectory: Trajectory
    solutions: tuple[Solution, ...] = ()
    failed: bool = False
    retried: bool = False


def command(
    act: Act,
    situation: Situation,
    memory: ControllerMemory,
    detections: tuple[Judgement, ...],
    config: ControllerConfig,
    clock: CycleClock,
) -> Command:
    """The command of a cycle that was told `detections`."""
    drive, cycle = act.drive, config.cycle
    return Command(
        acceleration=drive.acceleration,
        steering_rate=drive.steering_rate,
        speed=float(situation.state[V]) + cycle * drive.acceleration,
        steering=float(situation.state[DELTA]) + cycle * drive.steering_rate,
        status=act.status,
        source=drive.source,
        docked=act.status is Status.DOCKED,
        trajectory=act.trajectory,
        diagnostics=_diagnose(act, situation, memory, detections, clock),
    )


def _diagnose(
    act: Act,
    situation: Situation,
    memory: ControllerMemory,
    detections: tuple[Judgement, ...],
    clock: CycleClock,
) -> Diagnostics:
    solutions = act.solutions
    arrive_at = memory.arrive_at
    return Diagnostics(
        theta=float(situation.state[THETA]),
        part=memory.part,
        objective=Objective.CONTOURING if arrive_at is None else Objective.ARRIVAL,
        weights=_first_weights(solutions),
        time_to_go=None if arrive_at is None else arrive_at - situation.begin,
        failed=act.failed,
        solver_status=solutions[-1].status if solutions else "",
        iterations=sum(s.iterations for s in solutions),
        residuals=solutions[-1].residuals if solutions else (0.0, 0.0),
        retried=act.retried,
        slack=float(solutions[-1].slack.max()) if solutions else 0.0,
        reason=act.reason,
        aim=situation.target.pose,
        goal=memory.estimate,
        detections=detections,
        prepare_ms=1e3 * sum(s.prepare_seconds for s in solutions),
        feedback_ms=1e3 * sum(s.feedback_seconds for s in solutions),
        solve_ms=1e3 * sum(s.solve_seconds for s in solutions),
        step_ms=1e3 * clock.seconds,
        deadline_missed=clock.late(),
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
