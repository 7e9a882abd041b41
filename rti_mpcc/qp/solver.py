"""The one door to OSQP.

It is OSQP's extension that is called: its Python class does not pass on what an update was answered. An
update that is refused leaves a problem that is neither the old one nor the new one, which OSQP then calls
solved. An unsolved QP may leave finite garbage behind, too. Only a status on the list of good ones gives a
solution, and only of a problem that was taken whole.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import inf
from typing import Any, NamedTuple

import numpy as np
import osqp
from scipy.sparse import csc_matrix

from geometry.arrays import all_finite
from geometry.compiled import Array1, Out1, kernel
from rti_mpcc.config import SolverSettings
from rti_mpcc.qp.filling import QpValues
from rti_mpcc.qp.interior_point import solve_exactly
from rti_mpcc.qp.pattern import QpPattern
from rti_mpcc.types import Array

GOOD = frozenset({int(osqp.SolverStatus.OSQP_SOLVED)})
"""Only these give a solution: "solved inaccurate" is what a QP ends at that a limit has stopped."""

SOLVED = "solved"
UNFINISHED = frozenset(
    {
        int(osqp.SolverStatus.OSQP_MAX_ITER_REACHED),
        int(osqp.SolverStatus.OSQP_SOLVED_INACCURATE),
        int(osqp.SolverStatus.OSQP_PRIMAL_INFEASIBLE_INACCURATE),
        int(osqp.SolverStatus.OSQP_DUAL_INFEASIBLE_INACCURATE),
    }
)
"""What a QP is called that has had its iterations and not come to an end."""

FINE_TOLERANCE, FINE_ITERATIONS = 1e-6, 6
"""Tolerance of the first iterations of a QP: a shape that costs little changes by little from cycle to cycle,
and never comes to its best where that is within the tolerance. What is not that good by then has to reach
`SolverSettings.tolerance`."""
MORE_ITERATIONS = 48
"""For that. A QP that has not ended by then, one in a hundred, is one for the interior point."""
CHECK_INTERVAL = 6
"""Iterations between two termination checks."""
RHO = 3.0
"""OSQP's step-size parameter, which never changes: a solve depends on its QP and its guess alone."""
OVER_RELAXATION = 1.0
"""OSQP's alpha. Rows that are equalities or far from their bounds, most of them, settle by |1 - alpha| an
iteration: with OSQP's 1.6 that alone takes 20 iterations, with 1 a QP near its guess takes 3."""

_EXTENSION: Any = osqp.OSQP().ext
_INFINITY = float(_EXTENSION.OSQP_INFTY)
"""What OSQP takes for infinite."""

BAD_BOUNDS = "bounds that are no numbers, or a lower one above its upper one"

Ends = Callable[[int], str]
"""After so many iterations: "" to go on with a QP, or the word for what ends it."""


class Stop(NamedTuple):
    """What ended a QP from outside, not by its own numbers: the word for it, and the iterations by then."""

    status: str
    iterations: int


@dataclass(frozen=True, slots=True)
class QpSolution:
    """What a solve gave.

    Attributes:
        solved: whether the status is good and all numbers are finite; if not, `primal` and `dual` are 0.
        primal: (n,), dual: (m,), in scaled units.
        status: of the solver; iterations: of OSQP, and of PIQP where it came to that.
        interior_point: whether it did; residuals: (primal, dual), scaled; infinite without a solution.
        stopped: what ended the solve from outside, or None.
        seconds: of the solve.
    """

    solved: bool
    primal: Array
    dual: Array
    status: str
    iterations: int
    interior_point: bool
    residuals: tuple[float, float]
    stopped: Stop | None
    seconds: float


class DenseQp(NamedTuple):
    """min x'Px/2 + q'x, l <= Ax <= u, with numbers of about 1: nothing is scaled.

    Attributes:
        cost: P (n, n); gradient: q (n,); constraints: A (m, n); lower, upper: l, u (m,).
    """

    cost: Array
    gradient: Array
    constraints: Array
    lower: Array
    upper: Array


def solve_once(problem: DenseQp, *, accuracy: float, iterations: int) -> Array | None:
    """The solution (n,) of a QP that is not solved again, or None.

    Args:
        accuracy: absolute and relative, of the residuals; iterations: at most.

    Raises:
        ValueError: numbers that are none, or a lower bound above its upper one.
    """
    cost, gradient, constraints, lower, upper = problem
    if not all(map(all_finite, (cost, gradient, constraints))) or not (lower <= upper).all():
        raise ValueError(BAD_BOUNDS)
    solver = osqp.OSQP()
    solver.setup(
        csc_matrix(np.triu(cost)), gradient, csc_matrix(constraints), lower, upper,
        verbose=False, scaling=0, rho=1.0, eps_abs=accuracy, eps_rel=accuracy, max_iter=iterations,
        check_termination=10,
    )  # fmt: skip
    answer = solver.solve(raise_error=False)
    if int(answer.info.status_val) not in GOOD | UNFINISHED or not np.isfinite(answer.x).all():
        return None
    return np.asarray(answer.x)


class QpSolver:
    """Solves QPs of one pattern: by OSQP, which is quick near its guess, else by an interior point."""

    def __init__(self, pattern: QpPattern, settings: SolverSettings) -> None:
        self._pattern = pattern
        tolerance = settings.tolerance
        self._slices = (FINE_ITERATIONS, min(FINE_TOLERANCE, tolerance)), (MORE_ITERATIONS, tolerance)
        self._osqp: Any = None
        self._osqp_settings: Any = None
        rows, _ = pattern.shape
        self._bounds = (np.empty(rows), np.empty(rows))

    def __getstate__(self) -> dict[str, Any]:
        """All but OSQP's memory, which cannot be copied: a copy sets it up with its first QP."""
        return {**self.__dict__, "_osqp": None, "_osqp_settings": None}

    def update(self, values: QpValues) -> str:
        """Preparation: hand over all but the bounds (factorises). Returns "" or why that was refused.

        After numbers that OSQP refuses it is set up anew with the next ones.
        """
        for name in ("cost", "gradient", "constraints"):
            if not all_finite(getattr(values, name)):
                return f"{name} not finite"
        if self._osqp is None:
            return self._set_up(values)
        error = self._osqp.update_data_vec(q=values.gradient, l=None, u=None)
        error = error or self._osqp.update_data_mat(
            P_x=values.cost, P_i=None, A_x=values.constraints, A_i=None
        )
        return self._refused(error) if error else ""

    def solve(self, values: QpValues, primal: Array, dual: Array, ends: Ends | None = None) -> QpSolution:
        """Feedback: hand over the bounds only and solve from a guess.

        Args:
            values: as in the last `update`, but for its bounds.
            primal: (n,), dual: (m,) guess in scaled units.
            ends: asked before each slice of iterations, and before the interior point.
        """
        if self._osqp is None:
            return self.nothing("not prepared")
        lower, upper = self._bounds
        if not _taken(values.lower, values.upper, _INFINITY, lower, upper):
            return self.nothing(BAD_BOUNDS)
        error = self._osqp.update_data_vec(q=None, l=lower, u=upper)
        if error:
            return self.nothing(self._refused(error))
        self._osqp.warm_start(primal, dual)
        done, seconds, usual = 0, 0.0, self._slices[-1][1]
        for most, tolerance in self._slices:
            if ends is not None and (word := ends(done)):
                return replace(self.nothing(word, done, seconds), stopped=Stop(word, done))
            self._set(max_iter=most, eps_abs=tolerance, eps_rel=tolerance)
            error = int(self._osqp.solve())
            if error:  # OSQP's solution is an old one
                return self.nothing(self._refused(error), done, seconds)
            info, solution = self._osqp.info, self._osqp.solution
            done, seconds = done + int(info.iter), seconds + float(info.run_time)
            residuals = float(info.prim_res), float(info.dual_res)
            # What the first slice leaves unfinished may be good already: OSQP was asked for more.
            if info.status_val in GOOD or (info.status_val in UNFINISHED and max(residuals) <= usual):
                primal, dual = np.array(solution.x), np.array(solution.y)
                if all_finite(primal) and all_finite(dual):
                    return QpSolution(True, primal, dual, SOLVED, done, False, residuals, None, seconds)
        if ends is not None and (word := ends(done)):
            return replace(self.nothing(word, done, seconds), stopped=Stop(word, done))
        found = solve_exactly(self._pattern, values)
        if not found.solved:
            return self.nothing(found.status, done + found.iterations, seconds + found.seconds)
        return QpSolution(
            True, found.primal, found.dual, SOLVED, done + found.iterations, True, found.residuals, None,
            seconds + found.seconds,
        )  # fmt: skip

    def _set_up(self, values: QpValues) -> str:
        if not _taken(values.lower, values.upper, _INFINITY, *self._bounds):
            return BAD_BOUNDS
        (most, tolerance), (rows, columns) = self._slices[0], self._pattern.shape
        self._osqp_settings = _EXTENSION.OSQPSettings()
        _EXTENSION.osqp_set_default_settings(self._osqp_settings)
        self._set(
            rho=RHO,
            adaptive_rho=False,
            alpha=OVER_RELAXATION,
            eps_abs=tolerance,
            eps_rel=tolerance,
            max_iter=most,
            check_termination=CHECK_INTERVAL,
            scaling=0,
            check_dualgap=False,
            warm_starting=True,
            verbose=False,
        )
        try:
            self._osqp = _EXTENSION.OSQPSolver(
                _EXTENSION.CSC(self._pattern.cost_matrix(values.cost)),
                values.gradient,
                _EXTENSION.CSC(self._pattern.constraint_matrix(values.constraints)),
                *self._bounds,
                rows,
                columns,
                self._osqp_settings,
            )
        except ValueError as error:
            return self._refused(str(error))
        return ""

    def _set(self, **settings: float) -> None:
        """Change OSQP's settings, by name; before its set-up they are what it is set up with."""
        for name, value in settings.items():
            setattr(self._osqp_settings, name, value)
        if self._osqp is not None:
            self._osqp.update_settings(self._osqp_settings)

    def _refused(self, error: int | str) -> str:
        """The word for what OSQP answered; it is set up anew with the next numbers."""
        self._osqp = None
        return f"refused by OSQP, error {error}"

    def nothing(self, status: str, iterations: int = 0, seconds: float = 0.0) -> QpSolution:
        """The result of a QP that was not solved, with the word for why."""
        rows, columns = self._pattern.shape
        none = np.zeros(columns), np.zeros(rows)
        return QpSolution(False, *none, status, iterations, False, (np.inf, np.inf), None, seconds)


@kernel
def _taken(lower: Array1, upper: Array1, infinity: float, low: Out1, high: Out1) -> bool:
    """Bounds (m,), infinite as OSQP writes it; whether all are numbers, no lower one is infinite, and none is
    above its upper one."""
    fit = True
    for i in range(len(lower)):
        fit &= lower[i] <= upper[i] and lower[i] < inf
        low[i], high[i] = max(lower[i], -infinity), min(upper[i], infinity)
    return fit
