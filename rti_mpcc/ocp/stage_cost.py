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

from typing import NamedTuple

import numpy as np
from scipy.special import expit

from geometry import HalfPlanes, Pose2
from rti_mpcc.config import Comfort
from rti_mpcc.model.layout import CONTROLS, DELTA, DELTA_DOT, PHI, STATES, THETA, THETA_DOT, A, V, X, Y
from rti_mpcc.ocp.frenet import FrenetErrors
from rti_mpcc.ocp.objectives import COMFORT_CLIP, COMFORT_EASE, GOAL_CLIP, StageWeights, WeightSlopes
from rti_mpcc.types import Array

BOUND_DISTANCE = 2.0
"""Distance of the rear axle to a boundary below which `Weights.bound_distance` acts [m]."""
BOUND_SPEED = 2.5
"""The same for `Weights.bound_speed` [m]."""


NOTHING_LEFT = -6.0
"""So many c of (C4) below comfort its residual is a quarter of a percent of c, and left out."""


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
    errors: FrenetErrors,
    walls: HalfPlanes | None,
    goal: Pose2,
    wheelbase: float,
    comfort: Comfort,
) -> QuadraticCost:
    """The model about `states` (N+1, 6) and `controls` (N, 3), Eq. (C1)-(C4).

    Args:
        walls: nearest boundaries of the rear axle (N+1 points), where the soft distance acts.
        goal: what the last stage is to reach, in the frame and on the branch of `states`.
    """
    lateral, lateral_by = _lateral_acceleration(states, wheelbase)
    discomfort, excess, slope = _discomfort(
        lateral, comfort.lateral_acceleration, weights.comfort.lateral_acceleration
    )
    rows = [
        (weights.lag, errors.lag, errors.lag_by),
        (weights.contouring, errors.contouring, errors.contouring_by),
        (weights.heading, errors.heading, errors.heading_by),
        (weights.lateral_acceleration, lateral, lateral_by),
        (discomfort, excess, slope[:, None] * lateral_by),
    ]
    if walls is not None:
        for side in range(2):
            rows += _soft_walls(states, walls, side, weights)
    rows = [row for row in rows if row[0].any()]
    hessian = np.zeros((len(states), STATES, STATES))
    gradient = np.zeros((len(states), STATES))
    if rows:
        by = np.stack([row[2] for row in rows], axis=1)
        weighted = 2.0 * np.stack([row[0] for row in rows], axis=1)[:, :, None] * by
        residual = np.stack([row[1] for row in rows], axis=1)
        hessian += np.matmul(weighted.transpose(0, 2, 1), by)
        gradient += np.matmul(residual[:, None, :], weighted)[:, 0]
    if weights.by_progress is not None:
        gradient[:, THETA] += _blending(weights.by_progress, controls, errors, walls)
    _add_goal(hessian, gradient, states[-1], weights, goal)
    return QuadraticCost(hessian, gradient, *_control_cost(controls, weights, comfort))


def _blending(slopes: WeightSlopes, controls: Array, errors: FrenetErrors, walls: HalfPlanes | None) -> Array:
    """What the cost of each stage (N+1,) gains by progress as its weights change with it."""
    gain: Array = slopes.contouring * errors.contouring**2 + slopes.heading * errors.heading**2
    if walls is not None:
        near = np.maximum(BOUND_DISTANCE - walls.distance[:, :2], 0.0)
        gain += slopes.bound_distance * (near**2).sum(axis=1)
    gain[:-1] -= slopes.progress_reward[:-1] * controls[:, THETA_DOT]
    return gain


def _lateral_acceleration(states: Array, wheelbase: float) -> tuple[Array, Array]:
    v, tangent = states[:, V], np.tan(states[:, DELTA])
    by = np.zeros((len(states), STATES))
    by[:, V] = 2.0 * v * tangent / wheelbase
    by[:, DELTA] = v**2 * (1.0 + tangent**2) / wheelbase
    return v**2 * tangent / wheelbase, by


def _discomfort(values: Array, most: float, weights: Array) -> tuple[Array, Array, Array]:
    """Weights, residuals and their slopes of (C4) at `values` (n,); weights that fall off beyond the clip
    make its square linear there."""
    ease = COMFORT_EASE * most
    beyond = (np.abs(values) - most) / ease
    excess = ease * np.logaddexp(0.0, beyond)
    acting = weights * (beyond > NOTHING_LEFT) * COMFORT_CLIP / np.maximum(excess, COMFORT_CLIP)
    return acting, excess, np.sign(values) * expit(beyond)


def _soft_walls(
    states: Array, walls: HalfPlanes, side: int, weights: StageWeights
) -> list[tuple[Array, Array, Array]]:
    """Residuals max(0, 2 m - distance) and v max(0, 2.5 m - distance) of the rear axle to one side."""
    distance, normal = walls.distance[:, side], walls.normal[:, side]
    near, slow = np.maximum(BOUND_DISTANCE - distance, 0.0), np.maximum(BOUND_SPEED - distance, 0.0)
    near_by, slow_by = np.zeros((2, len(states), STATES))
    near_by[:, [X, Y]] = -normal * (near > 0.0)[:, None]
    slow_by[:, [X, Y]] = -normal * (states[:, V] * (slow > 0.0))[:, None]
    slow_by[:, V] = slow
    return [(weights.bound_distance, near, near_by), (weights.bound_speed, states[:, V] * slow, slow_by)]


def _add_goal(hessian: Array, gradient: Array, last: Array, weights: StageWeights, goal: Pose2) -> None:
    error = np.array([last[X] - goal.x, last[Y] - goal.y, last[PHI] - goal.phi])
    if weights.goal_clipped:
        error[:2] *= min(1.0, GOAL_CLIP[0] / max(float(np.hypot(error[0], error[1])), 1e-12))
        error[2] = np.clip(error[2], -GOAL_CLIP[1], GOAL_CLIP[1])
    pose = [X, Y, PHI]
    hessian[-1, pose, pose] += 2.0 * weights.goal
    gradient[-1, pose] += 2.0 * weights.goal * error
    hessian[-1, V, V] += 2.0 * weights.goal_speed
    gradient[-1, V] += 2.0 * weights.goal_speed * last[V]


def _control_cost(controls: Array, weights: StageWeights, comfort: Comfort) -> tuple[Array, Array]:
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
        weight, excess, slope = _discomfort(controls[:, column], most, on_excess)
        gradient[:, column] += 2.0 * weight * excess * slope
        squares[:, column] += weight * slope**2
    return 2.0 * squares, gradient
