"""Writes a linearised optimal control problem into the slots of the QP.

The QP is in the change of the trajectory. The cost is multiplied by a scale per objective that brings
its largest weight to about 1, which is what OSQP's absolute tolerance is meant for. A small weight on
the change keeps the QP strictly convex; on the change, not on the value, so it moves no fixed point.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rti_mpcc.model.bicycle import Step
from rti_mpcc.model.layout import DELTA, PHI, THETA, THETA_DOT, X, Y
from rti_mpcc.ocp.bounds import StageBounds
from rti_mpcc.ocp.corridor_rows import LOOSE, CorridorRows
from rti_mpcc.ocp.stage_cost import QuadraticCost
from rti_mpcc.qp.pattern import BOUNDED, CONTROL_SLOPES, HESSIAN_PAIRS, STATE_SLOPES, STATE_UNITS, QpPattern
from rti_mpcc.types import Array

CHANGE_WEIGHT = 1e-6
"""Weight on every change, in scaled units of variables and cost."""
IDLE_WEIGHT = 1e-2
"""Weight on the change of progress where no Frenet cost acts on it: it just goes on as planned."""

_DIAGONAL = HESSIAN_PAIRS[:, 0] == HESSIAN_PAIRS[:, 1]
_DAMPED = _DIAGONAL & np.isin(HESSIAN_PAIRS[:, 0], (X, Y, PHI, DELTA))
_HEADING = int(np.flatnonzero((HESSIAN_PAIRS == PHI).all(axis=1))[0])
_PROGRESS = int(np.flatnonzero((HESSIAN_PAIRS == THETA).all(axis=1))[0])


@dataclass(frozen=True, slots=True, kw_only=True)
class QpValues:
    """Numbers of one QP in scaled units; buffers that every cycle overwrites.

    Attributes:
        cost: (nnz P,); gradient: (n,); constraints: (nnz A,); lower, upper: (m,).
    """

    cost: Array
    gradient: Array
    constraints: Array
    lower: Array
    upper: Array


def empty_values(pattern: QpPattern) -> QpValues:
    """Buffers with the entries that never change."""
    rows, columns = pattern.constraints.shape
    values = QpValues(
        cost=pattern.cost.constant.copy(),
        gradient=np.zeros(columns),
        constraints=pattern.constraints.constant.copy(),
        lower=np.full(rows, -np.inf),
        upper=np.full(rows, np.inf),
    )
    values.lower[pattern.slack_rows] = 0.0
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
    slots = pattern.cost
    states = cost.state_hessian[:, HESSIAN_PAIRS[:, 0], HESSIAN_PAIRS[:, 1]]
    slots.write(values.cost, "states", scale * states)
    slots.write(values.cost, "controls", scale * cost.control_hessian)
    values.cost[slots.groups["states"][:, _DIAGONAL]] += CHANGE_WEIGHT
    values.cost[slots.groups["states"][:, _DAMPED]] += damping
    values.cost[slots.groups["controls"]] += CHANGE_WEIGHT
    if not cost.state_hessian[:, THETA, THETA].any():
        values.cost[slots.groups["states"][:, _PROGRESS]] += IDLE_WEIGHT
        values.cost[slots.groups["controls"][:, THETA_DOT]] += IDLE_WEIGHT
    values.cost[slots.groups["slacks"]] = CHANGE_WEIGHT
    units = pattern.column_units
    columns = pattern.state_columns
    values.gradient[columns] = scale * cost.state_gradient * units[columns]
    columns = pattern.control_columns
    values.gradient[columns] = scale * cost.control_gradient * units[columns]
    columns = pattern.slack_columns
    values.gradient[columns] = scale * slack * units[columns]


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
    force = dual[pattern.dynamics_rows[1:]][:, [X, Y]] / STATE_UNITS[[X, Y]]
    bulge = -(force * (reached - states)[:, [X, Y]]).sum(axis=1)
    slots = pattern.cost.groups["states"][:-1, _HEADING]
    values.cost[slots] += scale * np.maximum(bulge, 0.0) * STATE_UNITS[PHI] ** 2


def fill_dynamics(values: QpValues, pattern: QpPattern, step: Step, states: Array) -> None:
    """dF/dz, dF/du and the defects of `states` (N+1, 6)."""
    slots = pattern.constraints
    slots.write(values.constraints, "by state", step.by_state[:, STATE_SLOPES[:, 0], STATE_SLOPES[:, 1]])
    slots.write(
        values.constraints, "by control", step.by_control[:, CONTROL_SLOPES[:, 0], CONTROL_SLOPES[:, 1]]
    )
    rows = pattern.dynamics_rows[1:]
    values.lower[rows] = values.upper[rows] = (states[1:] - step.state) / pattern.row_units[rows]


def fill_bounds(
    values: QpValues, pattern: QpPattern, bounds: StageBounds, states: Array, controls: Array
) -> None:
    """Bounds on the changes of `states` (N+1, 6) and `controls` (N, 3)."""
    rows, bounded = pattern.state_rows, states[1:, BOUNDED]
    values.lower[rows] = (bounds.states[:, 0] - bounded) / pattern.row_units[rows]
    values.upper[rows] = (bounds.states[:, 1] - bounded) / pattern.row_units[rows]
    rows = pattern.control_rows
    values.lower[rows] = (bounds.controls[:, 0] - controls) / pattern.row_units[rows]
    values.upper[rows] = (bounds.controls[:, 1] - controls) / pattern.row_units[rows]


def fill_corridor(values: QpValues, pattern: QpPattern, rows: CorridorRows | None) -> None:
    """The half-planes of all discs; those of sides that the corridor no longer has, or all, are loose."""
    slopes = np.zeros((*pattern.corridor_rows.shape, 3))
    lower = np.full(pattern.corridor_rows.shape, LOOSE)
    if rows is not None:
        sides = rows.lower.shape[2]
        slopes[:, :, :sides], lower[:, :, :sides] = rows.slopes, rows.lower
    pattern.constraints.write(values.constraints, "half-planes", slopes)
    values.lower[pattern.corridor_rows] = lower


def fill_initial(values: QpValues, pattern: QpPattern, change: Array) -> None:
    """Feedback phase: the measured state (6,) minus the linearised one."""
    rows = pattern.dynamics_rows[0]
    values.lower[rows] = values.upper[rows] = change / pattern.row_units[rows]
