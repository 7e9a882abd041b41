"""Finding a plan: one real-time iteration a cycle, more of them while a plan is not yet fit to be driven."""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot, radians

import numpy as np

from rti_mpcc.config import ControllerConfig
from rti_mpcc.controller import RtiMpcc, Solution
from rti_mpcc.model.bicycle import step
from rti_mpcc.model.layout import DELTA_DOT, PHI, A, X, Y
from rti_mpcc.ocp.horizon import stage_lengths, stage_times
from rti_mpcc.ocp.objectives import GOAL_CLIP, Target
from rti_mpcc.planning.clock import CycleClock
from rti_mpcc.planning.guess import arrival_guess, cruise_guess
from rti_mpcc.planning.memory import ControllerMemory, Situation
from rti_mpcc.planning.route import retreat
from rti_mpcc.types import Trajectory

ITERATIONS = 10
"""Real-time iterations in one cycle, at most."""
UNSOLVED = 2
"""So many QPs may remain unsolved in one cycle; the second one began without the first one's guess."""
PATIENCE = 5
"""From a first guess on a QP may take so many times the configured iterations."""
FIRST_ITERATIONS = 3
"""Real-time iterations from a first guess on, at least."""
START_DAMPING = 1e-2
"""Weight on the change (qp/filling.py) from a first guess on: it may be far from the optimum, and what is
far from a linearisation is not known to it."""
DAMPING = 1e-4
"""The same from cycle to cycle."""
CHECKED_SPAN = 2.0
"""Beginning of a plan over which it has to obey the dynamics [s]."""
POSITION_DEFECT = 0.05
"""Largest position error of a plan against the dynamics over that span [m]."""
HEADING_DEFECT = radians(2.0)
"""The same for the heading [rad]."""
INPUT_SLACK = 0.02
"""Share of an input limit by which a solver's answer may pass it before it is cut."""
NO_TIME = "the deadline left no time for an iteration"
SQUEEZED = 0.3
"""Corridor slack [m] of a plan that goes through something rather than past it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Attempt:
    """The iterations of one cycle.

    Attributes:
        solutions: in order; none if there was no time for any.
        problem: why the last one must not be driven, or "".
        squeezed: it goes through something that stands in the way, or ends before it.
        cut: the time was up before the iterations came to an end.
    """

    solutions: tuple[Solution, ...]
    problem: str
    squeezed: bool
    cut: bool = False


def converge(
    mpcc: RtiMpcc, memory: ControllerMemory, situation: Situation, guess: Trajectory | None, clock: CycleClock
) -> Attempt:
    """One iteration from the last solution, or several from a `guess`; more only while there is a problem."""
    least, damping = (1, DAMPING) if guess is None else (FIRST_ITERATIONS, START_DAMPING)
    solutions: list[Solution] = []
    unsolved, patience = 0, 1 if guess is None else PATIENCE
    last = None if guess is not None else memory.solution
    problem, squeezed = NO_TIME, False
    while len(solutions) < ITERATIONS:
        if not clock.grants():
            return Attempt(solutions=tuple(solutions), problem=problem, squeezed=squeezed, cut=True)
        mpcc.prepare(
            situation.begin,
            last=last,
            plan=guess,
            arrive_at=memory.arrive_at,
            retreat=retreat(memory, situation),
            damping=damping,
        )
        solutions.append(
            mpcc.feedback(
                situation.state,
                situation.begin,
                time_limit=clock.time_limit,
                stopped=clock.stop(),
                patience=patience,
            )
        )
        clock.took(solutions[-1].stopped)
        if solutions[-1].solved:
            last, guess = solutions[-1], None
        unsolved += not solutions[-1].solved
        problem = complaint(solutions[-1], mpcc.config)
        squeezed = least > 1 and _squeezed(solutions[-1], mpcc.target, arriving=memory.arrive_at is not None)
        if unsolved >= UNSOLVED or (len(solutions) >= least and not problem and not squeezed):
            break
    return Attempt(solutions=tuple(solutions), problem=problem, squeezed=squeezed)


def first_guess(mpcc: RtiMpcc, memory: ControllerMemory, situation: Situation) -> Trajectory:
    """Where the iterations begin for the objective that the memory has chosen."""
    config, arrive_at = mpcc.config, memory.arrive_at
    horizon = config.cruise_horizon if arrive_at is None else arrive_at - situation.begin
    times = stage_times(situation.begin, stage_lengths(horizon, config.cycle, config.stages))
    if arrive_at is None:
        return cruise_guess(mpcc.part, mpcc.target, situation.state, times, config)
    return arrival_guess(mpcc.part, mpcc.target, situation.state, times, situation.way, config)


def _squeezed(solution: Solution, target: Target, *, arriving: bool) -> bool:
    if float(solution.slack.max()) > SQUEEZED:
        return True
    end = solution.trajectory.states[-1]
    left = hypot(end[X] - target.pose.x, end[Y] - target.pose.y)
    return arriving and (left > GOAL_CLIP[0] or abs(end[PHI] - target.pose.phi) > GOAL_CLIP[1])


def complaint(solution: Solution, config: ControllerConfig) -> str:
    """Why a solution must not be driven, or ""."""
    if not solution.solved:
        return f"the QP was not solved: {solution.status}"
    plan, limits = solution.trajectory, config.limits
    if not (np.isfinite(plan.states).all() and np.isfinite(plan.controls).all()):
        return "the plan is not finite"
    a, rate = plan.controls[0, A], plan.controls[0, DELTA_DOT]
    most = 1.0 + INPUT_SLACK
    if abs(a) > most * limits.acceleration or abs(rate) > most * limits.steering_rate:
        return f"the plan begins outside the input limits: a = {a:.3g} m/s², delta_dot = {rate:.3g} rad/s"
    position, heading = defect(plan, config.vehicle.wheelbase)
    if position > POSITION_DEFECT or heading > HEADING_DEFECT:
        return f"the plan breaks the dynamics by {position:.2f} m and {np.degrees(heading):.1f} deg"
    return ""


def defect(plan: Trajectory, wheelbase: float) -> tuple[float, float]:
    """Errors [m], [rad] that a plan's first `CHECKED_SPAN` adds up to against the dynamics."""
    stages = int(np.searchsorted(plan.times - plan.times[0], CHECKED_SPAN))
    stages = min(max(stages, 1), len(plan.controls))
    lengths = np.diff(plan.times[: stages + 1])
    reached = step(plan.states[:stages], plan.controls[:stages], lengths, wheelbase)
    gap = reached - plan.states[1 : stages + 1]
    return float(np.hypot(gap[:, X], gap[:, Y]).sum()), float(np.abs(gap[:, PHI]).sum())
