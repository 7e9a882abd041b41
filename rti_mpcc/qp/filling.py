"""Writes a linearised optimal control problem into the slots of the QP.

The QP is in the change of the trajectory. The cost is multiplied by a scale per objective that brings
its largest weight to about 1, which is what OSQP's absolute tolerance is meant for. A small weight on
the change keeps the QP strictly convex; on the change, not on the value, so it moves no fixed point.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geometry.compiled import (
    Array1,
    Array2,
    Array3,
    Array4,
    Index1,
    Index2,
    Index3,
    Index4,
    Out1,
    Out2,
    Out3,
    inner,
    kernel,
)
from rti_mpcc.config import Comfort
from rti_mpcc.model.bicycle import ModelStep
from rti_mpcc.model.layout import CONTROLS, DELTA, PHI, POSE, STATES, THETA, THETA_DOT, V, X, Y
from rti_mpcc.ocp.bounds import StageBounds
from rti_mpcc.ocp.corridor_rows import LOOSE, CorridorRows
from rti_mpcc.ocp.stage_cost import QuadraticCost
from rti_mpcc.qp.pattern import (
    BOUNDED,
    CONTROL_UNITS,
    HESSIAN_PAIRS,
    SLACK_UNIT,
    STATE_UNITS,
    Columns,
    QpPattern,
    Rows,
    block,
)
from rti_mpcc.types import Array

CHANGE_WEIGHT = 1e-6
"""On every change, in scaled units of variables and cost."""
IDLE_WEIGHT = 1e-2
"""On the change of progress where no Frenet cost acts on it: it just goes on as planned."""
ROW_SCALING_FROM = 0.02
"""An inequality farther from its bound than this, in units of its row, counts in proportion to that: k times
less at a distance of k times this. A plan whose shape costs little would be held by bounds that are far off
for hundreds of iterations (docs/decisions, 4). A row that does come to act from afar takes long: with a first
guess none is scaled down."""
ROW_SCALING_MOST = 1e4
"""Largest k, for bounds at infinity."""

_HEADING = int(np.flatnonzero((HESSIAN_PAIRS == PHI).all(axis=1))[0])


@dataclass(frozen=True, slots=True, kw_only=True)
class QpValues:
    """Numbers of one QP in scaled units; buffers that every cycle overwrites.

    Attributes:
        cost: (nnz P,); gradient: (n,); constraints: (nnz A,); lower, upper: (m,).
        row_scaling: (m,) so many of its units a row counts in, see `ROW_SCALING_FROM`.
        ..._by: the same arrays, block by block.
    """

    cost: Array
    gradient: Array
    constraints: Array
    lower: Array
    upper: Array
    row_scaling: Array
    gradient_by: Columns
    lower_by: Rows
    upper_by: Rows
    row_scaling_by: Rows


def empty_values(pattern: QpPattern) -> QpValues:
    """Buffers with the entries that never change."""
    rows, columns = pattern.constraints.shape
    gradient, row_scaling = np.zeros(columns), np.ones(rows)
    lower, upper = np.full(rows, -np.inf), np.full(rows, np.inf)
    values = QpValues(
        cost=pattern.cost.constant.copy(),
        gradient=gradient,
        constraints=pattern.constraints.constant.copy(),
        lower=lower,
        upper=upper,
        row_scaling=row_scaling,
        gradient_by=pattern.columns(gradient),
        lower_by=pattern.rows(lower),
        upper_by=pattern.rows(upper),
        row_scaling_by=pattern.rows(row_scaling),
    )
    values.cost[pattern.cost.groups["slacks"]] = CHANGE_WEIGHT
    values.lower_by.slack[:] = 0.0
    # The solver is told from the start which rows are equations, and which have bounds at all.
    values.lower_by.dynamics[:] = values.upper_by.dynamics[:] = 0.0
    values.lower_by.bounds[:], values.upper_by.bounds[:] = -1.0, 1.0
    fill_initial(values, np.zeros(STATES))
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
    gradient, groups, scales = values.gradient_by, pattern.cost.groups, pattern.cost.scales
    idles = _fill_state_cost(
        cost.state_hessian, cost.state_gradient, HESSIAN_PAIRS, scale, damping, CHANGE_WEIGHT, IDLE_WEIGHT,
        groups["states"], scales["states"], values.cost, gradient.states,
    )  # fmt: skip
    _fill_control_cost(
        cost.control_hessian, cost.control_gradient, scale, CHANGE_WEIGHT, IDLE_WEIGHT if idles else 0.0,
        groups["controls"], scales["controls"], values.cost, gradient.controls,
    )  # fmt: skip
    gradient.slack[:] = scale * slack * SLACK_UNIT


@kernel
def _fill_state_cost(
    hessian: Array3,
    gradient: Array2,
    pairs: Index2,
    scale: float,
    damping: float,
    change: float,
    idle: float,
    slots: Index2,
    scales: Array2,
    data: Out1,
    scaled: Out2,
) -> bool:
    """The entries `pairs` of each stage's Hessian, and the gradient, times `scale`.

    On the diagonal come the weights on the change on top, `idle` on the progress where nothing else is on it:
    returns whether that is so.
    """
    idles = True
    for k in range(len(hessian)):
        idles &= hessian[k, THETA, THETA] == 0.0
    for k in range(len(slots)):
        for p in range(len(pairs)):
            i, j = pairs[p, 0], pairs[p, 1]
            value = scale * hessian[k, i, j] * scales[k, p]
            if i == j:
                value += change
                if i == THETA:
                    value += idle if idles else 0.0
                elif i != V:
                    value += damping
            data[slots[k, p]] = value
        for i in range(STATES):
            scaled[k, i] = scale * gradient[k, i] * STATE_UNITS[i]
    return idles


@kernel
def _fill_control_cost(
    hessian: Array2,
    gradient: Array2,
    scale: float,
    change: float,
    idle: float,
    slots: Index2,
    scales: Array2,
    data: Out1,
    scaled: Out2,
) -> None:
    """The same of the controls; `idle` is on how fast progress is made."""
    for k in range(len(slots)):
        for i in range(CONTROLS):
            on_change = change + (idle if i == THETA_DOT else 0.0)
            data[slots[k, i]] = on_change + scale * hessian[k, i] * scales[k, i]
            scaled[k, i] = scale * gradient[k, i] * CONTROL_UNITS[i]


def fill_curvature(
    values: QpValues, pattern: QpPattern, states: Array, reached: Array, dual: Array, scale: float
) -> None:
    """Add the dynamics' own curvature in the heading to P, after `fill_cost` (docs/method.md).

    Turning stage k turns its whole way F - z_k in x and y, so the Lagrangian J + l' (F(z_k, u_k) - z_k+1) has

    (Q1)  d²L/dphi_k² = -(l_x (F_x - x_k) + l_y (F_y - y_k)),   l the multipliers lambda,

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


def fill_dynamics(values: QpValues, pattern: QpPattern, step: ModelStep, states: Array) -> None:
    """dF/dz, dF/du and the defects of `states` (N+1, 6)."""
    groups, scales = pattern.constraints.groups, pattern.constraints.scales
    count = len(step.lengths)
    _write(step.pose_by.reshape(count, -1), groups["pose"], scales["pose"], values.constraints)
    _write(step.lengths.reshape(count, 1), groups["driven"], scales["driven"], values.constraints)
    _fill_defects(states, step.state, STATE_UNITS, values.lower_by.dynamics, values.upper_by.dynamics)


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
        rows_scaled: bounds that are far off count less, see `ROW_SCALING_FROM`.
    """
    slots = pattern.constraints
    _fill_bounds(
        bounds.states, bounds.controls, states, controls, BOUNDED, pattern.bound_units,
        ROW_SCALING_FROM, ROW_SCALING_MOST if rows_scaled else 1.0,
        slots.groups["bounds"], slots.scales["bounds"], values.constraints,
        values.row_scaling_by.bounds, values.lower_by.bounds, values.upper_by.bounds,
    )  # fmt: skip


@kernel
def _fill_bounds(
    state_limits: Array3,
    control_limits: Array3,
    states: Array2,
    controls: Array2,
    bounded: Index1,
    units: Array2,
    scaled_from: float,
    most: float,
    slots: Index3,
    scales: Array3,
    data: Out1,
    row_scaling: Out3,
    lower: Out3,
    upper: Out3,
) -> None:
    for kind in range(2):
        limits = state_limits if kind == 0 else control_limits
        for k in range(len(controls)):
            for i in range(CONTROLS):
                here = states[k + 1, bounded[i]] if kind == 0 else controls[k, i]
                low, high = (
                    (limits[k, 0, i] - here) / units[kind, i],
                    (limits[k, 1, i] - here) / units[kind, i],
                )
                by = _row_scaling(min(high, -low), scaled_from, most)
                data[slots[kind, k, i]] = scales[kind, k, i] / by
                row_scaling[kind, k, i], lower[kind, k, i], upper[kind, k, i] = by, low / by, high / by


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
    slots = pattern.constraints
    _fill_half_planes(
        np.ascontiguousarray(rows.slopes), np.ascontiguousarray(rows.lower), first,
        ROW_SCALING_FROM, ROW_SCALING_MOST if rows_scaled else 1.0,
        slots.groups["half-planes"], slots.scales["half-planes"], values.constraints,
        values.row_scaling_by.corridor, values.lower_by.corridor,
    )  # fmt: skip


@kernel
def _fill_half_planes(
    slopes: Array4,
    bounds: Array3,
    first: int,
    scaled_from: float,
    most: float,
    slots: Index4,
    scales: Array4,
    data: Out1,
    row_scaling: Out3,
    lower: Out3,
) -> None:
    stages, pieces, sides = bounds.shape
    for k in range(stages):
        for piece in range(pieces):
            for side in range(sides):
                by = _row_scaling(-bounds[k, piece, side], scaled_from, most)
                at = first + side
                for i in range(POSE):
                    slope = slopes[k, piece, side, i] * scales[k, piece, at, i]
                    data[slots[k, piece, at, i]] = slope / by
                data[slots[k, piece, at, POSE]] = scales[k, piece, at, POSE] / by
                row_scaling[k, piece, at], lower[k, piece, at] = by, bounds[k, piece, side] / by


def fill_corridor_bounds(values: QpValues, lower: Array) -> None:
    """Feedback phase: other lower bounds (N, pieces, sides) [m] of the half-planes that were filled last."""
    sides = lower.shape[2]
    values.lower_by.corridor[:, :, :sides] = lower / values.row_scaling_by.corridor[:, :, :sides]


def fill_motion_bounds(
    values: QpValues,
    pattern: QpPattern,
    measured: Array,
    states: Array,
    lengths: Array,
    bounds: StageBounds,
    comfort: Comfort,
) -> bool:
    """Feedback phase: widen bounds on v and delta as far as the measured state (6,), and bounds on the
    acceleration, need it.

    Args:
        states: (N+1, 6) linearised about; lengths: (N,) of the stages [s].
        bounds: that were filled last.
        comfort: with which they must return: just outside a limit, at rest say, more would be a jerk.

    Returns whether it is by more than the first stage can give back.
    """
    return _fill_motion_bounds(
        measured, states, lengths, bounds.states, bounds.controls, pattern.bound_units,
        comfort.acceleration, comfort.steering_rate,
        values.row_scaling_by.bounds, values.lower_by.bounds, values.upper_by.bounds,
    )  # fmt: skip


@kernel
def _fill_motion_bounds(
    measured: Array1,
    states: Array2,
    lengths: Array1,
    bounds: Array3,
    controls: Array3,
    units: Array2,
    acceleration: float,
    steering_rate: float,
    row_scaling: Array3,
    lower: Out3,
    upper: Out3,
) -> bool:
    far_out = False
    for column in range(2):
        quantity, most = (V, acceleration) if column == 0 else (DELTA, steering_rate)
        least, highest = measured[quantity], measured[quantity]
        low, high = lower[0, 0, column], upper[0, 0, column]
        for k in range(len(lengths)):
            # As far as comfort and the control's own bounds bring it down, and up.
            least += max(controls[k, 0, column], -most) * lengths[k]
            highest += min(controls[k, 1, column], most) * lengths[k]
            if least <= bounds[k, 1, column] and highest >= bounds[k, 0, column]:
                continue
            unit, about = units[0, column] * row_scaling[0, k, column], states[k + 1, quantity]
            upper[0, k, column] = max(upper[0, k, column], (least - about) / unit)
            lower[0, k, column] = min(lower[0, k, column], (highest - about) / unit)
        far_out |= lower[0, 0, column] < low or upper[0, 0, column] > high
    return far_out


def fill_initial(values: QpValues, change: Array) -> None:
    """Feedback phase: the measured state (6,) minus the linearised one."""
    values.lower_by.initial[:] = values.upper_by.initial[:] = change / STATE_UNITS
