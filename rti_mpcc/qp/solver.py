"""QPs are solved by OSQP, or where it does not finish by an interior point.

A QP with many rows at their bounds takes OSQP hundreds of iterations, or never ends. An interior point (PIQP)
takes ten to twenty whatever the rows do, each as long as eight of OSQP's. It knows no guess, so a QP near the
last one is OSQP's: that takes a tenth of the time (docs/decisions, 4).

It is OSQP's extension that is called: its Python class does not pass on what an update was answered. An
update that is refused leaves a problem that is neither the old one nor the new one, which OSQP then calls
solved. An unsolved QP may leave finite garbage behind, too. Only the status `GOOD` gives a solution, and only
of a problem that was taken whole.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import inf
from time import perf_counter
from typing import Any, NamedTuple, Self

import numpy as np
import osqp
import piqp
from scipy.sparse import csc_matrix

from geometry.compiled import Array1, Out1, kernel
from rti_mpcc.config import SolverSettings
from rti_mpcc.qp.filling import QpValues
from rti_mpcc.qp.pattern import QpPattern
from rti_mpcc.types import Array

GOOD = int(osqp.SolverStatus.OSQP_SOLVED)
"""Only this gives a solution: "solved inaccurate" is what a QP ends at that a limit has stopped."""
ITERATIONS = 54
"""Of OSQP, at most. A QP that it has not solved by then, one in a hundred, is one for the interior point."""
CHECK_INTERVAL = 6
"""Iterations between two termination checks."""
RHO = 3.0
"""OSQP's step-size parameter, which never changes: a solve depends on its QP and its guess alone."""
OVER_RELAXATION = 1.0
"""OSQP's alpha. Rows that are equalities or far from their bounds, most of them, settle by |1 - alpha| an
iteration: with OSQP's 1.6 that alone takes 20 iterations, with 1 a QP near its guess takes 3."""
ACCURACY = 1e-8
"""Of the residuals, absolute and relative. The last two iterations come from 1e-4 to this."""
MOST_INTERIOR_ITERATIONS = 40
"""Of 165 QPs that OSQP did not finish none took more than 26."""
INFEASIBILITY = 1e-12
"""Tolerance of PIQP's tests for QPs without a solution: with its own 1e-4 some that have one failed. Those of
the controller have one: walls give way by a slack, bounds on v and delta are widened."""

_EXTENSION: Any = osqp.OSQP().ext
_INFINITY = float(_EXTENSION.OSQP_INFTY)
"""What OSQP takes for infinite."""

SOLVED = "solved"
BAD_BOUNDS = "bounds that are no numbers, or a lower one above its upper one"

Ends = Callable[[int], str]
"""After so many iterations: "" to go on with a QP, or the word for what ends it."""


class Stop(NamedTuple):
    """What ended a QP from outside, not by its own numbers: the word for it, and the iterations by then."""

    status: str
    iterations: int


@dataclass(frozen=True, slots=True)
class QpSolution:
    """The result of a QP.

    Attributes:
        solved: it is optimal to the tolerance, and all numbers are finite; if not, `primal` and `dual` are 0.
        primal: (n,), dual: (m,), in scaled units.
        status: a word for the result; iterations: of OSQP, and of PIQP if it had to solve the QP.
        residuals: (primal, dual), scaled; infinite without a solution.
        seconds: of the solve.
        stopped: what ended the solve from outside, or None.
        interior_point: PIQP had to solve it.
    """

    solved: bool
    primal: Array
    dual: Array
    status: str
    iterations: int
    residuals: tuple[float, float] = (inf, inf)
    seconds: float = 0.0
    stopped: Stop | None = None
    interior_point: bool = False

    @classmethod
    def none(
        cls, pattern: QpPattern, status: str, spent: tuple[int, float] = (0, 0.0), stopped: Stop | None = None
    ) -> Self:
        """The result of a QP that was not solved: the word for why, iterations and seconds spent on it."""
        (rows, columns), (iterations, seconds) = pattern.shape, spent
        none = np.zeros(columns), np.zeros(rows)
        return cls(False, *none, status, iterations, seconds=seconds, stopped=stopped)


def solve_once(
    cost: Array, gradient: Array, constraints: Array, bounds: tuple[Array, Array], *, accuracy: float,
    iterations: int,
) -> Array | None:  # fmt: skip
    """The solution (n,) of min x'Px/2 + q'x, l <= Ax <= u, a QP that is not solved again, or None.

    Args:
        cost, gradient, constraints, bounds: P (n, n), q (n,), A (m, n), l and u (m,), with numbers of about
            1: nothing is scaled.
        accuracy: absolute and relative, of the residuals; iterations: at most.

    Raises ValueError for numbers that are none, or a lower bound above its upper one.
    """
    lower, upper = bounds
    finite = all(np.isfinite(each).all() for each in (cost, gradient, constraints))
    if not finite or not (lower <= upper).all():
        raise ValueError(BAD_BOUNDS)
    solver = osqp.OSQP()
    solver.setup(
        csc_matrix(np.triu(cost)), gradient, csc_matrix(constraints), lower, upper,
        verbose=False, scaling=0, rho=1.0, eps_abs=accuracy, eps_rel=accuracy, max_iter=iterations,
        check_termination=10,
    )  # fmt: skip
    answer = solver.solve(raise_error=False)
    return np.asarray(answer.x) if np.isfinite(answer.x).all() else None


class QpSolver:
    """Solves QPs of one pattern: by OSQP, which is quick near its guess, else by an interior point."""

    def __init__(self, pattern: QpPattern, settings: SolverSettings) -> None:
        self._pattern = pattern
        self._tolerance = settings.tolerance
        self._osqp: Any = None
        rows, _ = pattern.shape
        self._bounds = (np.empty(rows), np.empty(rows))

    def __getstate__(self) -> dict[str, Any]:
        """All but OSQP's memory, which cannot be copied: a copy sets it up with its first QP."""
        return {**self.__dict__, "_osqp": None}

    def update(self, values: QpValues) -> str:
        """Preparation: hand over all but the bounds (factorises). Returns "" or why that was refused.

        After numbers that OSQP refuses it is set up anew with the next ones.
        """
        for name in ("cost", "gradient", "constraints"):
            if not np.isfinite(getattr(values, name)).all():
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
            ends: asked before OSQP, and before the interior point.
        """
        pattern = self._pattern
        if self._osqp is None:
            return QpSolution.none(pattern, "not prepared")
        lower, upper = self._bounds
        if not _taken(values.lower, values.upper, _INFINITY, lower, upper):
            return QpSolution.none(pattern, BAD_BOUNDS)
        if ends is not None and (word := ends(0)):
            return QpSolution.none(pattern, word, stopped=Stop(word, 0))
        error = self._osqp.update_data_vec(q=None, l=lower, u=upper)
        error = error or self._osqp.warm_start(primal, dual) or int(self._osqp.solve())
        if error:  # OSQP's solution is an old one
            return QpSolution.none(pattern, self._refused(error))
        info, found = self._osqp.info, self._osqp.solution
        iterations, seconds = int(info.iter), float(info.run_time)
        primal, dual = np.array(found.x), np.array(found.y)
        if info.status_val == GOOD and np.isfinite(primal).all() and np.isfinite(dual).all():
            residuals = float(info.prim_res), float(info.dual_res)
            return QpSolution(True, primal, dual, SOLVED, iterations, residuals, seconds)
        if ends is not None and (word := ends(iterations)):
            return QpSolution.none(pattern, word, (iterations, seconds), Stop(word, iterations))
        exact = solve_by_interior_point(pattern, values)
        iterations, seconds = iterations + exact.iterations, seconds + exact.seconds
        return replace(exact, interior_point=True, iterations=iterations, seconds=seconds)

    def _set_up(self, values: QpValues) -> str:
        if not _taken(values.lower, values.upper, _INFINITY, *self._bounds):
            return BAD_BOUNDS
        settings, (rows, columns) = _EXTENSION.OSQPSettings(), self._pattern.shape
        _EXTENSION.osqp_set_default_settings(settings)
        chosen = {
            "rho": RHO,
            "adaptive_rho": False,
            "alpha": OVER_RELAXATION,
            "eps_abs": self._tolerance,
            "eps_rel": self._tolerance,
            "max_iter": ITERATIONS,
            "check_termination": CHECK_INTERVAL,
            "scaling": 0,
            "check_dualgap": False,
            "warm_starting": True,
            "verbose": False,
        }
        for name, value in chosen.items():
            setattr(settings, name, value)
        try:
            self._osqp = _EXTENSION.OSQPSolver(
                _EXTENSION.CSC(self._pattern.cost_matrix(values.cost)),
                values.gradient,
                _EXTENSION.CSC(self._pattern.constraint_matrix(values.constraints)),
                *self._bounds,
                rows,
                columns,
                settings,
            )
        except ValueError as error:
            return self._refused(str(error))
        return ""

    def _refused(self, error: int | str) -> str:
        """The word for what OSQP answered; it is set up anew with the next numbers."""
        self._osqp = None
        return f"refused by OSQP, error {error}"


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
    settings.max_iter = MOST_INTERIOR_ITERATIONS
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
        return QpSolution.none(pattern, f"interior point: {word}", (iterations, seconds))
    residuals = float(found.info.primal_res), float(found.info.dual_res)
    return QpSolution(True, primal, dual, SOLVED, iterations, residuals, seconds)


@kernel
def _taken(lower: Array1, upper: Array1, infinity: float, low: Out1, high: Out1) -> bool:
    """Bounds (m,), infinite as OSQP writes it; whether all are numbers, no lower one is infinite, and none is
    above its upper one."""
    fit = True
    for i in range(len(lower)):
        fit &= lower[i] <= upper[i] and lower[i] < inf
        low[i], high[i] = max(lower[i], -infinity), min(upper[i], infinity)
    return fit
