"""Fixed sparsity pattern of the QP, with a named group of slots for everything that is written.

Variables are the changes of states dz_0..dz_N and controls du_0..du_{N-1} about a trajectory, one corridor
slack per stage 1..N, and, where plans end at a free time, the change dT of that:

    minimise   1/2 w' P w + q' w     subject to   l <= A w <= u

Rows, in this order:
    dynamics   dz_0 = measured - linearised;
               F_z dz_k + F_u du_k + F_T dT - dz_{k+1} = z_{k+1} - F(z_k, u_k)
    states     bounds on v, delta, theta of stages 1..N
    controls   bounds on a, delta_dot, theta_dot
    corridor   half-planes of every piece of stages 1..N (ocp/corridor_rows.py, Eq. H2)
    slack      >= 0
    time       bounds on dT

Everything is in scaled units: a variable counts in its `UNITS`, a row in the unit of what it bounds,
so OSQP's own scaling (a pass over the matrices each cycle) can stay off.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from scipy import sparse

from geometry.arrays import locked_record
from geometry.compiled import Array1, Array2, Index1, Index2, Index3, Index4
from rti_mpcc.model.layout import CONTROLS, DELTA, DELTA_DOT, PHI, STATES, THETA, A, V, X, Y
from rti_mpcc.types import Array, Index

STATE_UNITS = np.array([1.0, 1.0, 0.3, 1.0, 0.3, 1.0])
"""What one scaled unit of x, y, phi, v, delta, theta is."""
CONTROL_UNITS = np.array([0.5, 0.5, 1.0])
"""What one scaled unit of a, delta_dot, theta_dot is."""
SLACK_UNIT = 0.1
"""What one scaled unit of slack is [m]."""
TIME_UNIT = 1.0
"""What one scaled unit of dT is [s]."""

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
STRETCHED = np.array([X, Y, PHI, V, DELTA])
"""States that change with the length of their stage; the progress keeps to its stages (`ocp.stage_cost`)."""


class QpPattern(NamedTuple):
    """Where everything stands in the QP; all arrays are read-only, kernels take it whole.

    Attributes:
        state_columns (N+1, 6), control_columns (N, 3), slack_columns (N,), time_column (1,): variables.
        dynamics_rows (N+1, 6), bound_rows (2, N, 3) of states and controls, corridor_rows (N, pieces, sides),
            slack_rows (N,), time_row (1,): constraints.
        column_units: (n,) what one scaled unit is; bound_units: (2, 3) the same of `bound_rows`.
        hessians (N+1, 13) of `HESSIAN_PAIRS`, control_hessians (N, 3), slack_hessians (N,), time_hessian
            (1,): slots of P.
        poses (N, 15) as in `ModelStep.pose_by`, driven (N, 3), bounds (2, N, 3), half_planes (N, pieces,
            sides, 4) on x, y, phi and slack, stretches (N, 5) of `STRETCHED` and bounds_by_time (N,) on a,
            both on dT: slots of A. All of dT are empty where the end of plans is not free.
        cost_...: of P (upper triangle) in CSC form; constraint_...: of A. `scale`: (nnz,) from physical to
            scaled units; `constant`: (nnz,) the entries that never change, 0 elsewhere.
    """

    state_columns: Index2
    control_columns: Index2
    slack_columns: Index1
    time_column: Index1
    dynamics_rows: Index2
    bound_rows: Index3
    corridor_rows: Index3
    slack_rows: Index1
    time_row: Index1
    column_units: Array1
    bound_units: Array2
    hessians: Index2
    control_hessians: Index2
    slack_hessians: Index1
    time_hessian: Index1
    poses: Index2
    driven: Index2
    bounds: Index3
    half_planes: Index4
    stretches: Index2
    bounds_by_time: Index1
    cost_indices: Index1
    cost_indptr: Index1
    cost_scale: Array1
    cost_constant: Array1
    constraint_indices: Index1
    constraint_indptr: Index1
    constraint_scale: Array1
    constraint_constant: Array1

    def __reduce__(self) -> tuple[Any, ...]:
        return locked_record, (QpPattern, *self)

    @property
    def shape(self) -> tuple[int, int]:
        """Number of constraints and of variables."""
        return self.slack_rows[-1] + 1 + len(self.time_row), len(self.column_units)

    def cost_matrix(self, data: Array) -> sparse.csc_matrix:
        """P with `data` (nnz,), explicit zeros kept."""
        columns = len(self.column_units)
        return sparse.csc_matrix((data, self.cost_indices, self.cost_indptr), shape=(columns, columns))

    def constraint_matrix(self, data: Array) -> sparse.csc_matrix:
        """A with `data` (nnz,), explicit zeros kept."""
        return sparse.csc_matrix((data, self.constraint_indices, self.constraint_indptr), shape=self.shape)


def build_pattern(stages: int, pieces: int, sides: int, *, free_end: bool = False) -> QpPattern:
    """The pattern for N stages and `sides` half-planes on each of `pieces` pieces; `free_end`: with dT."""
    of_time = (int(free_end),)
    of_states, of_controls, of_sides = (stages + 1, STATES), (stages, CONTROLS), (stages, pieces, sides)
    (state_columns, control_columns, slack_columns, time_column), columns = _consecutive(
        of_states, of_controls, (stages,), of_time
    )
    (dynamics_rows, bound_rows, corridor_rows, slack_rows, time_row), rows = _consecutive(
        of_states, (2, *of_controls), of_sides, (stages,), of_time
    )

    column_units = np.empty(columns)
    column_units[state_columns], column_units[control_columns] = STATE_UNITS, CONTROL_UNITS
    column_units[slack_columns], column_units[time_column] = SLACK_UNIT, TIME_UNIT
    row_units = np.ones(rows)
    row_units[time_row] = BOUND_UNIT * TIME_UNIT
    row_units[dynamics_rows], row_units[slack_rows] = STATE_UNITS, SLACK_UNIT
    row_units[bound_rows] = BOUND_UNIT * np.stack([STATE_UNITS[BOUNDED], CONTROL_UNITS])[:, None]

    cost, (hessians, control_hessians, slack_hessians, time_hessian) = _slots(
        column_units,
        column_units,
        (state_columns[:, HESSIAN_PAIRS[:, 0]], state_columns[:, HESSIAN_PAIRS[:, 1]], 0.0),
        (control_columns, control_columns, 0.0),
        (slack_columns, slack_columns, 0.0),
        (time_column, time_column, 0.0),
    )
    stretched = dynamics_rows[1:, STRETCHED] if free_end else np.empty((0, len(STRETCHED)), dtype=np.int64)
    bounded = bound_rows[1, :, A] if free_end else np.empty(0, dtype=np.int64)
    dt = int(time_column[0]) if free_end else 0
    causes = np.hstack([state_columns[:-1, [PHI, V, DELTA]], control_columns[:, [A, DELTA_DOT]]])
    pose = dynamics_rows[1:, [X, Y, PHI]]
    pose_and_slack = np.hstack([state_columns[1:, [X, Y, PHI]], slack_columns[:, None]])
    constraints, (poses, driven, bounds, half_planes, stretches, bounds_by_time, *_) = _slots(
        1.0 / row_units,
        column_units,
        (pose.repeat(causes.shape[1], axis=1), np.tile(causes, pose.shape[1]), 0.0),
        (dynamics_rows[1:, DRIVEN], control_columns, 0.0),
        (bound_rows, np.stack([state_columns[1:, BOUNDED], control_columns]), 1.0),
        (corridor_rows[..., None], pose_and_slack[:, None, None, :], 0.0),
        (stretched, np.full_like(stretched, dt), 0.0),
        (bounded, np.full_like(bounded, dt), 0.0),
        (dynamics_rows[0], state_columns[0], 1.0),
        (dynamics_rows[1:, KEPT], state_columns[:-1, KEPT], 1.0),
        (dynamics_rows[1:], state_columns[1:], -1.0),
        (slack_rows, slack_columns, 1.0),
        (time_row, time_column, 1.0),
    )
    return locked_record(
        QpPattern, state_columns, control_columns, slack_columns, time_column,
        dynamics_rows, bound_rows, corridor_rows, slack_rows, time_row,
        column_units, row_units[bound_rows[:, 0]],
        hessians, control_hessians, slack_hessians, time_hessian,
        poses, driven, bounds, half_planes, stretches, bounds_by_time,
        *cost, *constraints,
    )  # fmt: skip


def _slots(
    row_scale: Array, column_scale: Array, *groups: tuple[Index, Index, float]
) -> tuple[tuple[Index, Index, Array, Array], list[Index]]:
    """A sparse matrix of groups of entries: their rows and columns, and the value that they keep, or 0.

    Returns: its indices, indptr, scale and constant in CSC form; the slots of each group, in its shape.
    """
    spread = [np.broadcast_arrays(rows, columns) for rows, columns, _ in groups]
    rows, columns = (np.concatenate([each[i].ravel() for each in spread]) for i in range(2))
    values = np.repeat([value for *_, value in groups], [each.size for each, _ in spread])
    order = np.lexsort((rows, columns))
    slots = np.empty_like(order)
    slots[order] = np.arange(len(order))
    ends = np.cumsum([each.size for each, _ in spread])[:-1]
    scale = (row_scale[rows] * column_scale[columns])[order]
    indptr = np.concatenate([[0], np.cumsum(np.bincount(columns, minlength=len(column_scale)))])
    groups_of = [
        each.reshape(like.shape) for each, (like, _) in zip(np.split(slots, ends), spread, strict=True)
    ]
    return (rows[order], indptr, scale, values[order] * scale), groups_of


def _consecutive(*shapes: tuple[int, ...]) -> tuple[list[Index], int]:
    """Consecutive indices from 0 on in blocks of these shapes, and how many they are."""
    sizes = [int(np.prod(shape)) for shape in shapes]
    blocks = np.split(np.arange(sum(sizes), dtype=np.int64), np.cumsum(sizes)[:-1])
    return [each.reshape(shape) for each, shape in zip(blocks, shapes, strict=True)], sum(sizes)
