"""QPs that OSQP has not solved after some fifty iterations, by the interior-point method of PIQP.

A QP with many rows at their bounds takes OSQP hundreds of iterations, or never ends. An interior point takes
ten to twenty whatever the rows do, each as long as eight of OSQP's. It knows no guess, so a QP near the last
one is OSQP's: that takes a tenth of the time (docs/decisions, 4).
"""

from __future__ import annotations

from time import perf_counter

import numpy as np
import piqp

from rti_mpcc.qp.filling import QpValues
from rti_mpcc.qp.pattern import QpPattern
from rti_mpcc.qp.solution import SOLVED, QpSolution

ACCURACY = 1e-8
"""Of the residuals, absolute and relative. The last two iterations come from 1e-4 to this."""
MOST_ITERATIONS = 40
"""Of 165 QPs that OSQP did not finish none took more than 26."""
INFEASIBILITY = 1e-12
"""Tolerance of PIQP's tests for QPs without a solution: with its own 1e-4 some that have one failed. Those of
the controller have one: walls give way by a slack, bounds on v and delta are widened."""


def solve_by_interior_point(pattern: QpPattern, values: QpValues) -> QpSolution:
    """Solve a QP whose numbers are finite. Nothing is kept: equal values give equal answers, to the bit."""
    started = perf_counter()
    rows, _ = pattern.shape
    matrix = pattern.constraint_matrix(values.constraints).tocsr()
    bounded = np.isfinite(values.lower) | np.isfinite(values.upper)
    bounded[pattern.dynamics_rows] = False
    equations, bounds = pattern.dynamics_rows.ravel(), np.flatnonzero(bounded)
    solver = piqp.SparseSolver()
    settings = solver.settings
    settings.eps_abs = settings.eps_rel = ACCURACY
    settings.eps_primal_inf = settings.eps_dual_inf = INFEASIBILITY
    settings.max_iter = MOST_ITERATIONS
    settings.check_duality_gap = False
    solver.setup(
        pattern.cost_matrix(values.cost),
        values.gradient,
        matrix[equations].tocsc(),
        values.lower[equations],
        matrix[bounds].tocsc(),
        values.lower[bounds],
        values.upper[bounds],
    )
    status, found = solver.solve(), solver.result
    primal, dual = np.array(found.x), np.zeros(rows)
    dual[equations], dual[bounds] = found.y, found.z_u - found.z_l
    iterations, seconds = int(found.info.iter), perf_counter() - started
    if status != piqp.PIQP_SOLVED or not (np.isfinite(primal).all() and np.isfinite(dual).all()):
        word = status.name.removeprefix("PIQP_").lower().replace("_", " ")
        return QpSolution.none(pattern, f"interior point: {word}", iterations, seconds)
    residuals = float(found.info.primal_res), float(found.info.dual_res)
    return QpSolution(True, primal, dual, SOLVED, iterations, residuals, seconds)
