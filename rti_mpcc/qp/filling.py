"""Writes a linearised optimal control problem into the slots of the QP.

The QP is in the change of the trajectory. The cost is multiplied by a scale per objective that brings
its largest weight to about 1, which is what OSQP's absolute tolerance is meant for. A small weight on
the change keeps the QP strictly convex; on the change, not on the value, so it moves no fixed point.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geometry.compiled import Array1, Array2, Array3, Index1, Index2, Index3, Out1, Out2, inner, kernel
from rti_mpcc.config import Limits
from rti_mpcc.model.bicycle import Step
from rti_mpcc.model.layout import CONTROLS, DELTA, PHI, STATES, THETA, THETA_DOT, V, X, Y
from rti_mpcc.ocp.bounds import StageBounds
from rti_mpcc.ocp.corridor_rows import LOOSE, CorridorRows
from rti_mpcc.ocp.stage_cost import QuadraticCost
from rti_mpcc.qp.pattern import (
    BOUNDED,
    HESSIAN_PAIRS,
    SLACK_UNIT,
    STATE_UNITS,
    QpPattern,
    block,
)
from rti_mpcc.types import Array

_DIAGONAL = (HESSIAN_PAIRS[:, 0] == HESSIAN_PAIRS[:, 1]).astype(np.float64)
_DAMPED = _DIAGONAL * np.isin(HESSIAN_PAIRS[:, 0], (X, Y, PHI, DELTA))
_IDLE = _DIAGONAL * (HESSIAN_PAIRS[:, 0] == THETA)
_ALL_CONTROLS = np.arange(CONTROLS)
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
    groups, scales = slots.groups, slots.scales
    _fill_hessian(
        cost.state_hessian, HESSIAN_PAIRS, scale, on_states, groups["states"], scales["states"], values.cost
    )
    _fill_diagonal(
        cost.control_hessian, scale, on_controls, groups["controls"], scales["controls"], values.cost
    )
    for columns, gradient in (
        (pattern.state_columns, cost.state_gradient),
        (pattern.control_columns, cost.control_gradient),
    ):
        _scale(gradient, scale, block(units, columns), block(values.gradient, columns))
    block(values.gradient, pattern.slack_columns)[...] = scale * slack * SLACK_UNIT


@kernel
def _fill_hessian(
    hessian: Array3, pairs: Index2, scale: float, plus: Array1, slots: Index2, scales: Array2, data: Out1
) -> None:
    """The entries `pairs` of each stage's Hessian, times `scale`, and `plus` in scaled units on top."""
    for k in range(len(slots)):
        for i in range(len(pairs)):
            value = scale * hessian[k, pairs[i, 0], pairs[i, 1]]
            data[slots[k, i]] = value * scales[k, i] + plus[i]


@kernel
def _fill_diagonal(
    diagonal: Array2, scale: float, plus: Array1, slots: Index2, scales: Array2, data: Out1
) -> None:
    for k in range(len(slots)):
        for i in range(slots.shape[1]):
            data[slots[k, i]] = scale * diagonal[k, i] * scales[k, i] + plus[i]


@kernel
def _scale(values: Array2, scale: float, units: Array2, scaled: Out2) -> None:
    for k in range(len(values)):
        for i in range(values.shape[1]):
            scaled[k, i] = scale * values[k, i] * units[k, i]


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
    slots = pattern.cost.groups["states"]
    _fill_curvature(states, reached, force, scale, STATE_UNITS, slots, _HEADING, values.cost)


@kernel
def _fill_curvature(
    states: Array2,
    reached: Array2,
    force: Array2,
    scale: float,
    units: Array1,
    slots: Index2,
    heading: int,
    data: Out1,
) -> None:
    """Equation (Q1), into the column `heading` of the slots."""
    for k in range(len(reached)):
        bulge = force[k, X] * (states[k, X] - reached[k, X]) / units[X]
        bulge += force[k, Y] * (states[k, Y] - reached[k, Y]) / units[Y]
        data[slots[k, heading]] += scale * units[PHI] ** 2 * max(bulge, 0.0)


def fill_dynamics(values: QpValues, pattern: QpPattern, step: Step, states: Array) -> None:
    """dF/dz, dF/du and the defects of `states` (N+1, 6)."""
    groups, scales = pattern.constraints.groups, pattern.constraints.scales
    count = len(step.lengths)
    _write(step.pose_by.reshape(count, -1), groups["pose"], scales["pose"], values.constraints)
    _write(step.lengths.reshape(count, 1), groups["driven"], scales["driven"], values.constraints)
    rows = pattern.dynamics_rows[1:]
    _fill_defects(states, step.state, STATE_UNITS, block(values.lower, rows), block(values.upper, rows))


@kernel
def _write(values: Array2, slots: Index2, scales: Array2, data: Out1) -> None:
    """Physical values into their slots; one value of a stage stands for all of its slots."""
    for k in range(len(slots)):
        for i in range(slots.shape[1]):
            data[slots[k, i]] = values[k, i if values.shape[1] > 1 else 0] * scales[k, i]


@kernel
def _fill_defects(states: Array2, reached: Array2, units: Array1, lower: Out2, upper: Out2) -> None:
    for k in range(len(reached)):
        for i in range(STATES):
            lower[k, i] = upper[k, i] = (states[k + 1, i] - reached[k, i]) / units[i]


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
    settings, slots = pattern.settings, pattern.constraints.groups["bounds"]
    scaling = (settings.row_scaling_from, settings.row_scaling_most if rows_scaled else 1.0)
    for kind, (limits, about, columns) in enumerate(
        ((bounds.states, states[1:], BOUNDED), (bounds.controls, controls, _ALL_CONTROLS))
    ):
        rows = pattern.bound_rows[kind]
        _fill_bounds(
            limits,
            about,
            columns,
            block(pattern.row_units, rows),
            *scaling,
            slots[kind],
            pattern.constraints.scales["bounds"][kind],
            values.constraints,
            block(values.row_scaling, rows),
            block(values.lower, rows),
            block(values.upper, rows),
        )


@kernel
def _fill_bounds(
    limits: Array3,
    about: Array2,
    columns: Index1,
    units: Array2,
    scaled_from: float,
    most: float,
    slots: Index2,
    scales: Array2,
    data: Out1,
    row_scaling: Out2,
    lower: Out2,
    upper: Out2,
) -> None:
    for k in range(len(slots)):
        for i in range(slots.shape[1]):
            here = about[k, columns[i]]
            low, high = (limits[k, 0, i] - here) / units[k, i], (limits[k, 1, i] - here) / units[k, i]
            by = _row_scaling(min(high, -low), scaled_from, most)
            data[slots[k, i]] = scales[k, i] / by
            row_scaling[k, i], lower[k, i], upper[k, i] = by, low / by, high / by


@inner
def _row_scaling(distance: float, scaled_from: float, most: float) -> float:
    """Factor on the unit of a row whose bound is at `distance`, in this unit."""
    return min(max(distance / scaled_from, 1.0), most)


def fill_corridor(
    values: QpValues, pattern: QpPattern, rows: CorridorRows | None, *, rows_scaled: bool = True
) -> None:
    """The half-planes of all pieces; those of sides that the corridor no longer has, or all, are loose.

    Args:
        rows_scaled: as in `fill_bounds`.
    """
    acting = 0 if rows is None else rows.lower.shape[2]
    if acting < pattern.corridor_rows.shape[2]:
        _loosen(values, pattern, acting)
    if rows is not None:
        _write_half_planes(values, pattern, rows, 0, rows_scaled)


def _loosen(values: QpValues, pattern: QpPattern, acting: int) -> None:
    """Of the sides behind the first `acting` ones no half-plane acts: no slopes, but still a relief, which
    keeps the pattern."""
    stages, pieces, sides = pattern.corridor_rows.shape
    shape = (stages, pieces, sides - acting)
    rows = CorridorRows(np.zeros((*shape, 3)), np.full(shape, LOOSE))
    _write_half_planes(values, pattern, rows, acting, rows_scaled=True)


def _write_half_planes(
    values: QpValues, pattern: QpPattern, rows: CorridorRows, first: int, rows_scaled: bool
) -> None:
    """Rows and slack of the sides from the `first` on, each counting `row_scaling` times less."""
    settings, slots = pattern.settings, pattern.constraints
    stages, pieces, sides = pattern.corridor_rows.shape
    shape, given = (stages * pieces, sides), (stages * pieces, rows.lower.shape[2])
    _fill_half_planes(
        np.ascontiguousarray(rows.slopes).reshape(*given, 3),
        np.ascontiguousarray(rows.lower).reshape(given),
        first,
        settings.row_scaling_from,
        settings.row_scaling_most if rows_scaled else 1.0,
        slots.groups["half-planes"].reshape(*shape, 4),
        slots.scales["half-planes"].reshape(*shape, 4),
        values.constraints,
        block(values.row_scaling, pattern.corridor_rows).reshape(shape),
        block(values.lower, pattern.corridor_rows).reshape(shape),
    )


@kernel
def _fill_half_planes(
    slopes: Array3,
    bounds: Array2,
    first: int,
    scaled_from: float,
    most: float,
    slots: Index3,
    scales: Array3,
    data: Out1,
    row_scaling: Out2,
    lower: Out2,
) -> None:
    for row in range(len(slots)):
        for side in range(bounds.shape[1]):
            by = _row_scaling(-bounds[row, side], scaled_from, most)
            at = first + side
            for i in range(3):
                data[slots[row, at, i]] = slopes[row, side, i] * scales[row, at, i] / by
            data[slots[row, at, 3]] = scales[row, at, 3] / by
            row_scaling[row, at], lower[row, at] = by, bounds[row, side] / by


def fill_corridor_bounds(values: QpValues, pattern: QpPattern, lower: Array) -> None:
    """Feedback phase: other lower bounds (N, pieces, sides) [m] of the half-planes that were filled last."""
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
