"""Quadratic models of the cost: Gauss-Newton on every residual, exact gradient.

(C1)  stage:    q_l e_l² + q_c e_c² + q_phi e_phi² + q_lat a_lat² + soft distance to the boundaries
(C2)  control:  r_a a² + r_delta delta_dot² + r_theta theta_dot² - gamma theta_dot
(C3)  end:      |z_N - goal|² with q_N on position and heading, beyond the clip linear; q_v v_N²
(C4)  comfort:  q_comfort e² for f = a_lat of a stage, a and delta_dot of a control, beyond the clip linear;
                e = max(0, |f| - f_comfort) rounded off: e = c log(1 + exp((|f| - f_comfort) / c))

q_c, q_phi, gamma and the weight of the soft distance are functions of their stage's theta where sigma blends
them; their slopes are in the gradient.
"""

from __future__ import annotations

from math import hypot
from typing import NamedTuple

import numpy as np
from scipy.special import expit

from geometry import HalfPlanes, Pose2
from rti_mpcc.config import Comfort, Weights
from rti_mpcc.model.layout import CONTROLS, DELTA, DELTA_DOT, PHI, STATES, THETA, THETA_DOT, A, V, X, Y
from rti_mpcc.ocp.frenet import FrenetErrors
from rti_mpcc.ocp.objectives import StageWeights, WeightSlopes
from rti_mpcc.types import Array

NOTHING_LEFT = -6.0
"""So many c of (C4) below comfort its residual is a quarter of a percent of c, and left out."""


Residual = tuple[Array, Array, Array]
"""Weights (n,), values (n,) and slopes (n, ...) of one squared term."""


class QuadraticCost(NamedTuple):
    """Hessian and gradient of the cost in the change of states and controls (there diagonal)."""

    state_hessian: Array  # (N+1, 6, 6)
    state_gradient: Array  # (N+1, 6)
    control_hessian: Array  # (N, 3)
    control_gradient: Array  # (N, 3)


def quadratic_cost(
    states: Array,
    controls: Array,
    weights: StageWeights,
    errors: FrenetErrors | None,
    walls: HalfPlanes | None,
    goal: Pose2,
    wheelbase: float,
    comfort: Comfort,
    settings: Weights,
) -> QuadraticCost:
    """The model about `states` (N+1, 6) and `controls` (N, 3), paper Eq. 2 (C3) and Eq. 5 (C1), (C2); (C4).

    Args:
        errors: at `states`; None where no weight is on them.
        walls: nearest boundaries of the rear axle (N+1 points), where the soft distance acts.
        goal: what the last stage is to reach, in the frame and on the branch of `states`.
        settings: from where on terms act, and where they are clipped; what they weigh is in `weights`.
    """
    hessian = np.zeros((len(states), STATES, STATES))
    gradient = np.zeros((len(states), STATES))
    if errors is not None:
        frenet = np.stack((weights.lag, weights.contouring, weights.heading), axis=1)
        _add_squares(hessian, gradient, frenet, errors.values, errors.slopes)
    rows = _lateral(states, weights, wheelbase, comfort.lateral_acceleration, settings)
    if walls is not None:
        for side in range(2):
            rows += _soft_walls(states, walls, side, weights, settings)
    if rows:
        columns = ([row[i] for row in rows] for i in range(3))
        _add_squares(hessian, gradient, *(np.stack(column, axis=1) for column in columns))
    if weights.by_progress is not None and errors is not None:
        gradient[:, THETA] += _blending(weights.by_progress, controls, errors, walls, settings)
    _add_goal(hessian, gradient, states[-1], weights, goal, settings.goal_clip)
    return QuadraticCost(hessian, gradient, *_control_cost(controls, weights, comfort, settings))


def _blending(
    slopes: WeightSlopes, controls: Array, errors: FrenetErrors, walls: HalfPlanes | None, settings: Weights
) -> Array:
    """What the cost of each stage (N+1,) gains by progress as its weights change with it."""
    gain: Array = slopes.contouring * errors.contouring**2 + slopes.heading * errors.heading**2
    if walls is not None:
        near = np.maximum(settings.bound_distance_reach - walls.distance[:, :2], 0.0)
        gain += slopes.bound_distance * (near**2).sum(axis=1)
    gain[:-1] -= slopes.progress_reward[:-1] * controls[:, THETA_DOT]
    return gain


def _add_squares(hessian: Array, gradient: Array, weights: Array, residuals: Array, slopes: Array) -> None:
    """Add w e² for each of r residuals: weights and residuals (N+1, r), slopes (N+1, r, 6)."""
    weighted = 2.0 * weights[:, :, None] * slopes
    hessian += np.matmul(weighted.transpose(0, 2, 1), slopes)
    gradient += np.matmul(residuals[:, None, :], weighted)[:, 0]


def _lateral(
    states: Array, weights: StageWeights, wheelbase: float, most: float, settings: Weights
) -> list[Residual]:
    """Residuals of the lateral acceleration and of its excess over `most`, as far as they count."""
    weighs, comfortable = weights.lateral_acceleration.any(), weights.comfort.lateral_acceleration
    v, tangent = states[:, V], np.tan(states[:, DELTA])
    lateral = v * v * tangent / wheelbase
    excess = _discomfort(lateral, most, comfortable, settings)
    if not weighs and excess is None:
        return []
    by = np.zeros((len(states), STATES))
    by[:, V] = 2.0 * v * tangent / wheelbase
    by[:, DELTA] = v**2 * (1.0 + tangent**2) / wheelbase
    rows = [(weights.lateral_acceleration, lateral, by)] if weighs else []
    if excess is not None:
        rows.append((excess[0], excess[1], excess[2][:, None] * by))
    return rows


def _discomfort(values: Array, most: float, weights: Array, settings: Weights) -> Residual | None:
    """Weights, residuals and their slopes of (C4) at `values` (n,); weights that fall off beyond the clip
    make its square linear there. None if nothing comes near `most`."""
    ease, clip = settings.comfort_ease * most, settings.comfort_clip
    size = np.abs(values)
    if float(size.max(initial=0.0)) <= most + NOTHING_LEFT * ease:
        return None
    beyond = (size - most) / ease
    excess = ease * np.logaddexp(0.0, beyond)
    acting = weights * (beyond > NOTHING_LEFT) * clip / np.maximum(excess, clip)
    return (acting, excess, np.sign(values) * expit(beyond)) if acting.any() else None


def _soft_walls(
    states: Array, walls: HalfPlanes, side: int, weights: StageWeights, settings: Weights
) -> list[Residual]:
    """Residuals max(0, reach - distance) and v max(0, reach - distance) of the rear axle to one side."""
    distance, normal = walls.distance[:, side], walls.normal[:, side]
    near = np.maximum(settings.bound_distance_reach - distance, 0.0)
    slow = np.maximum(settings.bound_speed_reach - distance, 0.0)
    near_by, slow_by = np.zeros((2, len(states), STATES))
    near_by[:, [X, Y]] = -normal * (near > 0.0)[:, None]
    slow_by[:, [X, Y]] = -normal * (states[:, V] * (slow > 0.0))[:, None]
    slow_by[:, V] = slow
    rows = [(weights.bound_distance, near, near_by), (weights.bound_speed, states[:, V] * slow, slow_by)]
    return [row for row in rows if row[0].any()]


def _add_goal(
    hessian: Array,
    gradient: Array,
    last: Array,
    weights: StageWeights,
    goal: Pose2,
    clip: tuple[float, float],
) -> None:
    x, y, phi, v = (float(last[i]) for i in (X, Y, PHI, V))
    dx, dy, turn = x - goal.x, y - goal.y, phi - goal.phi
    if weights.goal_clipped:
        share = min(1.0, clip[0] / max(hypot(dx, dy), 1e-12))
        dx, dy, turn = share * dx, share * dy, min(max(turn, -clip[1]), clip[1])
    on_pose = weights.goal.tolist()
    for i, weight, error in zip(
        (X, Y, PHI, V), (*on_pose, weights.goal_speed), (dx, dy, turn, v), strict=True
    ):
        hessian[-1, i, i] += 2.0 * weight
        gradient[-1, i] += 2.0 * weight * error


def _control_cost(
    controls: Array, weights: StageWeights, comfort: Comfort, settings: Weights
) -> tuple[Array, Array]:
    squares = np.empty((len(controls), CONTROLS))
    squares[:, A] = weights.acceleration
    squares[:, DELTA_DOT] = weights.steering_rate
    squares[:, THETA_DOT] = weights.virtual_speed
    gradient = 2.0 * squares * controls
    gradient[:, THETA_DOT] -= weights.progress_reward
    for column, most, on_excess in (
        (A, comfort.acceleration, weights.comfort.acceleration),
        (DELTA_DOT, comfort.steering_rate, weights.comfort.steering_rate),
    ):
        residual = _discomfort(controls[:, column], most, on_excess, settings)
        if residual is not None:
            weight, excess, slope = residual
            gradient[:, column] += 2.0 * weight * excess * slope
            squares[:, column] += weight * slope**2
    return 2.0 * squares, gradient
