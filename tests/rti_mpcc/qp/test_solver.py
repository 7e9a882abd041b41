from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from rti_mpcc.config import SolverSettings
from rti_mpcc.model.layout import V
from rti_mpcc.qp.filling import QpValues, empty_values
from rti_mpcc.qp.pattern import QpPattern, build_pattern
from rti_mpcc.qp.solver import ITERATIONS, QpSolution, QpSolver, solve_by_interior_point
from rti_mpcc.types import Array

STAGES = 10
SETTINGS = SolverSettings(tolerance=1e-7)
"""So exactly OSQP solves the QPs here from their solution, but not from nothing."""


@pytest.fixture
def pattern() -> QpPattern:
    return build_pattern(STAGES, 2, 2)


def problem(pattern: QpPattern, seed: int) -> QpValues:
    """A convex QP that is feasible at 0: random diagonal cost, random slopes, bounds around 0."""
    random = np.random.default_rng(seed)
    values = empty_values(pattern)
    for slots in (pattern.control_hessians, pattern.slack_hessians):
        values.cost[slots] = random.uniform(0.1, 2.0, slots.shape)
    diagonal = pattern.cost_matrix(np.arange(len(values.cost), dtype=float) + 1.0).diagonal()
    values.cost[diagonal.astype(int) - 1] = random.uniform(0.1, 2.0, len(diagonal))
    values.gradient[:] = random.standard_normal(len(values.gradient))
    for group in (pattern.poses, pattern.driven, pattern.half_planes):
        values.constraints[group] = random.uniform(-0.3, 0.3, group.shape)
    values.lower[:], values.upper[:] = -random.uniform(0.1, 1.0, (2, len(values.lower))) * [[1.0], [-1.0]]
    rows = pattern.dynamics_rows
    values.lower[rows] = values.upper[rows] = 0.0
    values.lower[pattern.slack_rows] = 0.0
    return values


def solve(solver: QpSolver, values: QpValues) -> QpSolution:
    """From nothing, by the interior point."""
    return solver.solve(values, np.zeros(len(values.gradient)), np.zeros(len(values.lower)))


def solve_near(solver: QpSolver, values: QpValues, pattern: QpPattern) -> QpSolution:
    """From its solution, by OSQP."""
    exact = solve_by_interior_point(pattern, values)
    return solver.solve(values, exact.primal, exact.dual)


def good(solution: QpSolution, values: QpValues, pattern: QpPattern, *, exact: bool = False) -> None:
    """Optimality of a solution, from the matrices; `exact`: by the interior point."""
    assert solution.interior_point == exact
    p, a = pattern.cost_matrix(values.cost), pattern.constraint_matrix(values.constraints)
    whole = p + p.T
    whole.setdiag(p.diagonal())
    assert solution.solved
    row = a @ solution.primal
    assert (row >= values.lower - 1e-6).all()
    assert (row <= values.upper + 1e-6).all()
    slope = whole @ solution.primal + values.gradient + a.T @ solution.dual
    np.testing.assert_allclose(slope, 0.0, atol=1e-6)
    inside = (row > values.lower + 1e-5) & (row < values.upper - 1e-5)
    np.testing.assert_allclose(solution.dual[inside], 0.0, atol=1e-5)


def nothing(solution: QpSolution) -> None:
    assert not solution.solved
    assert solution.status
    assert not solution.primal.any()
    assert not solution.dual.any()


def test_solutions_are_optimal(pattern: QpPattern) -> None:
    values, solver = problem(pattern, 1), QpSolver(pattern, SETTINGS)
    assert solver.update(values) == ""
    good(solve(solver, values), values, pattern, exact=True)
    good(solve_near(solver, values, pattern), values, pattern)


def test_an_updated_solver_answers_as_a_fresh_one(pattern: QpPattern) -> None:
    updated, by_osqp = QpSolver(pattern, SETTINGS), 0
    for seed in range(4):
        values, fresh = problem(pattern, seed), QpSolver(pattern, SETTINGS)
        kept = values._replace(cost=values.cost.copy(), constraints=values.constraints.copy())
        assert updated.update(values) == ""
        assert fresh.update(values) == ""
        found, exact = solve_near(updated, values, pattern), solve(updated, values)
        by_osqp += not found.interior_point
        assert exact.interior_point
        np.testing.assert_array_equal(found.primal, solve_near(fresh, values, pattern).primal)
        np.testing.assert_array_equal(exact.primal, solve(fresh, values).primal)
        np.testing.assert_allclose(found.primal, exact.primal, atol=1e-4)
        np.testing.assert_array_equal(values.cost, kept.cost)  # OSQP must not write into them
        np.testing.assert_array_equal(values.constraints, kept.constraints)
    assert by_osqp >= 2


def test_a_qp_is_solved_to_the_tolerance_and_soon_again_from_its_solution(pattern: QpPattern) -> None:
    values, tolerance = problem(pattern, 1), 1e-2
    solver = QpSolver(pattern, SolverSettings(tolerance=tolerance))
    solver.update(values)
    first = solve(solver, values)
    again = solver.solve(values, first.primal, first.dual)
    for each in (first, again):
        assert each.solved
        assert not each.interior_point
        assert max(each.residuals) < 10.0 * tolerance  # it is relative, too
    assert again.iterations < first.iterations


@pytest.mark.parametrize("free_end", [False, True])
def test_a_qp_that_osqp_does_not_finish_is_solved_exactly(free_end: bool) -> None:
    """Here its guess misleads it. The next one begins from the solution, and is OSQP's again."""
    pattern = build_pattern(STAGES, 2, 2, free_end=free_end)
    values, solver = problem(pattern, 1), QpSolver(pattern, SolverSettings())
    solver.update(values)
    far = np.full(len(values.gradient), 1e4), np.full(len(values.lower), -1e5)
    misled = solver.solve(values, *far)
    assert misled.iterations > ITERATIONS
    good(misled, values, pattern, exact=True)
    again = solver.solve(values, misled.primal, misled.dual)
    assert not again.interior_point
    np.testing.assert_allclose(again.primal, misled.primal, atol=1e-2)


def test_rows_without_bounds_cost_nothing(pattern: QpPattern) -> None:
    values, solver = problem(pattern, 1), QpSolver(pattern, SETTINGS)
    values.lower[pattern.bound_rows], values.upper[pattern.bound_rows] = -np.inf, np.inf
    solver.update(values)
    found = solve(solver, values)
    assert not found.dual[pattern.bound_rows].any()
    good(found, values, pattern, exact=True)


def test_without_an_update_there_is_no_solution(pattern: QpPattern) -> None:
    nothing(solve(QpSolver(pattern, SETTINGS), problem(pattern, 1)))


def spoilt(values: QpValues, name: str, number: float) -> QpValues:
    array: Array = getattr(values, name).copy()
    array[3] = number
    return _with(values, name, array)


def _with(values: QpValues, name: str, array: Array) -> QpValues:
    changes: dict[str, Any] = {name: array}
    return values._replace(**changes)


@pytest.mark.parametrize("name", ["cost", "gradient", "constraints", "lower", "upper"])
@pytest.mark.parametrize("fresh", [True, False])
def test_what_is_not_a_number_is_refused(pattern: QpPattern, name: str, fresh: bool) -> None:
    """Once there is a QP, bounds come with the feedback, and are refused there."""
    solver, values = QpSolver(pattern, SETTINGS), problem(pattern, 1)
    if not fresh:
        solver.update(values)
    bad = spoilt(values, name, np.nan)
    if fresh or name not in ("lower", "upper"):
        assert solver.update(bad) != ""
    else:
        nothing(solve(solver, bad))
    assert solver.update(values) == ""
    good(solve_near(solver, values, pattern), values, pattern)


@pytest.mark.parametrize("fresh", [True, False])
def test_a_cost_that_is_not_convex_is_refused_and_the_next_qp_solves(pattern: QpPattern, fresh: bool) -> None:
    """OSQP keeps half of such numbers, and calls what it makes of them solved."""
    solver, values = QpSolver(pattern, SETTINGS), problem(pattern, 1)
    if not fresh:
        assert solver.update(values) == ""
    concave = values._replace(cost=values.cost.copy())
    concave.cost[pattern.control_hessians] = -1e3
    assert "refused by OSQP" in solver.update(concave)
    nothing(solve(solver, concave))
    assert solver.update(values) == ""
    good(solve_near(solver, values, pattern), values, pattern)


def test_a_lower_bound_above_the_upper_one_is_refused(pattern: QpPattern) -> None:
    solver, values = QpSolver(pattern, SETTINGS), problem(pattern, 1)
    crossed = spoilt(values, "lower", 9.0)
    assert "above" in solver.update(crossed)
    assert solver.update(values) == ""
    nothing(solve(solver, crossed))
    nothing(solve(solver, spoilt(values, "lower", np.nan)))
    nothing(solve(solver, spoilt(values, "lower", np.inf)))
    good(solve_near(solver, values, pattern), values, pattern)


def test_an_infeasible_qp_gives_nothing_and_the_next_one_solves(pattern: QpPattern) -> None:
    solver, values = QpSolver(pattern, SETTINGS), problem(pattern, 1)
    solver.update(values)
    impossible = values._replace(lower=values.lower.copy(), upper=values.upper.copy())
    row = pattern.dynamics_rows[0, V]  # the speed begins far beyond its own bound
    impossible.lower[row] = impossible.upper[row] = 1e4
    nothing(solve(solver, impossible))
    good(solve_near(solver, values, pattern), values, pattern)


def word_after(most: int) -> Callable[[int], str]:
    return lambda iterations: "enough" if iterations >= most else ""


@pytest.mark.parametrize("after", [0, ITERATIONS])
def test_a_qp_is_stopped_before_osqp_and_before_the_interior_point(pattern: QpPattern, after: int) -> None:
    values, solver = problem(pattern, 1), QpSolver(pattern, SETTINGS)
    solver.update(values)
    guess = np.full(len(values.gradient), 0.1), np.zeros(len(values.lower))
    stopped = solver.solve(values, *guess, word_after(after))
    nothing(stopped)
    assert stopped.stopped == ("enough", after)
    good(solve(solver, values), values, pattern, exact=True)
