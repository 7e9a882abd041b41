"""Quadratic models of the cost: Gauss-Newton on every residual, exact gradient.

(C1)  stage:    q_l e_l² + q_c e_c² + q_phi e_phi² + q_lat a_lat² + soft distance to the boundaries
(C2)  control:  r_a a² + r_delta delta_dot² + r_theta theta_dot² - gamma theta_dot
(C3)  end:      |z_N - goal|² with q_N on position and heading, beyond the clip linear; q_v v_N²;
               q_w (delta_N - wheels)² where the next segment begins with such an angle
(C4)  comfort:  q_comfort e² for f = a_lat of a stage, a and delta_dot of a control, beyond the clip linear;
                e = max(0, |f| - f_comfort) rounded off: e = c log(1 + exp((|f| - f_comfort) / c))

q_c, q_phi, gamma and the weight of the soft distance are functions of their stage's theta where sigma blends
them; their slopes are in the gradient.
"""

from __future__ import annotations

from math import exp, hypot, log1p, tan
from typing import NamedTuple

import numpy as np

from geometry import Pose2
from geometry.compiled import Array1, Array2, Array3, Out2, Out3, inner, kernel
from rti_mpcc.config import Comfort, Weights
from rti_mpcc.model.layout import CONTROLS, DELTA, DELTA_DOT, PHI, STATES, THETA, THETA_DOT, A, V, X, Y
from rti_mpcc.ocp.frenet import CONTOURING, HEADING, FrenetErrors
from rti_mpcc.ocp.objectives import StageWeights
from rti_mpcc.types import Array

NOTHING_LEFT = -6.0
"""So many c of (C4) below comfort its residual is a quarter of a percent of c, and left out."""


class SoftWalls(NamedTuple):
    """Signed distances (N+1, 2) of the rear axle to the left and the right [m], normals (N+1, 2, 2)."""

    distance: Array
    normal: Array


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
    walls: SoftWalls | None,
    goal: Pose2,
    wheelbase: float,
    comfort: Comfort,
    settings: Weights,
    wheels: float = 0.0,
) -> QuadraticCost:
    """The model about `states` (N+1, 6) and `controls` (N, 3), paper Eq. 2 (C3) and Eq. 5 (C1), (C2); (C4).

    Args:
        errors: at `states`; None where no weight is on them.
        walls: of the rear axle, where the soft distance acts.
        goal: what the last stage is to reach, in the frame and on the branch of `states`.
        settings: from where on terms act, and where they are clipped; what they weigh is in `weights`.
        wheels: angle that the wheels are to have at the last stage, where a weight is on it [rad].
    """
    hessian = np.zeros((len(states), STATES, STATES))
    gradient = np.zeros((len(states), STATES))
    control_hessian, control_gradient = np.empty((2, len(controls), CONTROLS))
    ease, clip, beyond = settings.comfort_ease, settings.comfort_clip, weights.comfort
    if errors is not None:
        on_errors = np.stack((weights.lag, weights.contouring, weights.heading))
        _add_errors(errors.values, errors.slopes, on_errors, hessian, gradient)
    lateral = weights.lateral_acceleration, beyond.lateral_acceleration, comfort.lateral_acceleration
    _add_lateral(states, *lateral, ease, clip, wheelbase, hessian, gradient)
    reaches = settings.bound_distance_reach, settings.bound_speed_reach
    if walls is not None:
        on_walls = weights.bound_distance, weights.bound_speed
        _add_walls(states, walls.distance, walls.normal, *on_walls, *reaches, hessian, gradient)
    slopes = weights.by_progress
    if slopes is not None and errors is not None:
        _add_slopes(
            errors.values, controls, slopes.contouring, slopes.heading, slopes.progress_reward, gradient
        )
        if walls is not None:
            _add_wall_slopes(walls.distance, slopes.bound_distance, reaches[0], gradient)
    pull = np.array((goal.x, goal.y, goal.phi))
    clip_goal = settings.goal_clip if weights.goal_clipped else (np.inf, np.inf)
    at_end = weights.goal_speed, weights.goal_wheels, wheels
    _add_goal(states[-1], pull, weights.goal, *at_end, *clip_goal, hessian, gradient)
    on_controls = weights.acceleration, weights.steering_rate, weights.virtual_speed
    _control_cost(controls, *on_controls, weights.progress_reward, control_hessian, control_gradient)
    for column, most, on_excess in (
        (A, comfort.acceleration, beyond.acceleration),
        (DELTA_DOT, comfort.steering_rate, beyond.steering_rate),
    ):
        _add_discomfort(controls, column, on_excess, most, ease, clip, control_hessian, control_gradient)
    return QuadraticCost(hessian, gradient, control_hessian, control_gradient)


@inner
def _add_square(
    hessian: Array, gradient: Array, k: int, weight: float, residual: float, slopes: Array
) -> None:
    """Add w e² of stage k, `slopes` (6,) being those of e."""
    for i in range(STATES):
        if slopes[i] == 0.0:
            continue
        gradient[k, i] += 2.0 * weight * residual * slopes[i]
        for j in range(STATES):
            hessian[k, i, j] += 2.0 * weight * slopes[i] * slopes[j]


@kernel
def _add_errors(values: Array2, slopes: Array3, weights: Array2, hessian: Out3, gradient: Out2) -> None:
    """The Frenet errors of (C1), `weights` (3, N+1)."""
    for k in range(len(values)):
        for error in range(3):
            _add_square(hessian, gradient, k, weights[error, k], values[k, error], slopes[k, error])


@inner
def _discomfort(
    value: float, weight: float, most: float, ease: float, clip: float
) -> tuple[float, float, float]:
    """Weight, residual and its slope of (C4); a weight that falls off beyond the clip makes the square linear
    there."""
    rounding = ease * most
    beyond = (abs(value) - most) / rounding
    if beyond <= NOTHING_LEFT:
        return 0.0, 0.0, 0.0
    decayed = exp(-abs(beyond))
    excess = rounding * (max(beyond, 0.0) + log1p(decayed))
    slope = (1.0 if beyond >= 0.0 else decayed) / (1.0 + decayed)
    return weight * clip / max(excess, clip), excess, slope if value > 0.0 else -slope


@kernel
def _add_lateral(
    states: Array2,
    weights: Array1,
    on_excess: Array1,
    most: float,
    ease: float,
    clip: float,
    wheelbase: float,
    hessian: Out3,
    gradient: Out2,
) -> None:
    """The lateral acceleration of (C1), and its excess (C4)."""
    slopes = np.zeros(STATES)
    for k in range(len(states)):
        v, tangent = states[k, V], tan(states[k, DELTA])
        lateral = v * v * tangent / wheelbase
        by_v, by_delta = 2.0 * v * tangent / wheelbase, v * v * (1.0 + tangent * tangent) / wheelbase
        slopes[V], slopes[DELTA] = by_v, by_delta
        _add_square(hessian, gradient, k, weights[k], lateral, slopes)
        weight, excess, slope = _discomfort(lateral, on_excess[k], most, ease, clip)
        slopes[V], slopes[DELTA] = slope * by_v, slope * by_delta
        _add_square(hessian, gradient, k, weight, excess, slopes)


@kernel
def _add_walls(
    states: Array2,
    distances: Array2,
    normals: Array3,
    on_distance: Array1,
    on_speed: Array1,
    reach: float,
    speed_reach: float,
    hessian: Out3,
    gradient: Out2,
) -> None:
    """max(0, reach - distance) and v max(0, reach - distance) of the rear axle to the left and the right."""
    slopes = np.zeros(STATES)
    for k in range(len(states)):
        for side in range(2):
            v = states[k, V]
            near = max(reach - distances[k, side], 0.0)
            slow = max(speed_reach - distances[k, side], 0.0)
            slopes[:] = 0.0
            if near > 0.0:
                slopes[X], slopes[Y] = -normals[k, side, X], -normals[k, side, Y]
                _add_square(hessian, gradient, k, on_distance[k], near, slopes)
            if slow > 0.0:
                slopes[X], slopes[Y] = -normals[k, side, X] * v, -normals[k, side, Y] * v
                slopes[V] = slow
                _add_square(hessian, gradient, k, on_speed[k], v * slow, slopes)


@kernel
def _add_slopes(
    errors: Array2,
    controls: Array2,
    contouring: Array1,
    heading: Array1,
    progress_reward: Array1,
    gradient: Out2,
) -> None:
    """What the cost of each stage gains by progress as its weights change with it."""
    for k in range(len(errors)):
        gain = contouring[k] * errors[k, CONTOURING] ** 2 + heading[k] * errors[k, HEADING] ** 2
        if k < len(controls):
            gain -= progress_reward[k] * controls[k, THETA_DOT]
        gradient[k, THETA] += gain


@kernel
def _add_wall_slopes(distances: Array2, bound_distance: Array1, reach: float, gradient: Out2) -> None:
    """The same of the soft distance to the walls."""
    for k in range(len(distances)):
        for side in range(2):
            gradient[k, THETA] += bound_distance[k] * max(reach - distances[k, side], 0.0) ** 2


@kernel
def _control_cost(
    controls: Array2,
    acceleration: Array1,
    steering_rate: Array1,
    virtual_speed: Array1,
    progress_reward: Array1,
    hessian: Out2,
    gradient: Out2,
) -> None:
    """Equation (C2)."""
    for k in range(len(controls)):
        hessian[k, A] = 2.0 * acceleration[k]
        hessian[k, DELTA_DOT] = 2.0 * steering_rate[k]
        hessian[k, THETA_DOT] = 2.0 * virtual_speed[k]
        for j in range(CONTROLS):
            gradient[k, j] = hessian[k, j] * controls[k, j]
        gradient[k, THETA_DOT] -= progress_reward[k]


@kernel
def _add_discomfort(
    controls: Array2,
    column: int,
    weights: Array1,
    most: float,
    ease: float,
    clip: float,
    hessian: Out2,
    gradient: Out2,
) -> None:
    """What goes beyond comfort of one control, (C4)."""
    for k in range(len(controls)):
        weight, excess, slope = _discomfort(controls[k, column], weights[k], most, ease, clip)
        gradient[k, column] += 2.0 * weight * excess * slope
        hessian[k, column] += 2.0 * weight * slope**2


@kernel
def _add_goal(
    last: Array1,
    goal: Array1,
    weights: Array1,
    on_speed: float,
    on_wheels: float,
    wheels: float,
    most_position: float,
    most_heading: float,
    hessian: Out3,
    gradient: Out2,
) -> None:
    """Equation (C3), `weights` (3,) on the pose, the `goal` (3,), the angle of the `wheels`; `most_...`: the
    clip."""
    end = len(gradient) - 1
    dx, dy, turn = last[X] - goal[X], last[Y] - goal[Y], last[PHI] - goal[PHI]
    share = min(1.0, most_position / max(hypot(dx, dy), 1e-12))
    turn = min(max(turn, -most_heading), most_heading)
    for i, weight, error in (
        (X, weights[X], share * dx),
        (Y, weights[Y], share * dy),
        (PHI, weights[PHI], turn),
        (V, on_speed, last[V]),
        (DELTA, on_wheels, last[DELTA] - wheels),
    ):
        hessian[end, i, i] += 2.0 * weight
        gradient[end, i] += 2.0 * weight * error
