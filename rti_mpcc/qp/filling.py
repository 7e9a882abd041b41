"""Writes a linearised optimal control problem into the slots of the QP.

The QP is in the change of the trajectory. The cost is multiplied by a scale per objective that brings
its largest weight to about 1, which is what OSQP's absolute tolerance is meant for. A small weight on
the change keeps the QP strictly convex; on the change, not on the value, so it moves no fixed point.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rti_mpcc.config import Limits, SolverSettings
from rti_mpcc.model.bicycle import Step
from rti_mpcc.model.layout import CONTROLS, DELTA, PHI, STATES, THETA, THETA_DOT, V, X, Y
from rti_mpcc.ocp.bounds import StageBounds
from rti_mpcc.ocp.corridor_rows import LOOSE, CorridorRows
from rti_mpcc.ocp.stage_cost import QuadraticCost
from rti_mpcc.qp.pattern import (
    BOUNDED,
    HESSIAN_PAIRS,
    STATE_UNITS,
    QpPattern,
    block,
)
from rti_mpcc.types import Array

_DIAGONAL = (HESSIAN_PAIRS[:, 0] == HESSIAN_PAIRS[:, 1]).astype(np.float64)
_DAMPED = _DIAGONAL * np.isin(HESSIAN_PAIRS[:, 0], (X, Y, PHI, DELTA))
_IDLE = _DIAGONAL * (HESSIAN_PAIRS[:, 0] == THETA)
_HEADING = int(np.flatnonzero((HESSIAN_PAIRS == PHI).all(axis=1))[0])


@dataclass(frozen=True, slots=True, kw_only=True)
class QpValues:
    """Numbers of one QP in scaled units; buffers that every cycle overwrites.

    Attributes:
        cost: (nnz P,); gradient: (n,); constraints: (nnz A,); lower, upper: (m,).
        row_scaling: (m,) so many of its units a row counts in, see `SolverSettings.row_scaling_from`.
    """

    cost: Array
    gradient: Array
    constraints: Array
    lower: Array
    upper: Array
    row_scaling: Array


def empty_values(pattern: QpPattern) -> QpValues:
    """Buffers with the entries that never change."""
    rows, columns = pattern.constraints.shape
    values = QpValues(
        cost=pattern.cost.constant.copy(),
        gradient=np.zeros(columns),
        constraints=pattern.constraints.constant.copy(),
        lower=np.full(rows, -np.inf),
        upper=np.full(rows, np.inf),
        row_scaling=np.ones(rows),
    )
    values.cost[pattern.cost.groups["slacks"]] = pattern.settings.change_weight
    values.lower[pattern.slack_rows] = 0.0
    fill_initial(values, pattern, np.zeros(STATES))
    _loosen(values, pattern, 0)
    return values


def fill_cost(
    values: QpValues,
    pattern: QpPattern,
    cost: QuadraticCost,
    slack: float,
    scale: float,
    damping: float = 0.0,
) -> None:
    """P and q.

    Args:
        slack: linear weight of the corridor slack [1/m]; scale: multiplies all of the cost.
        damping: weight on the change of pose and steering, in scaled units of variables and cost: how far
            one iteration trusts its linearisation (Levenberg and Marquardt).
    """
    slots, units, settings = pattern.cost, pattern.column_units, pattern.settings
    on_states = settings.change_weight * _DIAGONAL + damping * _DAMPED
    on_controls = np.full(CONTROLS, settings.change_weight)
    if not cost.state_hessian[:, THETA, THETA].any():
        on_states += settings.idle_weight * _IDLE
        on_controls[THETA_DOT] += settings.idle_weight
    states = cost.state_hessian[:, HESSIAN_PAIRS[:, 0], HESSIAN_PAIRS[:, 1]]
    slots.write(values.cost, "states", scale * states, on_states)
    slots.write(values.cost, "controls", scale * cost.control_hessian, on_controls)
    for columns, gradient in (
        (pattern.state_columns, cost.state_gradient),
        (pattern.control_columns, cost.control_gradient),
        (pattern.slack_columns, slack),
    ):
        block(values.gradient, columns)[...] = scale * gradient * block(units, columns)


def fill_curvature(
    values: QpValues, pattern: QpPattern, states: Array, reached: Array, dual: Array, scale: float
) -> None:
    """Add the dynamics' own curvature in the heading to P, after `fill_cost` (docs/method.md).

    Turning stage k turns its whole way F - z_k in x and y, so the Lagrangian J + y' (F(z_k, u_k) - z_k+1) has

    (Q1)  d²L/dphi_k² = -(y_x (F_x - x_k) + y_y (F_y - y_k))

    besides Gauss-Newton's part: what a bulge costs that makes the way longer. Without it full steps
    overshoot in the shape of the way, and diverge where the steering rate is cheap. Negative values are
    left out, so P stays positive semi-definite. It moves no fixed point.

    Args:
        states, reached: (N, 6) begin and end of each stage.
        dual: (m,) multipliers of the last QP, scaled units.
        scale: cost scale of this QP over that of the last.
    """
    force = block(dual, pattern.dynamics_rows[1:])
    bulge = force[:, X] * (states[:, X] - reached[:, X]) / STATE_UNITS[X]
    bulge += force[:, Y] * (states[:, Y] - reached[:, Y]) / STATE_UNITS[Y]
    slots = pattern.cost.groups["states"][:-1, _HEADING]
    values.cost[slots] += scale * STATE_UNITS[PHI] ** 2 * np.maximum(bulge, 0.0)


def fill_dynamics(values: QpValues, pattern: QpPattern, step: Step, states: Array) -> None:
    """dF/dz, dF/du and the defects of `states` (N+1, 6)."""
    slots = pattern.constraints
    slots.write(values.constraints, "pose", step.pose_by)
    slots.write(values.constraints, "driven", step.lengths[:, None])
    rows = pattern.dynamics_rows[1:]
    defects = (states[1:] - step.state) / STATE_UNITS
    block(values.lower, rows)[...] = defects
    block(values.upper, rows)[...] = defects


def fill_bounds(
    values: QpValues,
    pattern: QpPattern,
    bounds: StageBounds,
    states: Array,
    controls: Array,
    *,
    rows_scaled: bool = True,
) -> None:
    """Bounds on the changes of `states` (N+1, 6) and `controls` (N, 3).

    Args:
        rows_scaled: bounds that are far off count less, see `SolverSettings.row_scaling_from`.
    """
    # Rows on states and on controls follow each other: both in one go, along axis 0.
    rows = pattern.bound_rows
    scaled = np.empty((2, 2, *rows.shape[1:]))
    for kind, (limits, about) in enumerate(
        ((bounds.states, states[1:, BOUNDED]), (bounds.controls, controls))
    ):
        np.subtract(limits.transpose(1, 0, 2), about, out=scaled[:, kind])
    scaled /= block(pattern.row_units, rows)
    lower, upper = scaled
    row_scaling = _row_scaling(np.minimum(upper, -lower), rows_scaled, pattern.settings)
    scaled /= row_scaling
    pattern.constraints.write(values.constraints, "bounds", 1.0 / row_scaling)
    block(values.row_scaling, rows)[...] = row_scaling
    block(values.lower, rows)[...] = lower
    block(values.upper, rows)[...] = upper


def fill_corridor(
    values: QpValues, pattern: QpPattern, rows: CorridorRows | None, *, rows_scaled: bool = True
) -> None:
    """The half-planes of all discs; those of sides that the corridor no longer has, or all, are loose.

    Args:
        rows_scaled: as in `fill_bounds`.
    """
    acting = 0 if rows is None else rows.lower.shape[2]
    if acting < pattern.corridor_rows.shape[2]:
        _loosen(values, pattern, acting)
    if rows is None:
        return
    row_scaling = _row_scaling(-rows.lower, rows_scaled, pattern.settings)
    _write_half_planes(values, pattern, rows, row_scaling, slice(acting))


def _loosen(values: QpValues, pattern: QpPattern, acting: int) -> None:
    """Of the sides behind the first `acting` ones no half-plane acts: no slopes, but still a relief, which
    keeps the pattern."""
    sides = slice(acting, None)
    shape = pattern.corridor_rows[:, :, sides].shape
    rows = CorridorRows(np.zeros((*shape, 3)), np.full(shape, LOOSE))
    row_scaling = _row_scaling(-rows.lower, rows_scaled=True, settings=pattern.settings)
    _write_half_planes(values, pattern, rows, row_scaling, sides)


def _write_half_planes(
    values: QpValues, pattern: QpPattern, rows: CorridorRows, row_scaling: Array, sides: slice
) -> None:
    """Rows and slack of these sides, each counting `row_scaling` times less."""
    by = np.empty((*rows.lower.shape, 4))
    np.divide(rows.slopes, row_scaling[..., None], out=by[..., :3])
    np.divide(1.0, row_scaling, out=by[..., 3])
    slots = pattern.constraints
    groups, scales = slots.groups["half-planes"][:, :, sides], slots.scales["half-planes"][:, :, sides]
    values.constraints[groups] = by * scales
    block(values.row_scaling, pattern.corridor_rows)[:, :, sides] = row_scaling
    block(values.lower, pattern.corridor_rows)[:, :, sides] = rows.lower / row_scaling


def _row_scaling(distance: Array, rows_scaled: bool, settings: SolverSettings) -> Array:
    """Factor on the units of rows whose bounds are at `distance`, in these units."""
    if not rows_scaled:
        return np.ones_like(distance)
    return np.minimum(np.maximum(distance / settings.row_scaling_from, 1.0), settings.row_scaling_most)


def fill_corridor_bounds(values: QpValues, pattern: QpPattern, lower: Array) -> None:
    """Feedback phase: other lower bounds (N, discs, sides) [m] of the half-planes that were filled last."""
    sides = lower.shape[2]
    row_scaling = block(values.row_scaling, pattern.corridor_rows)[:, :, :sides]
    block(values.lower, pattern.corridor_rows)[:, :, :sides] = lower / row_scaling


def fill_motion_bounds(
    values: QpValues,
    pattern: QpPattern,
    measured: Array,
    states: Array,
    lengths: Array,
    bounds: Array,
    limits: Limits,
    share: float,
) -> bool:
    """Feedback phase: widen bounds on v and delta as far as the measured state (6,) needs it.

    Args:
        states: (N+1, 6) linearised about; lengths: (N,) of the stages [s].
        bounds: (2, 2) what v and delta may be at every stage, lower and upper.
        share: of the input `limits`, at which they must return.

    Returns whether it is by more than the first stage can give back.
    """
    far_out = False
    rows = pattern.state_rows
    lower, upper = block(values.lower, rows), block(values.upper, rows)
    for column, (quantity, rate) in enumerate(((V, limits.acceleration), (DELTA, limits.steering_rate))):
        value = float(measured[quantity])
        if bounds[column, 0] <= value <= bounds[column, 1]:
            continue
        units = block(pattern.row_units, rows)[:, column] * block(values.row_scaling, rows)[:, column]
        shift, drop = states[1:, quantity], share * rate * np.add.accumulate(lengths)
        low, high = lower[0, column], upper[0, column]
        top, bottom = upper[:, column], lower[:, column]
        np.maximum(top, (value - drop - shift) / units, out=top)
        np.minimum(bottom, (value + drop - shift) / units, out=bottom)
        far_out |= bool(bottom[0] < low or top[0] > high)
    return far_out


def fill_initial(values: QpValues, pattern: QpPattern, change: Array) -> None:
    """Feedback phase: the measured state (6,) minus the linearised one."""
    scaled = change / STATE_UNITS
    begin = pattern.dynamics_rows.item(0)
    values.lower[begin : begin + STATES] = scaled
    values.upper[begin : begin + STATES] = scaled
