"""The yardstick: how long this machine takes, now, for a fixed set of QPs with a fixed solver.

The set (`qps.npz`, 39 QPs of a prototype of this controller) and the solver (PIQP's sparse multistage KKT
solver to 1e-6) never change, so that a time as a multiple of the yardstick means the same on another machine.
OSQP with its default settings is measured beside it. What counts is `solve()`; the set-up is apart.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
import osqp
import piqp
from numpy.typing import NDArray
from scipy import sparse

from rti_mpcc.types import Array

FILE = Path(__file__).with_name("qps.npz")
EQUALITIES = 426
"""So many rows of A come first and are equations."""
TOLERANCE = 1e-6
MULTISTAGE = piqp.KKTSolver.sparse_multistage
"""Fast where the variables come stage by stage, as in the fixed set."""
INFINITE = 1e19
"""Beyond this a bound is none."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Problem:
    """min x'Px/2 + q'x, lower <= Ax <= upper, with P's upper triangle; for OSQP, and split for PIQP."""

    cost: Any
    gradient: Array
    constraints: Any
    lower: Array
    upper: Array
    split: tuple[Any, ...]

    @classmethod
    def of(cls, cost: Any, gradient: Array, constraints: Any, lower: Array, upper: Array) -> Problem:
        """Rows with equal bounds are PIQP's equations, the others its inequalities."""
        full = (cost + sparse.triu(cost, 1).T).tocsc()
        low = np.where(lower < -INFINITE, -np.inf, lower)
        high = np.where(upper > INFINITE, np.inf, upper)
        equal: NDArray[np.bool_] = low == high
        rows = constraints.tocsr()
        equations, others = rows[equal].tocsc(), rows[~equal].tocsc()
        split = (full, gradient, equations, low[equal], others, low[~equal], high[~equal])
        return cls(
            cost=cost, gradient=gradient, constraints=constraints, lower=lower, upper=upper, split=split
        )


def fixed_set() -> list[Problem]:
    """The QPs of the yardstick. Raises ValueError where the file is not the set that it should be."""
    data = np.load(FILE)
    columns, (count, rows) = len(data["Pp"]) - 1, data["l"].shape
    problems = []
    for k in range(count):
        cost = sparse.csc_matrix((data["P"][k], data["Pi"], data["Pp"]), shape=(columns, columns))
        constraints = sparse.csc_matrix((data["A"][k], data["Ai"], data["Ap"]), shape=(rows, columns))
        problems.append(Problem.of(cost, data["q"][k], constraints, data["l"][k], data["u"][k]))
        equations = problems[-1].split[2].shape[0]
        if equations != EQUALITIES:
            raise ValueError(f"{FILE.name}: QP {k} has {equations} equations instead of {EQUALITIES}")
    return problems


def set_up(problem: Problem, tolerance: float = TOLERANCE, kkt_solver: Any = MULTISTAGE) -> Any:
    """PIQP with one problem. It warns of rows without bounds on stderr."""
    solver = piqp.SparseSolver()
    solver.settings.kkt_solver = kkt_solver
    solver.settings.eps_abs = solver.settings.eps_rel = tolerance
    solver.settings.verbose = False
    solver.setup(*problem.split)
    return solver


@contextmanager
def quiet() -> Iterator[None]:
    """Send what C++ code writes to stderr nowhere: not Python's `sys.stderr` but the descriptor itself."""
    sys.stderr.flush()
    kept, nowhere = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 2)
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nowhere)


@dataclass(slots=True, kw_only=True)
class Yardstick:
    """Collects times of the fixed set; `measure` is called now and then between the rounds of a benchmark.

    Attributes:
        solve_ms, setup_ms: of PIQP, a list a call.
        osqp_solve_ms, osqp_iterations: of OSQP with default settings, which gets each problem by an update.
    """

    problems: list[Problem]
    solve_ms: list[list[float]] = field(default_factory=list)
    setup_ms: list[list[float]] = field(default_factory=list)
    osqp_solve_ms: list[float] = field(default_factory=list)
    osqp_iterations: list[int] = field(default_factory=list)
    _osqp: Any = None

    def measure(self, *, osqp_too: bool = False) -> None:
        """Once through the set."""
        self.solve_ms.append([])
        self.setup_ms.append([])
        with quiet():
            for problem in self.problems:
                self._piqp(problem)
        for problem in self.problems if osqp_too else ():
            self._default_osqp(problem)

    @property
    def p50(self) -> float:
        """The yardstick: median time of a solve [ms]."""
        return float(np.median(np.concatenate(self.solve_ms)))

    @property
    def steadiness(self) -> tuple[float, float]:
        """Smallest and largest median of a single call [ms]: how evenly the machine ran."""
        medians = [float(np.median(block)) for block in self.solve_ms]
        return min(medians), max(medians)

    def _piqp(self, problem: Problem) -> None:
        begun = perf_counter()
        solver = set_up(problem)
        ready = perf_counter()
        status = solver.solve()
        done = perf_counter()
        if status != piqp.PIQP_SOLVED:
            raise RuntimeError(f"PIQP did not solve a QP of the fixed set: {status}")
        self.setup_ms[-1].append(1e3 * (ready - begun))
        self.solve_ms[-1].append(1e3 * (done - ready))

    def _default_osqp(self, problem: Problem) -> None:
        numbers = {"q": problem.gradient, "l": problem.lower, "u": problem.upper}
        if self._osqp is None:
            self._osqp = osqp.OSQP()
            self._osqp.setup(P=problem.cost, A=problem.constraints, verbose=False, **numbers)
        self._osqp.update(Px=problem.cost.data.copy(), Ax=problem.constraints.data.copy(), **numbers)
        begun = perf_counter()
        result = self._osqp.solve(raise_error=False)
        self.osqp_solve_ms.append(1e3 * (perf_counter() - begun))
        self.osqp_iterations.append(int(result.info.iter))
