"""A QP as a value, for study off line."""

from __future__ import annotations

from dataclasses import dataclass

from scipy.sparse import csc_matrix

from rti_mpcc.qp.filling import QpValues
from rti_mpcc.qp.pattern import QpPattern
from rti_mpcc.types import Array


@dataclass(frozen=True, slots=True, kw_only=True)
class QpProblem:
    """One QP in scaled units: min x'Px/2 + q'x, lower <= Ax <= upper, and the guess it was begun from.

    Attributes:
        cost: P (n, n), upper triangle, CSC; gradient: q (n,).
        constraints: A (m, n), CSC; lower, upper: (m,).
        primal: (n,), dual: (m,) guess.
    """

    cost: csc_matrix
    gradient: Array
    constraints: csc_matrix
    lower: Array
    upper: Array
    primal: Array
    dual: Array


def problem_of(pattern: QpPattern, values: QpValues, primal: Array, dual: Array) -> QpProblem:
    """Copies of the numbers as they are now, in the matrices of the pattern, with a guess (n,), (m,)."""
    return QpProblem(
        cost=pattern.cost.matrix(values.cost.copy()),
        gradient=values.gradient.copy(),
        constraints=pattern.constraints.matrix(values.constraints.copy()),
        lower=values.lower.copy(),
        upper=values.upper.copy(),
        primal=primal,
        dual=dual,
    )
