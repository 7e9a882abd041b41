"""Fixed sparsity pattern of the QP, with a named group of slots for everything that is written.

Variables are the changes of states dz_0..dz_N and controls du_0..du_{N-1} about a trajectory, and
one corridor slack per stage 1..N:

    minimise   1/2 w' P w + q' w     subject to   l <= A w <= u

Rows, in this order:
    dynamics   dz_0 = measured - linearised;  F_z dz_k + F_u du_k - dz_{k+1} = z_{k+1} - F(z_k, u_k)
    states     bounds on v, delta, theta of stages 1..N
    controls   bounds on a, delta_dot, theta_dot
    corridor   half-planes of every piece of stages 1..N (ocp/corridor_rows.py, Eq. H2)
    slack      >= 0

Everything is in scaled units: a variable counts in its `UNITS`, a row in the unit of what it bounds,
so OSQP's own scaling (a pass over the matrices each cycle) can stay off.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy import sparse

from rti_mpcc.model.layout import CONTROLS, DELTA, DELTA_DOT, PHI, STATES, THETA, A, V, X, Y
from rti_mpcc.types import Array, Index

# Kernels read these (geometry.compiled).
STATE_UNITS = np.array([1.0, 1.0, 0.3, 1.0, 0.3, 1.0])
"""What one scaled unit of x, y, phi, v, delta, theta is."""
CONTROL_UNITS = np.array([0.5, 0.5, 1.0])
"""What one scaled unit of a, delta_dot, theta_dot is."""
SLACK_UNIT = 0.1
"""What one scaled unit of slack is [m]."""

BOUND_UNIT = 10.0
"""Bounds on states and controls count in so many of these units. Each row drags on the solver's steps like a
proximal term, active or not; with small rows those that are far from active hardly do, which makes the
difference between 400 and 50 iterations (docs/decisions, 4)."""

BOUNDED = np.array([V, DELTA, THETA])
"""States with bounds, in the order of their rows."""

HESSIAN_PAIRS = np.array(
    [
        *((X, X), (X, Y), (Y, Y), (PHI, PHI), (X, V), (Y, V), (V, V), (V, DELTA), (DELTA, DELTA)),
        *((X, THETA), (Y, THETA), (PHI, THETA), (THETA, THETA)),
    ]
)
"""Entries of a stage's Hessian that can differ from 0 (row <= column)."""
KEPT = np.array([X, Y, V, DELTA, THETA])
"""States that a stage hands on with slope 1 whatever it is linearised about."""
DRIVEN = np.array([V, DELTA, THETA])
"""States that the controls change at the rate 1."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Slots:
    """A sparse matrix in CSC form whose entries are written group by group.

    Attributes:
        shape: (rows, columns).
        indices, indptr: CSC pattern.
        groups: name -> positions in the CSC data, in the shape in which the group is written.
        scales: name -> factor from physical to scaled units, same shape.
        constant: (nnz,) data with the entries that never change filled in, 0 elsewhere.
    """

    shape: tuple[int, int]
    indices: Index
    indptr: Index
    groups: dict[str, Index]
    scales: dict[str, Array]
    constant: Array

    def matrix(self, data: Array) -> sparse.csc_matrix:
        """The matrix with `data` (nnz,), explicit zeros kept."""
        return sparse.csc_matrix((data, self.indices, self.indptr), shape=self.shape)


class _SlotsBuilder:
    """Collects groups of entries and orders them into CSC form."""

    def __init__(self, row_units: Array, column_units: Array, *, hessian: bool = False) -> None:
        self._row_units, self._column_units, self._hessian = row_units, column_units, hessian
        self._rows: list[Index] = []
        self._columns: list[Index] = []
        self._values: list[Array] = []
        self._shapes: dict[str, tuple[int, ...]] = {}

    def add(self, name: str, rows: Index, columns: Index, value: float = 0.0) -> None:
        rows, columns = np.broadcast_arrays(rows, columns)
        self._shapes[name] = rows.shape
        self._rows.append(rows.ravel())
        self._columns.append(columns.ravel())
        self._values.append(np.full(rows.size, value))

    def build(self) -> Slots:
        rows, columns = np.concatenate(self._rows), np.concatenate(self._columns)
        row_scale = self._row_units if self._hessian else 1.0 / self._row_units
        scale = row_scale[rows] * self._column_units[columns]
        order = np.lexsort((rows, columns))
        position = np.empty_like(order)
        position[order] = np.arange(len(order))
        counts = np.bincount(columns, minlength=len(self._column_units))
        groups, scales, begin = {}, {}, 0
        for name, shape in self._shapes.items():
            size = int(np.prod(shape))
            groups[name] = position[begin : begin + size].reshape(shape)
            scales[name] = scale[begin : begin + size].reshape(shape)
            begin += size
        return Slots(
            shape=(len(self._row_units), len(self._column_units)),
            indices=rows[order],
            indptr=np.concatenate([[0], np.cumsum(counts)]),
            groups=groups,
            scales=scales,
            constant=(np.concatenate(self._values) * scale)[order],
        )


class Columns(NamedTuple):
    """A vector over the variables, block by block: states (N+1, 6), controls (N, 3), slack (N,)."""

    states: Array
    controls: Array
    slack: Array


class Rows(NamedTuple):
    """A vector over the constraints, block by block: initial (6,), dynamics (N, 6), bounds (2, N, 3) on
    states and controls, corridor (N, pieces, sides), slack (N,)."""

    initial: Array
    dynamics: Array
    bounds: Array
    corridor: Array
    slack: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class QpPattern:
    """Where everything stands in the QP.

    Attributes:
        state_columns (N+1, 6), control_columns (N, 3), slack_columns (N,): variables.
        dynamics_rows (N+1, 6), bound_rows (2, N, 3) of states and controls, corridor_rows (N, pieces, sides),
            slack_rows (N,): constraints.
        column_units: what one scaled unit is; bound_units: (2, 3) the same of bounds on states and controls.
        cost, constraints: the slots of P (upper triangle) and A.
    """

    state_columns: Index
    control_columns: Index
    slack_columns: Index
    dynamics_rows: Index
    bound_rows: Index
    corridor_rows: Index
    slack_rows: Index
    column_units: Array
    bound_units: Array
    cost: Slots
    constraints: Slots

    def columns(self, vector: Array) -> Columns:
        """The blocks of a vector (n,) over the variables, as views."""
        blocks = self.state_columns, self.control_columns, self.slack_columns
        return Columns(*(block(vector, each) for each in blocks))

    def rows(self, vector: Array) -> Rows:
        """The blocks of a vector (m,) over the constraints, as views."""
        blocks = self.dynamics_rows[0], self.dynamics_rows[1:], self.bound_rows, self.corridor_rows
        return Rows(*(block(vector, each) for each in (*blocks, self.slack_rows)))


def build_pattern(stages: int, pieces: int, sides: int) -> QpPattern:
    """The pattern for N stages and `sides` half-planes on each of `pieces` pieces."""
    of_states, of_controls, of_sides = (stages + 1, STATES), (stages, CONTROLS), (stages, pieces, sides)
    (state_columns, control_columns, slack_columns), columns = _consecutive(of_states, of_controls, (stages,))
    (dynamics_rows, bound_rows, corridor_rows, slack_rows), rows = _consecutive(
        of_states, (2, *of_controls), of_sides, (stages,)
    )

    column_units = np.empty(columns)
    column_units[state_columns], column_units[control_columns] = STATE_UNITS, CONTROL_UNITS
    column_units[slack_columns] = SLACK_UNIT
    row_units = np.ones(rows)
    row_units[dynamics_rows], row_units[slack_rows] = STATE_UNITS, SLACK_UNIT
    row_units[bound_rows] = BOUND_UNIT * np.stack([STATE_UNITS[BOUNDED], CONTROL_UNITS])[:, None]

    cost = _SlotsBuilder(column_units, column_units, hessian=True)
    cost.add("states", state_columns[:, HESSIAN_PAIRS[:, 0]], state_columns[:, HESSIAN_PAIRS[:, 1]])
    cost.add("controls", control_columns, control_columns)
    cost.add("slacks", slack_columns, slack_columns)

    a = _SlotsBuilder(row_units, column_units)
    a.add("initial", dynamics_rows[0], state_columns[0], 1.0)
    a.add("same state", dynamics_rows[1:, KEPT], state_columns[:-1, KEPT], 1.0)
    a.add("next state", dynamics_rows[1:], state_columns[1:], -1.0)
    causes = np.hstack([state_columns[:-1, [PHI, V, DELTA]], control_columns[:, [A, DELTA_DOT]]])
    pose = dynamics_rows[1:, [X, Y, PHI]]
    a.add("pose", pose.repeat(causes.shape[1], axis=1), np.tile(causes, pose.shape[1]))
    a.add("driven", dynamics_rows[1:, DRIVEN], control_columns)
    bounded = np.stack([state_columns[1:, BOUNDED], control_columns])
    a.add("bounds", bound_rows, bounded, 1.0)
    pose_and_slack = np.hstack([state_columns[1:, [X, Y, PHI]], slack_columns[:, None]])
    a.add("half-planes", corridor_rows[..., None], pose_and_slack[:, None, None, :])
    a.add("slack bounds", slack_rows, slack_columns, 1.0)
    return QpPattern(
        state_columns=state_columns,
        control_columns=control_columns,
        slack_columns=slack_columns,
        dynamics_rows=dynamics_rows,
        bound_rows=bound_rows,
        corridor_rows=corridor_rows,
        slack_rows=slack_rows,
        column_units=column_units,
        bound_units=row_units[bound_rows[:, 0]],
        cost=cost.build(),
        constraints=a.build(),
    )


def block(vector: Array, indices: Index) -> Array:
    """What consecutive `indices` of any shape name in a vector, as a view of that shape."""
    begin = indices.item(0) if indices.size else 0
    return vector[begin : begin + indices.size].reshape(indices.shape)


def _consecutive(*shapes: tuple[int, ...]) -> tuple[list[Index], int]:
    """Consecutive indices from 0 on in blocks of these shapes, and how many they are."""
    sizes = [int(np.prod(shape)) for shape in shapes]
    blocks = np.split(np.arange(sum(sizes), dtype=np.int64), np.cumsum(sizes)[:-1])
    return [each.reshape(shape) for each, shape in zip(blocks, shapes, strict=True)], sum(sizes)
