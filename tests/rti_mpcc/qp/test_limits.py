"""Each limit with and without: a straight drive that the cost pulls beyond it."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest

from rti_mpcc.config import SolverSettings
from rti_mpcc.model.bicycle import linearised_step
from rti_mpcc.model.layout import CONTROLS, DELTA, PHI, STATES, THETA, THETA_DOT, V, X, Y
from rti_mpcc.ocp.bounds import StageBounds
from rti_mpcc.ocp.corridor_rows import CorridorRows
from rti_mpcc.ocp.stage_cost import QuadraticCost
from rti_mpcc.qp.filling import (
    empty_values,
    fill_bounds,
    fill_corridor,
    fill_cost,
    fill_dynamics,
    fill_initial,
)
from rti_mpcc.qp.pattern import BOUNDED, build_pattern
from rti_mpcc.qp.solver import QpSolver
from rti_mpcc.types import Array

N, H = 12, 0.2


@dataclass(kw_only=True)
class Drive:
    """At 1 m/s straight ahead; `pull` is the gradient of the cost, `bounds` are open until set."""

    state_pull: Array = field(default_factory=lambda: np.zeros((N + 1, STATES)))
    control_pull: Array = field(default_factory=lambda: np.zeros((N, CONTROLS)))
    state_bounds: Array = field(default_factory=lambda: np.tile([[-np.inf], [np.inf]], (N, 1, 3)))
    control_bounds: Array = field(default_factory=lambda: np.tile([[-np.inf], [np.inf]], (N, 1, 3)))
    wall: float | None = None
    slack_weight: float = 0.0

    def solve(self) -> tuple[Array, Array, Array]:
        """States, controls and slacks of the one QP."""
        pattern = build_pattern(N, 1, 1)
        states, controls = np.zeros((N + 1, STATES)), np.zeros((N, CONTROLS))
        states[:, X] = states[:, THETA] = H * np.arange(N + 1)
        states[:, V], controls[:, THETA_DOT] = 1.0, 1.0
        cost = QuadraticCost(
            np.tile(np.eye(STATES), (N + 1, 1, 1)), self.state_pull, np.ones((N, CONTROLS)), self.control_pull
        )
        values = empty_values(pattern)
        fill_cost(values, pattern, cost, self.slack_weight, 1.0)
        fill_dynamics(values, pattern, linearised_step(states[:-1], controls, np.full(N, H), 2.875), states)
        fill_bounds(
            values,
            pattern,
            StageBounds(states=self.state_bounds, controls=self.control_bounds),
            states,
            controls,
            rows_scaled=False,  # the plan comes to its bounds from afar
        )
        slopes, lower = np.zeros((N, 1, 1, 3)), np.full((N, 1, 1), -100.0)
        if self.wall is not None:  # y >= wall
            slopes[..., 1], lower[...] = 1.0, self.wall
        fill_corridor(values, pattern, CorridorRows(slopes, lower), rows_scaled=False)
        fill_initial(values, np.zeros(STATES))
        solver = QpSolver(pattern, SolverSettings(tolerance=1e-7, max_iterations=100_000))
        assert solver.update(values) == ""
        rows, columns = pattern.constraints.shape
        solution = solver.solve(values, np.zeros(columns), np.zeros(rows))
        assert solution.solved, solution.status
        change = solution.primal * pattern.column_units
        return (
            states + change[pattern.state_columns],
            controls + change[pattern.control_columns],
            change[pattern.slack_columns],
        )


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(("quantity", "limit"), [(V, 0.5), (DELTA, 0.1), (THETA, 0.3)])
def test_limits_on_states(quantity: int, limit: float, sign: float) -> None:
    column = int(np.flatnonzero(quantity == BOUNDED)[0])
    free = Drive()
    free.state_pull[:, quantity] = -100.0 * sign
    plain = Drive().solve()[0][1:, quantity]
    beyond = sign * (free.solve()[0][1:, quantity] - plain)
    assert beyond.max() > 2.0 * limit
    held = Drive(state_pull=free.state_pull)
    held.state_bounds[:, int(sign > 0.0), column] = plain + sign * limit
    reached = sign * (held.solve()[0][1:, quantity] - plain)
    assert reached.max() == pytest.approx(limit, abs=1e-4)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("column", range(CONTROLS))
def test_limits_on_controls(column: int, sign: float) -> None:
    free = Drive()
    free.control_pull[:, column] = -20.0 * sign
    plain = Drive().solve()[1][:, column]
    assert (sign * (free.solve()[1][:, column] - plain)).max() > 1.0
    held = Drive(control_pull=free.control_pull)
    held.control_bounds[:, int(sign > 0.0), column] = plain + sign * 0.4
    reached = sign * (held.solve()[1][:, column] - plain)
    assert reached.max() == pytest.approx(0.4, abs=1e-4)


def pulled(wall: float | None, slack_weight: float) -> tuple[Array, Array]:
    """y and slacks of a drive that is pulled to the right at its end."""
    drive = Drive(wall=wall, slack_weight=slack_weight)
    drive.state_pull[-1, Y] = 50.0
    states, _, slack = drive.solve()
    return states[1:, Y], slack


def test_the_penalty_of_a_half_plane_is_exact_above_the_pull_and_yields_below_it() -> None:
    free, _ = pulled(None, 1.0)
    assert free.min() < -0.5
    held, slack = pulled(-0.2, 500.0)
    assert held.min() == pytest.approx(-0.2, abs=1e-4)
    assert slack.max() < 1e-5
    pushed, slack = pulled(-0.2, 5.0)
    assert pushed.min() < -0.3
    np.testing.assert_allclose(slack, np.maximum(-0.2 - pushed, 0.0), atol=1e-4)


def test_a_row_that_cannot_be_met_is_relieved_by_as_much_as_it_lacks() -> None:
    states, _, slack = Drive(wall=3.0, slack_weight=500.0).solve()
    np.testing.assert_allclose(slack, np.maximum(3.0 - states[1:, Y], 0.0), atol=1e-4)
    assert slack[0] > 1.0
    assert np.abs(states[:, PHI]).max() > 0.05  # it tries
