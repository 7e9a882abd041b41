"""Repeated real-time iterations at frozen states solve the nonlinear program. The full list: acceptance."""

from __future__ import annotations

import numpy as np
import pytest

from rti_mpcc.model.layout import X
from rti_mpcc.ocp.frenet import world_to_local
from rti_mpcc.qp.filling import empty_values
from rti_mpcc.simulation import load_scenario
from tests.lists import acceptance
from tests.rti_mpcc.convergence import examine
from tests.rti_mpcc.docking_runs import before_a_wall
from tests.rti_mpcc.frozen import FrozenProblem, iterate, take
from tests.rti_mpcc.nonlinear_program import NonlinearProgram

STATES = [
    ("docking_inside", "default", 10.18),  # arrival at a goal beside the path
    # contouring with the progress reward
    acceptance("long_approach", "default", 30.18),
    # all terms of the published code
    acceptance("docking_behind", "paper", 5.18),
]


@pytest.mark.parametrize(("scenario", "preset", "time"), STATES)
def test_repeated_iterations_solve_the_nonlinear_program(
    scenario: str, preset: str, time: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    (problem,) = take(load_scenario(scenario), preset, [time], monkeypatch)
    examine(problem).check()


@pytest.mark.parametrize(
    ("offset", "room"),
    [
        ((0.0, 0.0, 0.0), 0.06),
        # Turned so far a front corner is 0.07 m farther ahead.
        acceptance((0.0, 0.2, 0.08), 0.13),
    ],
)
def test_a_plan_that_a_wall_ahead_holds_solves_the_nonlinear_program(
    offset: tuple[float, float, float], room: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A wall 0.06 m ahead of the body at the goal, nearer than the margin."""
    scenario = before_a_wall(1, room)
    scenario = scenario.model_copy(update={"goal": scenario.goal.model_copy(update={"offset": offset})})
    (problem,) = take(scenario, "default", [12.18], monkeypatch)
    assert problem.solution.trajectory.states[-1, X] < 12.0 - 0.02
    examine(problem).check()


@pytest.fixture(scope="module")
def problem() -> FrozenProblem:
    with pytest.MonkeyPatch.context() as patch:
        return take(load_scenario("docking_behind"), "paper", [5.18], patch)[0]


def test_the_frozen_problem_is_the_one_that_the_controller_solved(problem: FrozenProblem) -> None:
    """Its first step, at the controller's own tolerance, ends where the controller's did."""
    first = iterate(problem, most=1, settings=problem.config.solver)
    planned = world_to_local(problem.frame, problem.solution.trajectory.states)
    np.testing.assert_allclose(first.states, planned, atol=3e-2)  # 20 m ahead
    soon = slice(0, 20)  # far stages are soft: OSQP's tolerance moves their controls more
    np.testing.assert_allclose(first.controls[soon], problem.solution.trajectory.controls[soon], atol=2e-2)


def test_the_qps_gradient_is_the_slope_of_the_nonlinear_programs_cost(problem: FrozenProblem) -> None:
    """One function for both: d J along random directions, casadi's cost against the filled q."""
    random, pattern = np.random.default_rng(7), problem.build_pattern()
    values, program = empty_values(pattern), NonlinearProgram(problem)
    dual = np.zeros(len(values.lower))
    problem.fill(values, pattern, problem.states, problem.controls, dual)
    slack = np.full(len(problem.lengths), 0.1)
    for _ in range(5):
        direction = random.standard_normal(len(pattern.column_units)) * pattern.column_units
        columns = (pattern.state_columns, pattern.control_columns, pattern.slack_columns)
        d_states, d_controls, d_slack = (direction[c] for c in columns)
        h = 1e-6
        costs = [
            program.cost(
                problem.states + e * d_states, problem.controls + e * d_controls, slack + e * d_slack
            )
            for e in (-h, h)
        ]
        slope = (costs[1] - costs[0]) / (2.0 * h) * problem.weights.scale
        planned = float(values.gradient @ (direction / pattern.column_units))
        assert planned == pytest.approx(slope, rel=1e-5)
