"""The one door to OSQP.

What OSQP does not tell is checked here: it keeps the old problem when an update is refused, and an
unsolved QP may leave finite garbage behind. Only a status on the list of good ones gives a solution.
"""

from __future__ import annotations

from dataclasses import dataclass
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np
import osqp

from rti_mpcc.config import SolverSettings
from rti_mpcc.qp.filling import QpValues
from rti_mpcc.qp.pattern import QpPattern
from rti_mpcc.types import Array

GOOD = frozenset({int(osqp.SolverStatus.OSQP_SOLVED)})
"""Only these give a solution: "solved inaccurate" is what a QP ends at that a limit has stopped."""

UNFINISHED = frozenset(
    {
        int(osqp.SolverStatus.OSQP_TIME_LIMIT_REACHED),
        int(osqp.SolverStatus.OSQP_SOLVED_INACCURATE),
        int(osqp.SolverStatus.OSQP_PRIMAL_INFEASIBLE_INACCURATE),
        int(osqp.SolverStatus.OSQP_DUAL_INFEASIBLE_INACCURATE),
    }
)
"""What a QP may be called that was ended by a limit; `_cut_short` knows the other sign of it."""
OUT_OF_TIME = "run time limit reached"

RHO = 0.1
"""First step-size parameter; OSQP adapts it."""
NO_LIMIT = 1e10
"""OSQP's own time limit [s]."""


class Stop(NamedTuple):
    """What ended a QP from outside, not by its own numbers: the word for it, and the iterations by then."""

    status: str
    iterations: int


@dataclass(frozen=True, slots=True, kw_only=True)
class QpSolution:
    """What a solve gave.

    Attributes:
        solved: whether the status is good and all numbers are finite; if not, `primal` and `dual` are 0.
        primal: (n,), dual: (m,), in scaled units.
        status: OSQP's word.
        iterations: of OSQP.
        refactorisations: by adaptive rho within the solve.
        residuals: (primal, dual) of OSQP, scaled; infinite where there is no solution.
        stopped: what ended the solve from outside, or None.
        seconds: of the solve.
    """

    solved: bool
    primal: Array
    dual: Array
    status: str
    iterations: int
    refactorisations: int
    residuals: tuple[float, float]
    stopped: Stop | None
    seconds: float


class QpSolver:
    """Holds one OSQP problem of fixed pattern."""

    def __init__(self, pattern: QpPattern, settings: SolverSettings) -> None:
        self._pattern = pattern
        self._settings = settings
        self._osqp: Any = None
        self._patience = 1
        self._limited = False
        self._updating = 0.0

    def update(self, values: QpValues) -> str:
        """Preparation: hand over all numbers (factorises). Returns "" or why they were refused."""
        problem = self._complaint(values)
        if problem:
            return problem
        begun = perf_counter()
        if self._osqp is None:
            self._set_up(values)
        else:
            self._osqp.update(
                Px=values.cost.copy(),
                Ax=values.constraints.copy(),
                q=values.gradient,
                l=values.lower,
                u=values.upper,
            )
        self._updating += perf_counter() - begun
        return ""

    def solve(
        self,
        values: QpValues,
        primal: Array,
        dual: Array,
        time_limit: float | None = None,
        stopped: Stop | None = None,
    ) -> QpSolution:
        """Feedback: hand over the bounds only and solve from a guess.

        Args:
            values: as in the last `update`, but for its bounds.
            primal: (n,), dual: (m,) guess in scaled units.
            time_limit: [s].
            stopped: the QP is not solved, but taken as ended by this.
        """
        if stopped is not None:
            self.forget()
            return self.nothing(stopped.status, iterations=stopped.iterations, stopped=stopped)
        if self._osqp is None:
            return self.nothing("not prepared")
        if not (np.isfinite(values.lower) | np.isneginf(values.lower)).all() or not _ordered(values):
            return self.nothing("bounds refused")
        self._osqp.update(l=values.lower, u=values.upper)
        self._osqp.warm_start(x=primal, y=dual)
        self._limit(time_limit)
        result = self._osqp.solve(raise_error=False)
        self._updating = 0.0
        info = result.info
        cut = self._cut_short(int(info.status_val), int(info.iter))
        good = info.status_val in GOOD and np.isfinite(result.x).all() and np.isfinite(result.y).all()
        if cut or not good:
            self.forget()
            status, iterations = OUT_OF_TIME if cut and good else str(info.status), int(info.iter)
            return self.nothing(
                status,
                iterations=iterations,
                seconds=float(info.run_time),
                stopped=Stop(status, iterations) if cut else None,
            )
        return QpSolution(
            solved=True,
            primal=np.array(result.x),
            dual=np.array(result.y),
            status=str(info.status),
            iterations=int(info.iter),
            refactorisations=int(info.rho_updates),
            residuals=(float(info.prim_res), float(info.dual_res)),
            stopped=None,
            seconds=float(info.run_time),
        )

    def allow(self, patience: int) -> None:
        """From now on a QP may take `patience` times the configured iterations."""
        if self._osqp is not None and patience != self._patience:
            self._osqp.update_settings(max_iter=patience * self._settings.max_iterations)
            self._patience = patience

    def forget(self) -> None:
        """Begin afresh: no guess, and the first step-size parameter instead of the last adapted one."""
        if self._osqp is not None:
            rows, columns = self._pattern.constraints.shape
            self._osqp.warm_start(x=np.zeros(columns), y=np.zeros(rows))
            self._osqp.update_settings(rho=RHO)

    def _limit(self, seconds: float | None) -> None:
        """Set OSQP's time limit, which counts its set-up and its updates since the last solve."""
        if seconds is None and not self._limited:
            return
        limit = NO_LIMIT if seconds is None else max(seconds, 1e-5) + self._updating
        self._osqp.update_settings(time_limit=limit)
        self._limited = seconds is not None

    def _cut_short(self, status: int, iterations: int) -> bool:
        """Whether the clock has ended a solve.

        At its time limit OSQP looks once more at what it has, and may find the QP just solved. Left alone it
        would have gone on to its next regular check and another solution: a replay, without a clock, would
        not find the same.
        """
        if not self._limited or iterations >= self._patience * self._settings.max_iterations:
            return False
        regular = iterations > 0 and iterations % self._settings.check_interval == 0
        return status in UNFINISHED or not regular

    def _set_up(self, values: QpValues) -> None:
        settings = self._settings
        self._osqp = osqp.OSQP()
        self._osqp.setup(
            P=self._pattern.cost.matrix(values.cost.copy()),
            q=values.gradient.copy(),
            A=self._pattern.constraints.matrix(values.constraints.copy()),
            l=values.lower.copy(),
            u=values.upper.copy(),
            rho=RHO,
            eps_abs=settings.tolerance,
            eps_rel=settings.tolerance,
            max_iter=settings.max_iterations,
            check_termination=settings.check_interval,
            polishing=settings.polish,
            scaling=0,
            check_dualgap=False,
            warm_starting=True,
            verbose=False,
        )

    def _complaint(self, values: QpValues) -> str:
        rows, columns = self._pattern.constraints.shape
        if values.gradient.shape != (columns,) or values.lower.shape != (rows,):
            return "lengths do not fit the pattern"
        for name in ("cost", "gradient", "constraints"):
            if not np.isfinite(getattr(values, name)).all():
                return f"{name} not finite"
        if np.isnan(values.lower).any() or np.isnan(values.upper).any():
            return "bounds not a number"
        return "" if _ordered(values) else "a lower bound above its upper bound"

    def nothing(
        self, status: str, *, iterations: int = 0, seconds: float = 0.0, stopped: Stop | None = None
    ) -> QpSolution:
        """The result of a QP that was not solved, with the word for why."""
        rows, columns = self._pattern.constraints.shape
        return QpSolution(
            solved=False,
            primal=np.zeros(columns),
            dual=np.zeros(rows),
            status=status,
            iterations=iterations,
            refactorisations=0,
            residuals=(np.inf, np.inf),
            stopped=stopped,
            seconds=seconds,
        )


def _ordered(values: QpValues) -> bool:
    return bool((values.lower <= values.upper).all())
