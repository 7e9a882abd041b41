"""Quadratic models of the cost: Gauss-Newton on every residual, exact gradient.

(C1)  stage:    q_l e_l² + q_c e_c² + q_phi e_phi²
(C2)  control:  r_a a² + r_delta delta_dot² + r_theta theta_dot² - gamma theta_dot
(C3)  end:      |z_N - goal|² with q_N on position and heading, beyond the clip linear; q_v v_N²;
               q_w (delta_N - wheels)² where the next segment starts with such an angle
(C4)  comfort:  q_comfort e² for f = a_lat of a stage, a and delta_dot of a control, beyond the clip linear;
                e = max(0, |f| - f_comfort) rounded off: e = f_s log(1 + exp((|f| - f_comfort) / f_s))
"""

from __future__ import annotations

from collections.abc import Callable
from math import exp, hypot, log1p, tan
from typing import NamedTuple

import numpy as np

from geometry.compiled import Array1, Array2, Array3, Out2, Out3, inner, kernel
from rti_mpcc.config import Comfort
from rti_mpcc.model.layout import CONTROLS, DELTA, DELTA_DOT, PHI, STATES, THETA_DOT, A, V, X, Y
from rti_mpcc.ocp.frenet import FrenetErrors
from rti_mpcc.ocp.objectives import GOAL_CLIP, StageWeights
from rti_mpcc.types import Array

COMFORT_EASE = 0.05
"""Share of a comfort value over which its penalty sets in, (C4): f_s = 0.05 f_comfort. A penalty that starts
at once makes the plans of successive cycles jump to and fro across it."""
COMFORT_CLIP = 0.1
"""What goes beyond comfort costs its square up to here, in its own units, then linearly: comfort gives way to
the corridor and the goal."""
NOTHING_LEFT = -6.0
"""In units of f_s of (C4): this far below comfort the residual is 0.0025 f_s, and left out."""

Terms = Callable[[Array, Array], None]
"""Adds terms of an objective's own to the Hessian and the gradient of the states."""


class QuadraticCost(NamedTuple):
    """Hessian and gradient of the cost in the change of states and controls (there diagonal)."""

    state_hessian: Out3  # (N+1, 6, 6)
    state_gradient: Out2  # (N+1, 6)
    control_hessian: Out2  # (N, 3)
    control_gradient: Out2  # (N, 3)


class Residual(NamedTuple):
    """What a `CostTerm` adds: w e² at each stage.

    Attributes:
        weights, values: w and e (N+1,), w >= 0; by_state: slopes of e (N+1, 6).
        by_control: and of stages 0..N-1 (N, 3), or None: e knows states alone.
    """

    weights: Array
    values: Array
    by_state: Array
    by_control: Array | None = None


def add_residual(cost: QuadraticCost, residual: Residual) -> None:
    """Add w e², in place: its gradient is exact.

    The QP has no room for products of states and controls. Where e knows both, twice the square of each is
    an upper bound of their sum's: iterations converge to the same plan.
    """
    weights, values, by_state, by_control = residual
    on_both = 1.0 if by_control is None else 2.0
    slopes = np.sqrt(2.0 * on_both * weights)[:, None] * by_state
    cost.state_hessian[:] += slopes[:, :, None] * slopes[:, None, :]
    cost.state_gradient[:] += (2.0 * weights * values)[:, None] * by_state
    if by_control is not None:
        pull = (2.0 * weights)[:-1, None] * by_control
        cost.control_hessian[:] += on_both * pull * by_control
        cost.control_gradient[:] += pull * values[:-1, None]


def quadratic_cost(
    states: Array,
    controls: Array,
    weights: StageWeights,
    errors: FrenetErrors | None,
    goal: Array,
    wheelbase: float,
    comfort: Comfort,
    *,
    wheels: float = 0.0,
    terms: Terms | None = None,
) -> QuadraticCost:
    """The model about `states` (N+1, 6) and `controls` (N, 3), paper Eq. 2 (C3) and Eq. 5 (C1), (C2); (C4).

    Args:
        errors: at `states`; None where no weight is on them.
        goal: (3,) pose that the last stage is to reach, in the frame and on the branch of `states`.
        wheels: angle that the wheels are to have at the last stage, where a weight is on it [rad].
        terms: of the objective's own; None: none.
    """
    hessian = np.zeros((len(states), STATES, STATES))
    gradient = np.zeros((len(states), STATES))
    if errors is not None:
        on_errors = np.stack((weights.lag, weights.contouring, weights.heading))
        _add_errors(*errors, on_errors, hessian, gradient)
    beyond = weights.comfort
    _add_lateral_excess(
        states, beyond.lateral_acceleration, comfort.lateral_acceleration, wheelbase, hessian, gradient
    )
    if terms is not None:
        terms(hessian, gradient)
    clip = GOAL_CLIP if weights.goal_clipped else (np.inf, np.inf)
    at_end = weights.goal_speed, weights.goal_wheels, wheels
    _add_goal(states[-1], goal, weights.goal, *at_end, *clip, hessian, gradient)
    on_controls = weights.acceleration, weights.steering_rate, weights.virtual_speed, weights.progress_reward
    on_excess = beyond.acceleration, comfort.acceleration, beyond.steering_rate, comfort.steering_rate
    return QuadraticCost(hessian, gradient, *_control_cost(controls, *on_controls, *on_excess))


@inner
def add_square(
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
            add_square(hessian, gradient, k, weights[error, k], values[k, error], slopes[k, error])


@inner
def _excess(value: float, weight: float, most: float) -> tuple[float, float, float]:
    """Weight, residual and its slope of (C4); a weight that falls off beyond the clip makes the square linear
    there."""
    rounding = COMFORT_EASE * most
    beyond = (abs(value) - most) / rounding
    if beyond <= NOTHING_LEFT:
        return 0.0, 0.0, 0.0
    decayed = exp(-abs(beyond))
    excess = rounding * (max(beyond, 0.0) + log1p(decayed))
    slope = (1.0 if beyond >= 0.0 else decayed) / (1.0 + decayed)
    return weight * COMFORT_CLIP / max(excess, COMFORT_CLIP), excess, slope if value > 0.0 else -slope


@inner
def excess_cost(value: float, weight: float, most: float) -> float:
    """What a value beyond `most` costs, (C4)."""
    clipped, excess, _ = _excess(value, weight, most)
    cost: float = clipped * excess * excess
    return cost


@kernel
def _add_lateral_excess(
    states: Array2, weights: Array1, most: float, wheelbase: float, hessian: Out3, gradient: Out2
) -> None:
    """The lateral acceleration beyond comfort, (C4)."""
    slopes = np.zeros(STATES)
    for k in range(len(states)):
        v, tangent = states[k, V], tan(states[k, DELTA])
        lateral = v * v * tangent / wheelbase
        weight, excess, slope = _excess(lateral, weights[k], most)
        slopes[V] = slope * (2.0 * v * tangent / wheelbase)
        slopes[DELTA] = slope * (v * v * (1.0 + tangent * tangent) / wheelbase)
        add_square(hessian, gradient, k, weight, excess, slopes)


@kernel
def _control_cost(
    controls: Array2,
    acceleration: Array1,
    steering_rate: Array1,
    virtual_speed: Array1,
    progress_reward: Array1,
    on_acceleration: Array1,
    most_acceleration: float,
    on_steering_rate: Array1,
    most_steering_rate: float,
) -> tuple[Out2, Out2]:
    """Hessian and gradient of (C2), and of what goes beyond comfort of a and delta_dot, (C4)."""
    hessian, gradient = np.empty(controls.shape), np.empty(controls.shape)
    for k in range(len(controls)):
        hessian[k, A] = 2.0 * acceleration[k]
        hessian[k, DELTA_DOT] = 2.0 * steering_rate[k]
        hessian[k, THETA_DOT] = 2.0 * virtual_speed[k]
        for j in range(CONTROLS):
            gradient[k, j] = hessian[k, j] * controls[k, j]
        gradient[k, THETA_DOT] -= progress_reward[k]
        for j, on_excess, most in (
            (A, on_acceleration[k], most_acceleration),
            (DELTA_DOT, on_steering_rate[k], most_steering_rate),
        ):
            weight, excess, slope = _excess(controls[k, j], on_excess, most)
            gradient[k, j] += 2.0 * weight * excess * slope
            hessian[k, j] += 2.0 * weight * slope**2
    return hessian, gradient


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
