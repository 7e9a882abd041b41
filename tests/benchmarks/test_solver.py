"""The ways of solving a QP that are compared have the same solution."""

from __future__ import annotations

import numpy as np
import osqp
import pytest

from benchmarks.measure_solver import WAYS, Recorded, recorded, rows
from rti_mpcc.model.layout import DELTA_DOT, THETA_DOT, A
from rti_mpcc.qp.problem import QpProblem
from rti_mpcc.types import Array

ELIMINATED = {
    "virtual progress eliminated": [THETA_DOT],
    "a and δ̇ eliminated": [A, DELTA_DOT],
    "all controls eliminated": [A, DELTA_DOT, THETA_DOT],
}


@pytest.fixture(scope="module")
def problems() -> list[Recorded]:
    return recorded(("docking_inside",), 150)


def optimum(qp: QpProblem) -> Array:
    """The solution (n,), tightly."""
    solver = osqp.OSQP()
    solver.setup(
        qp.cost,
        qp.gradient,
        qp.constraints,
        qp.lower,
        qp.upper,
        eps_abs=1e-9,
        eps_rel=1e-9,
        max_iter=200_000,
        scaling=0,
        verbose=False,
    )
    found = solver.solve(raise_error=True)
    assert found.info.status == "solved"
    return np.asarray(found.x)


@pytest.mark.parametrize("name", WAYS)
def test_each_way_has_the_same_solution(name: str, problems: list[Recorded]) -> None:
    changed, _ = WAYS[name]
    assert len(problems) >= 2
    for qp, pattern, scaling in problems:
        other = changed(qp, pattern, scaling)
        gone = pattern.control_columns[:, ELIMINATED.get(name, [])].ravel()
        whole = np.delete(optimum(qp), gone)
        assert optimum(other) == pytest.approx(whole, abs=2e-4)


def test_the_table_has_a_row_for_each_way(problems: list[Recorded]) -> None:
    lines = rows(problems)
    assert [line[0] for line in lines] == list(WAYS)
    assert all(float(figure) > 0.0 for line in lines for figure in line[1:])
