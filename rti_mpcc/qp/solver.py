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
from rti_mpcc.qp.filling import ROW_SCALING_MOST, QpValues
from rti_mpcc.qp.pattern import QpPattern
from rti_mpcc.types import Array

GOOD = frozenset({int(osqp.SolverStatus.OSQP_SOLVED)})
"""Only these give a solution: "solved inaccurate" is what a QP ends at that a limit has stopped."""

SOLVED = "solved"
AT_LIMIT = "maximum iterations reached"
"""OSQP's words for that, and for a QP that has had all the iterations that it may have."""
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
"""Tolerance of the first iterations of a QP that goes on from the one before: a shape that costs little
changes by little from cycle to cycle, and never comes to its best where that is within the tolerance. What is
not that good by then has to reach `SolverSettings.tolerance`."""
SLICE_ITERATIONS = 48
"""So many are done in one go, then the step size is adapted, and it is asked whether to go on. OSQP's own
time limit stops anywhere, which could not be played back."""
LOST_AFTER = FINE_ITERATIONS + SLICE_ITERATIONS
"""A QP that is not solved by then does not get there from the one before it: it starts again, by `LOST`.
One in a hundred comes here (docs/decisions, 4). Plans without a free end, those of the paper, keep to their
guess, and so does a QP with more patience: its vehicle is far outside, and its multipliers are as large as
the slack's weight."""
CHECK_INTERVAL = 6
"""Iterations between two termination checks."""


class Steps(NamedTuple):
    """How OSQP steps.

    Attributes:
        rho: its first step-size parameter, which it adapts; over_relaxation: its alpha.
        fine: it is to come to the fine tolerance in its first iterations.
        row_scaling: how much less bounds that are far off count at most, see `qp.filling.ROW_SCALING_FROM`.
        scaling: passes of OSQP's own scaling of rows and columns.
    """

    rho: float
    over_relaxation: float
    fine: bool = False
    row_scaling: float = 1.0
    scaling: int = 0


WARM = Steps(rho=3.0, over_relaxation=1.0, fine=True, row_scaling=ROW_SCALING_MOST)
"""Where a QP goes on from the one before. Rows that are equalities or far from their bounds, most of them,
settle by |1 - over-relaxation| an iteration: with OSQP's 1.6 that alone takes 20 iterations, with 1 a QP near
its guess takes 3. Few take so many that OSQP adapts rho, and with its 0.1 bounds were kept no more exactly
than to the tolerance (docs/decisions, 4)."""
COLD = Steps(rho=1.0, over_relaxation=1.6)
"""From a first guess, where rows come to act that are far from it: there may be hundreds of iterations to do,
the fewest with a larger first step."""
LOST = COLD._replace(scaling=2)
"""Where a QP starts again: set up anew, in 1.4 ms. The QP's units suit stages of a second; in a ride of a
minute and a half some last 5 s, and OSQP finds no step size for all of them (docs/decisions, 11)."""

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
        solved: whether the status is good and all numbers are finite; if not, `primal` and `dual` are 0, or
            how far a QP had come that was stopped.
        primal: (n,), dual: (m,), in scaled units.
        status, iterations: of OSQP; residuals: its (primal, dual), scaled; infinite without a solution.
        stopped: what ended the solve from outside, or None.
        seconds: of the solve.
    """

    solved: bool
    primal: Array
    dual: Array
    status: str
    iterations: int
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
    """Holds one OSQP problem of fixed pattern; `polish`: for reference solutions."""

    def __init__(self, pattern: QpPattern, settings: SolverSettings, *, polish: bool = False) -> None:
        self._pattern = pattern
        self._settings = settings
        self._polish = polish
        self._osqp: Any = None
        self._osqp_settings: Any = None
        self._keeps = False  # something of a QP that it has begun: an iterate, or an adapted step size
        self._steps = COLD
        rows, _ = pattern.shape
        self._bounds = (np.empty(rows), np.empty(rows))

    def __getstate__(self) -> dict[str, Any]:
        """All but OSQP's memory, which cannot be copied: a copy sets it up with its first QP."""
        return {**self.__dict__, "_osqp": None, "_osqp_settings": None, "_keeps": False}

    def update(self, values: QpValues, steps: Steps = COLD) -> str:
        """Preparation: hand over all but the bounds (factorises). Returns "" or why that was refused.

        After numbers that OSQP refuses it is set up anew with the next ones. Other `steps` than the last ones
        begin with their own step-size parameter.
        """
        if steps != self._steps:
            self._steps = steps
            if self._osqp is not None:
                self._step_by(steps)
        for name in ("cost", "gradient", "constraints"):
            if not all_finite(getattr(values, name)):
                return f"{name} not finite"
        if self._osqp is None or self._osqp_settings.scaling != steps.scaling:
            return self._set_up(values, steps)
        error = self._osqp.update_data_vec(q=values.gradient, l=None, u=None)
        error = error or self._osqp.update_data_mat(
            P_x=values.cost, P_i=None, A_x=values.constraints, A_i=None
        )
        return self._refused(error) if error else ""

    def solve(
        self, values: QpValues, primal: Array, dual: Array, ends: Ends | None = None, patience: int = 1
    ) -> QpSolution:
        """Feedback: hand over the bounds only and solve from a guess.

        Args:
            values: as in the last `update`, but for its bounds.
            primal: (n,), dual: (m,) guess in scaled units.
            ends: asked before each slice of iterations.
            patience: how many times the configured iterations it may take.
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
        self._keeps = True
        settings, done, seconds = self._settings, 0, 0.0
        allowed = patience * settings.max_iterations
        while True:
            word = ends(done) if ends is not None else ""
            if word:
                nothing = self.nothing(word, iterations=done, seconds=seconds)
                return replace(nothing, primal=primal, dual=dual, stopped=Stop(word, done))
            first = self._steps.fine and done == 0
            most = min(FINE_ITERATIONS if first else SLICE_ITERATIONS, allowed - done)
            tolerance = min(FINE_TOLERANCE, settings.tolerance) if first else settings.tolerance
            if (most, tolerance) != (self._osqp_settings.max_iter, self._osqp_settings.eps_abs):
                self._set(max_iter=most, eps_abs=tolerance, eps_rel=tolerance)
            error = int(self._osqp.solve())
            if error:  # OSQP's solution is an old one
                return self.nothing(self._refused(error), iterations=done, seconds=seconds)
            info, solution = self._osqp.info, self._osqp.solution
            primal, dual = np.array(solution.x), np.array(solution.y)
            done += int(info.iter)
            seconds += float(info.run_time)
            finite = all_finite(primal) and all_finite(dual)
            solved = info.status_val in GOOD
            # What the first slice leaves unfinished may be good already: OSQP was asked for more.
            solved |= first and max(info.prim_res, info.dual_res) <= settings.tolerance
            if solved or info.status_val not in UNFINISHED or not finite or done >= allowed:
                break
            lost = self._steps.fine and patience == 1 and done == LOST_AFTER
            if lost and len(self._pattern.time_column) and (refused := self._set_up(values, LOST)):
                return self.nothing(refused, iterations=done, seconds=seconds)
        if not solved or not finite:
            self.forget()
            status = AT_LIMIT if done >= allowed else str(info.status)
            return self.nothing(status, iterations=done, seconds=seconds)
        residuals = float(info.prim_res), float(info.dual_res)
        return QpSolution(True, primal, dual, SOLVED, done, residuals, None, seconds)

    def forget(self) -> None:
        """Begin afresh: no guess, and the first step-size parameter instead of the last adapted one."""
        if self._osqp is not None and self._keeps:
            rows, columns = self._pattern.shape
            self._osqp.warm_start(np.zeros(columns), np.zeros(rows))
            self._step_by(self._steps)
            self._keeps = False

    def _step_by(self, steps: Steps) -> None:
        self._set(alpha=steps.over_relaxation)
        if self._osqp.update_rho(steps.rho):
            self._osqp = None

    def _set_up(self, values: QpValues, steps: Steps) -> str:
        if not _taken(values.lower, values.upper, _INFINITY, *self._bounds):
            return BAD_BOUNDS
        settings, (rows, columns) = self._settings, self._pattern.shape
        self._osqp = None
        self._osqp_settings = _EXTENSION.OSQPSettings()
        _EXTENSION.osqp_set_default_settings(self._osqp_settings)
        self._set(
            rho=steps.rho,
            alpha=steps.over_relaxation,
            adaptive_rho_interval=SLICE_ITERATIONS,
            eps_abs=settings.tolerance,
            eps_rel=settings.tolerance,
            max_iter=SLICE_ITERATIONS,
            check_termination=CHECK_INTERVAL,
            polishing=self._polish,
            scaling=steps.scaling,
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
        self._keeps = False
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

    def nothing(self, status: str, *, iterations: int = 0, seconds: float = 0.0) -> QpSolution:
        """The result of a QP that was not solved, with the word for why."""
        rows, columns = self._pattern.shape
        none = np.zeros(columns), np.zeros(rows)
        return QpSolution(False, *none, status, iterations, (np.inf, np.inf), None, seconds)


@kernel
def _taken(lower: Array1, upper: Array1, infinity: float, low: Out1, high: Out1) -> bool:
    """Bounds (m,), infinite as OSQP writes it; whether all are numbers, no lower one is infinite, and none is
    above its upper one."""
    fit = True
    for i in range(len(lower)):
        fit &= lower[i] <= upper[i] and lower[i] < inf
        low[i], high[i] = max(lower[i], -infinity), min(upper[i], infinity)
    return fit
