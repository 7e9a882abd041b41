"""What is asked of the real-time iteration at a frozen problem, and the figures that show it."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from rti_mpcc.model.layout import DELTA_DOT, THETA_DOT, A, V
from tests.rti_mpcc.frozen import FrozenProblem, Iterates, iterate
from tests.rti_mpcc.nonlinear_program import NonlinearProgram, Optimum, roll_out

CLOSE = 1e-3
"""How far IPOPT may go from the fixed point:
a [m/s²], delta_dot [rad/s], theta_dot [m/s]; cost over 1 + |J|."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Findings:
    """How repeated steps ended, and what IPOPT made of it.

    Attributes:
        iterations: steps until they came to rest, None if they did not.
        contraction: mean ratio of one step to the one before.
        cost: J at the fixed point; slack: largest there [m].
        stays: IPOPT, started at the fixed point, succeeded; span_change: of the plan's length [s].
        cost_change: its cost minus J, over 1 + |J|.
        acceleration_change, steering_rate_change, progress_change: largest over the stages; progress only
            where a Frenet cost acts.
        second_succeeds, second_cost_change: the same from a second guess, see `_from_elsewhere`.
    """

    name: str
    iterations: int | None
    contraction: float
    cost: float
    slack: float
    stays: bool
    span_change: float
    cost_change: float
    acceleration_change: float
    steering_rate_change: float
    progress_change: float
    second_succeeds: bool
    second_cost_change: float

    def figures(self) -> dict[str, Any]:
        return asdict(self)

    def check(self) -> None:
        """Raises AssertionError with all findings where the issue's demands are not met."""
        assert self.iterations is not None, self
        assert self.stays, self
        assert abs(self.cost_change) <= CLOSE, self
        assert abs(self.span_change) <= CLOSE, self
        assert self.acceleration_change <= CLOSE, self
        assert self.steering_rate_change <= CLOSE, self
        assert self.progress_change <= CLOSE, self
        assert self.second_succeeds, self
        assert self.second_cost_change >= -CLOSE, self


def examine(problem: FrozenProblem) -> Findings:
    """Iterate to the fixed point, then let IPOPT start there and from a second guess."""
    fixed = iterate(problem)
    program = NonlinearProgram(problem)
    reached = fixed.states, fixed.controls, fixed.slack, float(fixed.lengths.sum())
    cost = program.cost(*reached)
    stayed = program.solve(*reached, nearby=True)
    second = _from_elsewhere(problem, program, fixed)
    change = _change(problem, fixed, stayed)
    return Findings(
        name=problem.name,
        iterations=fixed.converged_after,
        contraction=fixed.contraction,
        cost=cost,
        slack=float(fixed.slack.max()),
        stays=stayed.success,
        span_change=stayed.span - float(fixed.lengths.sum()),
        cost_change=(stayed.cost - cost) / (1.0 + abs(cost)),
        acceleration_change=change[A],
        steering_rate_change=change[DELTA_DOT],
        progress_change=change[THETA_DOT],
        second_succeeds=second.success,
        second_cost_change=(second.cost - cost) / (1.0 + abs(cost)),
    )


def _from_elsewhere(problem: FrozenProblem, program: NonlinearProgram, fixed: Iterates) -> Optimum:
    """IPOPT's answer from straight on at constant speed; where it finds none, from slowing down to rest."""
    straight = np.zeros_like(fixed.controls)
    slowing = straight.copy()
    slowing[:, A] = -problem.measured[V] / problem.lengths.sum()
    for controls in (straight, slowing):
        guess = roll_out(problem, controls)
        second = program.solve(guess, controls, np.zeros_like(fixed.slack), nearby=False)
        if second.success:
            break
    return second


def _change(problem: FrozenProblem, fixed: Iterates, optimum: Optimum) -> list[float]:
    change = np.abs(optimum.controls - fixed.controls)
    change[:, THETA_DOT] *= problem.weights.lag[1:] > 0.0
    return [float(largest) for largest in change.max(axis=0)]
