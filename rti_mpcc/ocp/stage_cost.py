"""Quadratic models of the cost: Gauss-Newton on every residual, exact gradient.

(C1)  stage:    q_l e_l² + q_c e_c² + q_phi e_phi²
(C2)  control:  r_a a² + r_delta delta_dot² + r_theta theta_dot² - gamma theta_dot
(C3)  end:      |z_N - goal|² with q_N on position and heading, beyond the clip linear; q_v v_N²;
               q_w (delta_N - wheels)² where the next segment starts with such an angle
(C4)  comfort:  q_comfort e² for f = a_lat of a stage, a and delta_dot of a control, beyond the clip linear;
                e = max(0, |f| - f_comfort) rounded off: e = f_s log(1 + exp((|f| - f_comfort) / f_s))
"""

from __future__ import annotations

from math import exp, hypot, log1p, tan
from typing import NamedTuple

import numpy as np

from geometry.compiled import Array1, Array2, Array3, Out2, Out3, inner, kernel
from rti_mpcc.config import Comfort
from rti_mpcc.model.layout import CONTROLS, DELTA, DELTA_DOT, PHI, STATES, THETA_DOT, A, V, X, Y
from rti_mpcc.ocp.frenet import FrenetErrors
from rti_mpcc.ocp.objectives import GOAL_CLIP, ComfortWeights, StageWeights
from rti_mpcc.types import Array

COMFORT_EASE = 0.05
"""Share of a comfort value over which its penalty sets in, (C4): f_s = 0.05 f_comfort. A penalty that starts
at once makes the plans of successive cycles jump to and fro across it."""
COMFORT_CLIP = 0.1
"""What goes beyond comfort costs its square up to here, in its own units, then linearly: comfort gives way to
the corridor and the goal."""
NOTHING_LEFT = -6.0
"""In units of f_s of (C4): this far below comfort the residual is 0.0025 f_s, and left out."""


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
    comfort: Comfort,
    wheelbase: float,
) -> QuadraticCost:
    """The model about `states` (N+1, 6) and `controls` (N, 3), paper Eq. 5 (C1), (C2); (C4).

    Args:
        errors: at `states`; None where no weight is on them.
    """
    on_controls = np.array(
        (weights.acceleration, weights.steering_rate, weights.virtual_speed, weights.progress_reward)
    )
    cost = _quadratic_cost(states, controls, on_controls, weights.comfort, comfort, wheelbase)
    if errors is not None:
        on_errors = np.array((weights.lag, weights.contouring, weights.heading))
        _add_errors(*errors, on_errors, cost.state_hessian, cost.state_gradient)
    return cost


def add_goal(
    cost: QuadraticCost, weights: StageWeights, last: Array, goal: Array, wheels: float = 0.0
) -> None:
    """Add what the last stage costs, in place, paper Eq. 2 (C3).

    Args:
        last: (6,) its state.
        goal: (3,) pose that it is to reach, in the frame and on the branch of `last`.
        wheels: angle that the wheels are to have there, where a weight is on it [rad].
    """
    clip = GOAL_CLIP if weights.goal_clipped else (np.inf, np.inf)
    on_end = np.array((*weights.goal.tolist(), weights.goal_speed, weights.goal_wheels))
    end = np.array((*goal.tolist(), 0.0, wheels))
    _add_goal(last, end, on_end, clip, cost.state_hessian, cost.state_gradient)


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
def _quadratic_cost(
    states: Array2, controls: Array2, weights: Array2, beyond: ComfortWeights, comfort: Comfort,
    wheelbase: float,
) -> QuadraticCost:  # fmt: skip
    """(C2) and (C4), `weights` (4, N) on the squares of the controls, and of the progress' reward."""
    hessian, gradient = np.zeros((len(states), STATES, STATES)), np.zeros((len(states), STATES))
    _add_lateral_excess(
        states, beyond.lateral_acceleration, comfort.lateral_acceleration, wheelbase, hessian, gradient
    )
    on_controls, by_controls = _control_cost(controls, weights, beyond, comfort)
    return QuadraticCost(hessian, gradient, on_controls, by_controls)


@inner
def _add_lateral_excess(
    states: Array, weights: Array, most: float, wheelbase: float, hessian: Array, gradient: Array
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


@inner
def _control_cost(
    controls: Array, weights: Array, beyond: ComfortWeights, comfort: Comfort
) -> tuple[Array, Array]:
    """Hessian and gradient of (C2), and of what goes beyond comfort of a and delta_dot, (C4)."""
    hessian, gradient = np.empty(controls.shape), np.empty(controls.shape)
    for k in range(len(controls)):
        for j in range(CONTROLS):
            hessian[k, j] = 2.0 * weights[j, k]
            gradient[k, j] = hessian[k, j] * controls[k, j]
        gradient[k, THETA_DOT] -= weights[CONTROLS, k]
        for j, on_excess, most in (
            (A, beyond.acceleration[k], comfort.acceleration),
            (DELTA_DOT, beyond.steering_rate[k], comfort.steering_rate),
        ):
            weight, excess, slope = _excess(controls[k, j], on_excess, most)
            gradient[k, j] += 2.0 * weight * excess * slope
            hessian[k, j] += 2.0 * weight * slope**2
    return hessian, gradient


@kernel
def _add_goal(
    last: Array1, goal: Array1, weights: Array1, clip: tuple[float, float], hessian: Out3, gradient: Out2
) -> None:
    """Equation (C3), `goal` and `weights` (5,) of x, y, phi, v, delta; `clip` of position and heading."""
    end, (most_position, most_heading) = len(gradient) - 1, clip
    share = min(1.0, most_position / max(hypot(last[X] - goal[X], last[Y] - goal[Y]), 1e-12))
    for i in range(len(goal)):
        error = last[i] - goal[i]
        if i == PHI:
            error = min(max(error, -most_heading), most_heading)
        elif i < PHI:
            error *= share
        hessian[end, i, i] += 2.0 * weights[i]
        gradient[end, i] += 2.0 * weights[i] * error
