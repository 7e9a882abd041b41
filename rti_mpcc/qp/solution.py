"""What a solver gives back of a QP."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import NamedTuple, Self

import numpy as np

from rti_mpcc.qp.pattern import QpPattern
from rti_mpcc.types import Array

SOLVED = "solved"


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
        cls,
        pattern: QpPattern,
        status: str,
        iterations: int = 0,
        seconds: float = 0.0,
        *,
        stopped: bool = False,
    ) -> Self:
        """The result of a QP that was not solved, with the word for why; `stopped`: that ended it."""
        rows, columns = pattern.shape
        stop = Stop(status, iterations) if stopped else None
        none = np.zeros(columns), np.zeros(rows)
        return cls(False, *none, status, iterations, seconds=seconds, stopped=stop)
