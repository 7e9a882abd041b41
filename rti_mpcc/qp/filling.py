"""Writes a linearised optimal control problem into the slots of the QP.

The QP is in the change of the trajectory. The cost is multiplied by a scale per objective that brings
its largest weight to about 1, which is what OSQP's absolute tolerance is meant for. A small weight on
the change keeps the QP strictly convex; on the change, not on the value, so it moves no fixed point.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from geometry.compiled import Array1, Array2, Index2, Index3, Out1, inner, kernel
from rti_mpcc.config import Comfort
from rti_mpcc.model.bicycle import ModelStep
from rti_mpcc.model.layout import CONTROLS, DELTA, PHI, POSE, STATES, THETA, THETA_DOT, A, V, X, Y
from rti_mpcc.ocp.bounds import StageBounds
from rti_mpcc.ocp.corridor_rows import LOOSE, CorridorRows
from rti_mpcc.ocp.horizon import PlanStages
from rti_mpcc.ocp.stage_cost import EndTime, QuadraticCost
from rti_mpcc.qp.pattern import (
    BOUND_UNIT,
    BOUNDED,
    CONTROL_UNITS,
    HESSIAN_PAIRS,
    SLACK_UNIT,
    STATE_UNITS,
    TIME_UNIT,
    QpPattern,
)
from rti_mpcc.types import Array

CHANGE_WEIGHT = 1e-6
"""On every change, in scaled units of variables and cost."""
IDLE_WEIGHT = 1e-2
"""On the change of progress where no Frenet cost acts on it: it just goes on as planned."""
ROW_SCALING_FROM = 0.02
"""An inequality farther from its bound than this, in units of its row, counts in proportion to that: k times
less at a distance of k times this. A plan whose shape costs little would be held by bounds that are far off
for hundreds of iterations (docs/decisions, 4). A row that does come to act from afar takes long: its QP is
one for the interior point."""
ROW_SCALING_MOST = 1e4
"""Largest k, for bounds at infinity."""

_HEADING = int(np.flatnonzero((HESSIAN_PAIRS == PHI).all(axis=1))[0])


class QpValues(NamedTuple):
    """Numbers of one QP in scaled units; buffers that every cycle overwrites.

    Attributes:
        cost: (nnz P,); gradient: (n,); constraints: (nnz A,); lower, upper: (m,).
        row_scaling: (m,) how many of its units a row counts in, see `ROW_SCALING_FROM`.
    """

    cost: Out1
    gradient: Out1
    constraints: Out1
    lower: Out1
    upper: Out1
    row_scaling: Out1


class HorizonProblem(NamedTuple):
    """The optimal control problem of a horizon, linearised about the plan of `stages`.

    `rows`: of the corridor; those of sides that it no longer has, or all, are loose.
    """

    stages: PlanStages
    cost: QuadraticCost
    step: ModelStep
    bounds: StageBounds
    rows: CorridorRows
    end: EndTime


class FillOptions(NamedTuple):
    """How the QP weighs and scales a problem.

    Attributes:
        slack: linear weight of the corridor slack [1/m]; scale: multiplies all of the cost.
        damping: weight on the change of pose and steering, in scaled units of variables and cost: how far
            one iteration trusts its linearisation (Levenberg and Marquardt).
        idle: weight on the change of progress where nothing else is on it, `IDLE_WEIGHT`.
        scaled_from: `ROW_SCALING_FROM`.
    """

    slack: float
    scale: float
    damping: float
    idle: float
    scaled_from: float


def empty_values(pattern: QpPattern) -> QpValues:
    """Buffers with the entries that never change."""
    rows, columns = pattern.shape
    values = QpValues(
        cost=pattern.cost_constant.copy(),
        gradient=np.zeros(columns),
        constraints=pattern.constraint_constant.copy(),
        lower=np.full(rows, -np.inf),
        upper=np.full(rows, np.inf),
        row_scaling=np.ones(rows),
    )
    values.cost[pattern.slack_hessians] = CHANGE_WEIGHT
    values.lower[pattern.slack_rows] = 0.0
    # The solver is told from the start which rows are equations, and which have bounds at all.
    values.lower[pattern.dynamics_rows] = values.upper[pattern.dynamics_rows] = 0.0
    values.lower[pattern.bound_rows], values.upper[pattern.bound_rows] = -1.0, 1.0
    values.lower[pattern.time_row], values.upper[pattern.time_row] = -1.0, 1.0
    loose, relief = min(-LOOSE / ROW_SCALING_FROM, ROW_SCALING_MOST), pattern.half_planes[..., POSE]
    values.constraints[relief] = pattern.constraint_scale[relief] / loose
    values.row_scaling[pattern.corridor_rows], values.lower[pattern.corridor_rows] = loose, LOOSE / loose
    return values


@kernel
def fill(values: QpValues, pattern: QpPattern, problem: HorizonProblem, options: FillOptions) -> None:
    """Preparation: all of the QP but the measured state."""
    _fill_cost(values, pattern, problem.cost, options)
    _fill_dynamics(values, pattern, problem.step, problem.stages)
    _fill_bounds(values, pattern, problem.bounds, problem.stages, options)
    _fill_half_planes(values, pattern, problem.rows, options)
    if len(pattern.time_column) > 0:
        _fill_end(values, pattern, problem, options.scale)


@inner
def _fill_cost(values: QpValues, pattern: QpPattern, cost: QuadraticCost, options: FillOptions) -> None:
    """P and q."""
    state_hessian, state_gradient, control_hessian, control_gradient = cost
    scale, idle = options.scale, options.idle
    for k in range(len(state_hessian)):
        if state_hessian[k, THETA, THETA] != 0.0:
            idle = 0.0
    for k in range(len(state_hessian)):
        for p in range(len(HESSIAN_PAIRS)):
            i, j, slot = HESSIAN_PAIRS[p, 0], HESSIAN_PAIRS[p, 1], pattern.hessians[k, p]
            value = scale * state_hessian[k, i, j] * pattern.cost_scale[slot]
            if i == j:
                value += CHANGE_WEIGHT
                if i == THETA:
                    value += idle
                elif i != V:
                    value += options.damping
            values.cost[slot] = value
        for i in range(STATES):
            values.gradient[pattern.state_columns[k, i]] = scale * state_gradient[k, i] * STATE_UNITS[i]
    for k in range(len(control_hessian)):
        for i in range(CONTROLS):
            slot = pattern.control_hessians[k, i]
            on_change = CHANGE_WEIGHT + (idle if i == THETA_DOT else 0.0)
            values.cost[slot] = on_change + scale * control_hessian[k, i] * pattern.cost_scale[slot]
            column = pattern.control_columns[k, i]
            values.gradient[column] = scale * control_gradient[k, i] * CONTROL_UNITS[i]
        values.gradient[pattern.slack_columns[k]] = scale * options.slack * SLACK_UNIT


@kernel
def fill_curvature(
    cost: Out1, hessians: Index2, dynamics_rows: Index2, back: Array2, dual: Array1, scale: float
) -> None:
    """Add the dynamics' own curvature in the heading to P, after `fill` (docs/method.md).

    Turning stage k turns its whole way F - z_k in x and y, so the Lagrangian J + l' (F(z_k, u_k) - z_k+1) has

    (Q1)  d²L/dphi_k² = -(l_x (F_x - x_k) + l_y (F_y - y_k)),   l the multipliers lambda,

    besides Gauss-Newton's part: what a bulge costs that makes the way longer. Without it full steps
    overshoot in the shape of the way, and diverge where the steering rate is cheap. Negative values are
    left out, so P stays positive semi-definite. It moves no fixed point.

    Args:
        cost: of the `QpValues`; hessians, dynamics_rows: of the `QpPattern`.
        back: (N, 2) from the end of each stage to its begin, in x and y.
        dual: (m,) multipliers of the last QP, scaled units.
        scale: cost scale of this QP over that of the last.
    """
    for k in range(len(back)):
        rows = dynamics_rows[k + 1]
        bulge = dual[rows[X]] * back[k, X] / STATE_UNITS[X]
        bulge += dual[rows[Y]] * back[k, Y] / STATE_UNITS[Y]
        cost[hessians[k, _HEADING]] += scale * STATE_UNITS[PHI] ** 2 * max(bulge, 0.0)


@inner
def _fill_dynamics(values: QpValues, pattern: QpPattern, step: ModelStep, stages: PlanStages) -> None:
    """dF/dz, dF/du, and the defects of the states."""
    (states, _, lengths), (reached, pose_by) = stages, step
    scale, causes = pattern.constraint_scale, pose_by.shape[2]
    for k in range(len(lengths)):
        for i in range(POSE):
            for j in range(causes):
                slot = pattern.poses[k, i * causes + j]
                values.constraints[slot] = pose_by[k, i, j] * scale[slot]
        for i in range(CONTROLS):
            slot = pattern.driven[k, i]
            values.constraints[slot] = lengths[k] * scale[slot]
        for i in range(STATES):
            row = pattern.dynamics_rows[k + 1, i]
            values.lower[row] = values.upper[row] = (states[k + 1, i] - reached[k, i]) / STATE_UNITS[i]


@inner
def _row_scaling(distance: float, scaled_from: float) -> float:
    """Factor on the unit of a row whose bound is at `distance`, in this unit."""
    return min(max(distance / scaled_from, 1.0), ROW_SCALING_MOST)


@inner
def _fill_bounds(
    values: QpValues, pattern: QpPattern, bounds: StageBounds, stages: PlanStages, options: FillOptions
) -> None:
    """The bounds on the changes of states and controls."""
    states, controls, _ = stages
    for kind in range(2):
        limits = bounds.states if kind == 0 else bounds.controls
        for k in range(len(controls)):
            for i in range(CONTROLS):
                here = states[k + 1, BOUNDED[i]] if kind == 0 else controls[k, i]
                low = (limits[k, 0, i] - here) / pattern.bound_units[kind, i]
                high = (limits[k, 1, i] - here) / pattern.bound_units[kind, i]
                by = _row_scaling(min(high, -low), options.scaled_from)
                slot, row = pattern.bounds[kind, k, i], pattern.bound_rows[kind, k, i]
                values.constraints[slot] = pattern.constraint_scale[slot] / by
                values.row_scaling[row], values.lower[row], values.upper[row] = by, low / by, high / by


@inner
def _fill_end(values: QpValues, pattern: QpPattern, problem: HorizonProblem, scale: float) -> None:
    """(T5), and how the bounds on the acceleration move with dT, after `_fill_bounds`."""
    end, by_time, controls = problem.end, problem.bounds.by_time, problem.stages.controls
    column, slot, row = pattern.time_column[0], pattern.time_hessian[0], pattern.time_row[0]
    values.gradient[column] = scale * end.gradient * TIME_UNIT
    values.cost[slot] = CHANGE_WEIGHT + scale * end.curvature * pattern.cost_scale[slot]
    unit = BOUND_UNIT * TIME_UNIT
    values.lower[row], values.upper[row] = end.least / unit, end.most / unit
    free = len(end.stretches) > 0
    for k in range(len(pattern.stretches)):
        for i in range(pattern.stretches.shape[1]):
            slot = pattern.stretches[k, i]
            values.constraints[slot] = end.stretches[k, i] * pattern.constraint_scale[slot] if free else 0.0
        slot, by = pattern.bounds_by_time[k], values.row_scaling[pattern.bound_rows[1, k, A]]
        grows = -by_time[k] if controls[k, A] > 0.0 else by_time[k]
        values.constraints[slot] = grows * pattern.constraint_scale[slot] / by if free else 0.0


@inner
def _fill_half_planes(values: QpValues, pattern: QpPattern, rows: CorridorRows, options: FillOptions) -> None:
    """A loose half-plane has no slopes, but still a relief, which keeps the pattern."""
    slopes, lower = rows
    stages, pieces, sides = pattern.corridor_rows.shape
    scale = pattern.constraint_scale
    for k in range(stages):
        for piece in range(pieces):
            for side in range(sides):
                row, slots = pattern.corridor_rows[k, piece, side], pattern.half_planes[k, piece, side]
                acts = side < lower.shape[2]
                bound = lower[k, piece, side] if acts else LOOSE
                by = _row_scaling(-bound, options.scaled_from)
                for i in range(POSE):
                    slope = slopes[k, piece, side, i] * scale[slots[i]] if acts else 0.0
                    values.constraints[slots[i]] = slope / by
                values.constraints[slots[POSE]] = scale[slots[POSE]] / by
                values.row_scaling[row], values.lower[row] = by, bound / by


def fill_corridor_bounds(values: QpValues, pattern: QpPattern, lower: Array) -> None:
    """Feedback phase: other lower bounds (N, pieces, sides) [m] of the half-planes that were filled last."""
    rows = pattern.corridor_rows[:, :, : lower.shape[2]]
    values.lower[rows] = lower / values.row_scaling[rows]


@kernel
def fill_motion_bounds(
    values: QpValues, bound_rows: tuple[Index3, Array2], stages: PlanStages, bounds: StageBounds,
    measured: Array1, comfort: Comfort,
) -> None:  # fmt: skip
    """Feedback phase: widen bounds on v and delta as far as the measured state (6,), and bounds on the
    acceleration, need it.

    Args:
        bound_rows: with their `bound_units`, of the `QpPattern`: all of it would take too long to hand over.
        stages, bounds: of the problem that was filled last.
        comfort: with which v and delta must return: just outside a limit, at rest say, more would be a jerk.
    """
    lower, upper, (all_rows, units) = values.lower, values.upper, bound_rows
    for column in range(2):
        quantity, most = (V, comfort.acceleration) if column == 0 else (DELTA, comfort.steering_rate)
        least, highest = measured[quantity], measured[quantity]
        rows = all_rows[0, :, column]
        for k in range(len(rows)):
            # As far as comfort and the control's own bounds bring it down, and up.
            least += max(bounds.controls[k, 0, column], -most) * stages.lengths[k]
            highest += min(bounds.controls[k, 1, column], most) * stages.lengths[k]
            if least <= bounds.states[k, 1, column] and highest >= bounds.states[k, 0, column]:
                continue
            unit = units[0, column] * values.row_scaling[rows[k]]
            about = stages.states[k + 1, quantity]
            upper[rows[k]] = max(upper[rows[k]], (least - about) / unit)
            lower[rows[k]] = min(lower[rows[k]], (highest - about) / unit)


def fill_initial(values: QpValues, pattern: QpPattern, change: Array) -> None:
    """Feedback phase: the measured state (6,) minus the linearised one."""
    rows = pattern.dynamics_rows[0]
    values.lower[rows] = values.upper[rows] = change / STATE_UNITS
