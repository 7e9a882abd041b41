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


@dataclass(frozen=True, slots=True, kw_only=True)
class QpSolution:
    """The result of a QP.

    Attributes:
        solved: it is optimal to the tolerance, and all numbers are finite; if not, `primal` and `dual` are 0.
        primal: (n,), dual: (m,), in scaled units.
        status: a word for the result; iterations: of OSQP, and of PIQP if it had to solve the QP.
        interior_point: PIQP had to; residuals: (primal, dual), scaled; infinite without a solution.
        stopped: what ended the solve from outside, or None.
        seconds: of the solve.
    """

    solved: bool
    primal: Array
    dual: Array
    status: str
    iterations: int
    interior_point: bool = False
    residuals: tuple[float, float] = (inf, inf)
    stopped: Stop | None = None
    seconds: float = 0.0

    @classmethod
    def none(cls, pattern: QpPattern, status: str, iterations: int = 0, seconds: float = 0.0) -> Self:
        """The result of a QP that was not solved, with the word for why."""
        rows, columns = pattern.shape
        return cls(
            solved=False,
            primal=np.zeros(columns),
            dual=np.zeros(rows),
            status=status,
            iterations=iterations,
            seconds=seconds,
        )
