"""What the ways of solving the same QPs are worth, on recorded ones.

    OMP_NUM_THREADS=1 python -m benchmarks.measure_solver [--docs]

Drives four scenarios and keeps every twelfth QP that was solved, with the guess that it was begun from. OSQP
solves each again to the same tolerance in all ways: as the controller does it, and with one thing changed.
The interior point solves each to its own tolerance. Prints the table and, with `--docs`, writes it into
docs/decisions/04-solver-settings.md.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any
from unittest.mock import patch

import numpy as np
import osqp
from rich.progress import track
from scipy import sparse

from benchmarks.tables import ROOT, command_line, number, origin, replace_block, table, told
from rti_mpcc.controller import RtiMpcc
from rti_mpcc.iteration import Solution
from rti_mpcc.model.layout import DELTA, DELTA_DOT, THETA, THETA_DOT, A, V
from rti_mpcc.qp.filling import QpValues
from rti_mpcc.qp.pattern import QpPattern
from rti_mpcc.qp.problem import QpProblem
from rti_mpcc.qp.solver import CHECK_INTERVAL, OVER_RELAXATION, RHO, solve_by_interior_point
from rti_mpcc.simulation import load_scenario, simulate
from rti_mpcc.types import Array

COMMAND = "python -m benchmarks.measure_solver"
SCENARIOS = ("docking_behind", "docking_inside", "docking_full_course", "path_following")
EVERY = 12
REPEATS = 3
"""Of which the least time counts."""
TOLERANCE = 1e-4
Recorded = tuple[QpProblem, QpPattern, Array]
"""A problem, its pattern and what its rows were scaled by (m,)."""


def recorded(scenarios: tuple[str, ...], every: int) -> list[Recorded]:
    """Every so many of the QPs that were solved, in the order in which they came."""
    found: list[Recorded] = []
    feedback = RtiMpcc.feedback

    def keeping(core: RtiMpcc, *args: Any, **options: Any) -> Solution:
        solution = feedback(core, *args, **options)
        if solution.solved:
            found.append((core.problem(), core._pattern, core._values.row_scaling.copy()))
        return solution

    with patch.object(RtiMpcc, "feedback", keeping):
        for name in scenarios:
            simulate(load_scenario(name))
    return found[every // 2 :: every]


def as_it_is(qp: QpProblem, pattern: QpPattern, scaling: Array) -> QpProblem:
    return qp


def unscaled(qp: QpProblem, pattern: QpPattern, scaling: Array) -> QpProblem:
    """With rows in their own units, however far off their bounds are."""
    return replace(
        qp,
        constraints=(sparse.diags(scaling) @ qp.constraints).tocsc(),
        lower=qp.lower * scaling,
        upper=qp.upper * scaling,
        dual=qp.dual / scaling,
    )


def without_dual(qp: QpProblem, pattern: QpPattern, scaling: Array) -> QpProblem:
    return replace(qp, dual=np.zeros_like(qp.dual))


def eliminated(
    states: list[int], controls: list[int], qp: QpProblem, pattern: QpPattern, scaling: Array
) -> QpProblem:
    """Without controls that follow from the states they change: x = T z + t in cost and rows.

    `states`, `controls`: which rows of the dynamics tell which controls.
    """
    constraints = sparse.csr_matrix(qp.constraints)
    rows = pattern.dynamics_rows[1:][:, states].ravel()
    gone = pattern.control_columns[:, controls].ravel()
    kept = np.setdiff1d(np.arange(len(qp.gradient)), gone)
    rest = np.setdiff1d(np.arange(len(qp.lower)), rows)
    told_by = constraints[rows]
    gain = np.asarray(told_by[np.arange(len(rows)), gone]).ravel()
    shift = np.zeros(len(qp.gradient))
    shift[gone] = qp.lower[rows] / gain
    columns = len(qp.gradient)
    keeping = sparse.identity(columns, format="csc")[:, kept]
    giving = sparse.identity(columns, format="csc")[:, gone]
    change = (keeping - giving @ sparse.diags(1.0 / gain) @ told_by[:, kept]).tocsc()
    cost = (qp.cost + sparse.triu(qp.cost, 1).T).tocsc()
    offset = constraints[rest] @ shift
    return QpProblem(
        cost=sparse.triu(change.T @ cost @ change).tocsc(),
        gradient=change.T @ (qp.gradient + cost @ shift),
        constraints=(constraints[rest] @ change).tocsc(),
        lower=qp.lower[rest] - offset,
        upper=qp.upper[rest] - offset,
        primal=qp.primal[kept],
        dual=qp.dual[rest],
    )


def solved(
    qp: QpProblem, pattern: QpPattern, scaling: Array, *, check: int = CHECK_INTERVAL
) -> tuple[int, float]:
    """OSQP's iterations, and its time [µs]; it looks every `check` iterations whether it is at the end."""
    solver = osqp.OSQP()
    solver.setup(
        qp.cost,
        qp.gradient,
        qp.constraints,
        qp.lower,
        qp.upper,
        rho=RHO,
        alpha=OVER_RELAXATION,
        eps_abs=TOLERANCE,
        eps_rel=TOLERANCE,
        max_iter=2000,
        check_termination=check,
        scaling=0,
        check_dualgap=False,
        adaptive_rho=False,
        warm_starting=True,
        verbose=False,
    )
    times, iterations = [], 0
    for _ in range(REPEATS):
        solver.warm_start(x=qp.primal, y=qp.dual)
        info = solver.solve(raise_error=False).info
        iterations = int(info.iter)
        times.append(float(info.solve_time))
    return iterations, 1e6 * min(times)


def solved_exactly(qp: QpProblem, pattern: QpPattern, scaling: Array) -> tuple[int, float]:
    """PIQP's iterations, and its time [µs] with set-up."""
    values = QpValues(qp.cost.data, qp.gradient, qp.constraints.data, qp.lower, qp.upper, scaling)
    found = [solve_by_interior_point(pattern, values) for _ in range(REPEATS)]
    return found[0].iterations, 1e6 * min(each.seconds for each in found)


Change = Callable[[QpProblem, QpPattern, Array], QpProblem]
Solve = Callable[[QpProblem, QpPattern, Array], tuple[int, float]]
WAYS: dict[str, tuple[Change, Solve]] = {
    "as it is": (as_it_is, solved),
    "rows in their own units at any distance": (unscaled, solved),
    "termination checked every iteration": (as_it_is, partial(solved, check=1)),
    "every 3": (as_it_is, partial(solved, check=3)),
    "no guess of the multipliers": (without_dual, solved),
    "virtual progress eliminated": (partial(eliminated, [THETA], [THETA_DOT]), solved),
    "a and δ̇ eliminated": (partial(eliminated, [V, DELTA], [A, DELTA_DOT]), solved),
    "all controls eliminated": (partial(eliminated, [V, DELTA, THETA], [A, DELTA_DOT, THETA_DOT]), solved),
    "by the interior point, with set-up": (as_it_is, solved_exactly),
}
"""What is done to a QP, and what solves it."""


def rows(problems: list[Recorded]) -> list[list[str]]:
    """One row of the table for each way."""
    lines = []
    for name, (changed, solve) in track(WAYS.items(), "solving", transient=True):
        found = np.array([solve(changed(*one), *one[1:]) for one in problems])
        iterations, times = found[:, 0], found[:, 1]
        p50, p95 = np.percentile(iterations, (50.0, 95.0))
        each = float(np.median(times / iterations))
        figures = [(p50, 0), (p95, 0), (iterations.mean(), 1), (float(np.median(times)), 0), (each, 1)]
        lines.append([name, *(number(float(value), digits) for value, digits in figures)])
    return lines


def main() -> None:
    parser = command_line(__doc__, COMMAND)
    parser.add_argument("--docs", action="store_true", help="write docs/decisions/04-solver-settings.md")
    asked = parser.parse_args()
    source = origin(COMMAND)
    problems = recorded(SCENARIOS, EVERY)
    header = [f"{len(problems)} QPs to {TOLERANCE:g}", "iterations p50", "p95", "mean", "solve p50 [µs]"]
    text = table([*header, "an iteration [µs]"], rows(problems))
    print(text)
    if asked.docs:
        page = ROOT / "docs" / "decisions" / "04-solver-settings.md"
        replace_block(page, "ways", f"{text}\n\n{told(source)}")


if __name__ == "__main__":
    main()
