"""QPs that OSQP has not solved after some fifty iterations, by the interior-point method of PIQP.

A QP with many rows at their bounds takes OSQP hundreds of iterations, or never ends. An interior point takes
ten to twenty whatever the rows do, each as long as eight of OSQP's. It knows no guess, so a QP near the last
one is OSQP's: that takes a tenth of the time (docs/decisions, 4).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import piqp

from geometry.arrays import all_finite
from rti_mpcc.qp.filling import QpValues
from rti_mpcc.qp.pattern import QpPattern
from rti_mpcc.types import Array

ACCURACY = 1e-8
"""Of the residuals, absolute and relative: one that has come near is there in two iterations more."""
MOST_ITERATIONS = 100
"""Of 165 QPs that OSQP did not finish none took more than 26."""
CERTAIN = 1e-12
"""Tolerance of PIQP's tests for QPs without a solution. The controller's have one, by their slack: by PIQP's
own 1e-4 some of them had none."""


class InteriorPoint(NamedTuple):
    """What PIQP found; primal (n,) and dual (m,) are 0 without a solution.

    `iterations`: of PIQP; `residuals`: its (primal, dual); `seconds`: of set-up and solve.
    """

    solved: bool
    primal: Array
    dual: Array
    status: str
    iterations: int
    residuals: tuple[float, float]
    seconds: float


def solve_exactly(pattern: QpPattern, values: QpValues) -> InteriorPoint:
    """Solve a QP whose numbers are finite. Nothing is kept: equal values give equal answers, to the bit."""
    rows, columns = pattern.shape
    matrix = pattern.constraint_matrix(values.constraints).tocsr()
    bounded = np.isfinite(values.lower) | np.isfinite(values.upper)
    bounded[pattern.dynamics_rows] = False
    equations, bounds = pattern.dynamics_rows.ravel(), np.flatnonzero(bounded)
    solver = piqp.SparseSolver()
    settings = solver.settings
    settings.eps_abs = settings.eps_rel = ACCURACY
    settings.eps_primal_inf = settings.eps_dual_inf = CERTAIN
    settings.max_iter = MOST_ITERATIONS
    settings.check_duality_gap, settings.compute_timings = False, True
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
    solved = status == piqp.PIQP_SOLVED and all_finite(primal) and all_finite(dual)
    if not solved:
        primal, dual = np.zeros(columns), np.zeros(rows)
    residuals = float(found.info.primal_res), float(found.info.dual_res)
    return InteriorPoint(
        solved, primal, dual, status.name, found.info.iter, residuals, float(found.info.run_time)
    )
