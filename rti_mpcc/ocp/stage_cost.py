"""Quadratic models of the cost: Gauss-Newton on every residual, exact gradient.

(C1)  stage:    q_l e_l² + q_c e_c² + q_phi e_phi²
(C2)  control:  r_a a² + r_delta delta_dot² + r_theta theta_dot² - gamma theta_dot
(C3)  end:      |z_N - goal|² with q_N on position and heading, beyond the clip linear; q_v v_N²;
               q_w (delta_N - wheels)² where the next segment starts with such an angle
(C4)  comfort:  q_comfort e² for f = a_lat of a stage, a and delta_dot of a control, beyond the clip linear;
                e = max(0, |f| - f_comfort) rounded off: e = f_s log(1 + exp((|f| - f_comfort) / f_s))

The end T of a plan that arrives at rest is a variable of the QP, and has a cost, too:

(T4)  J = sum over stages of h_k E_k + w_T T,   E_k the cost of effort and comfort of stage k a second.

With E = w_a a² and a free end the Hamiltonian is 0 at the end: a straight arrival ends at a² = w_T / w_a. So
w_T = w_a a_planned² asks for an end at the planned acceleration, whatever the speed at its start, and bends,
narrow places and comfort set T by themselves.

All stages but the first, which lasts a cycle, are stretched alike, h_k' = h_k / (T - h_0):

(T5)  F_T = h_k' f(z_k+1, u_k),   dJ/dT = w_T + sum of h_k' E_k,   d²J/dT² = 2 / (T - h_0)² sum of h_k E_k,

f being (M1). The progress keeps to its stages: its rate is scaled with them, so that what holds the progress
does not hold T. The curvature is what keeps a full step from overshooting: over a given way the effort goes
with 1 / T³.
"""

from __future__ import annotations

from math import exp, hypot, log1p, tan
from typing import NamedTuple

import numpy as np

from geometry.compiled import Array1, Array2, Array3, Out1, Out2, Out3, inner, kernel
from rti_mpcc.config import Comfort
from rti_mpcc.model.bicycle import pose_rate
from rti_mpcc.model.layout import CONTROLS, DELTA, DELTA_DOT, PHI, STATES, THETA_DOT, A, V, X, Y
from rti_mpcc.ocp.frenet import FrenetErrors
from rti_mpcc.ocp.horizon import PlanStages
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
LEAST_TIME = 1.0
"""To go, at least: closer in, the plan always ends this far ahead [s]."""
LARGEST_CHANGE = 0.1
"""Of T, in one iteration."""


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


@kernel
def _quadratic_cost(
    states: Array2, controls: Array2, weights: Array2, beyond: ComfortWeights, comfort: Comfort,
    wheelbase: float,
) -> QuadraticCost:  # fmt: skip
    """(C2) and (C4), `weights` (4, N) on the squares of the controls, and of the progress' reward."""
    hessian, gradient = np.zeros((len(states), STATES, STATES)), np.zeros((len(states), STATES))
    on_controls, by_controls, slopes = np.empty(controls.shape), np.empty(controls.shape), np.zeros(STATES)
    for k in range(len(states)):
        v, tangent = states[k, V], tan(states[k, DELTA])
        lateral, most = v * v * tangent / wheelbase, comfort.lateral_acceleration
        weight, excess, slope = _excess(lateral, beyond.lateral_acceleration[k], most)
        slopes[V] = slope * (2.0 * v * tangent / wheelbase)
        slopes[DELTA] = slope * (v * v * (1.0 + tangent * tangent) / wheelbase)
        add_square(hessian, gradient, k, weight, excess, slopes)
    for k in range(len(controls)):
        for j in range(CONTROLS):
            on_controls[k, j] = 2.0 * weights[j, k]
            by_controls[k, j] = on_controls[k, j] * controls[k, j]
        by_controls[k, THETA_DOT] -= weights[CONTROLS, k]
        for j, on_excess, most in (
            (A, beyond.acceleration[k], comfort.acceleration),
            (DELTA_DOT, beyond.steering_rate[k], comfort.steering_rate),
        ):
            weight, excess, slope = _excess(controls[k, j], on_excess, most)
            by_controls[k, j] += 2.0 * weight * excess * slope
            on_controls[k, j] += 2.0 * weight * slope**2
    return QuadraticCost(hessian, gradient, on_controls, by_controls)


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


# -- the end of a plan, (T4) and (T5) ------------------------------------------------------------------------


class EndTime(NamedTuple):
    """What the QP needs of dT: (T5).

    Attributes:
        stretches: (N, 5) F_T, of x, y, phi, v, delta [1/s].
        gradient, curvature: of J; least, most: bounds on dT [s].
    """

    stretches: Out2
    gradient: float
    curvature: float
    least: float
    most: float


FIXED_END = EndTime(np.empty((0, 5)), 0.0, 0.0, 0.0, 0.0)
"""Where dT = 0."""


def end_time(
    stages: PlanStages,
    reached: Array,
    weights: StageWeights,
    comfort: Comfort,
    wheelbase: float,
    latest: float,
) -> EndTime:
    """(T5) about a plan.

    Args:
        reached: (N, 6) ends of the stages; latest: that the plan may take [s].
    """
    lengths, on_controls = stages.lengths, np.array((weights.acceleration, weights.steering_rate))
    total = float(lengths.sum())
    stretches, effort = _stretched(stages, reached, on_controls, weights.comfort, comfort, wheelbase)
    rest = total - float(lengths[0])
    least = min(max(-LARGEST_CHANGE * total, LEAST_TIME - total), 0.0)
    longest = min(LARGEST_CHANGE * total, max(latest - total, least))
    return EndTime(stretches, weights.time + effort / rest, 2.0 * effort / rest**2, least, longest)


@inner
def _excess_cost(value: float, weight: float, most: float) -> float:
    """What a value beyond `most` costs, (C4)."""
    clipped, excess, _ = _excess(value, weight, most)
    cost: float = clipped * excess * excess
    return cost


@kernel
def _stretched(
    stages: PlanStages, reached: Array2, on_controls: Array2, beyond: ComfortWeights, comfort: Comfort,
    wheelbase: float,
) -> tuple[Out2, float]:  # fmt: skip
    """F_T, and the sum of h_k E_k over all stages but the first; `on_controls` (2, N): a and delta_dot."""
    states, controls, lengths = stages
    stretches, effort, rest = np.zeros((len(lengths), 5)), 0.0, np.sum(lengths[1:])
    for k in range(1, len(lengths)):
        a, rate, v = controls[k, A], controls[k, DELTA_DOT], states[k, V]
        dx, dy, turn = pose_rate(reached[k], wheelbase)
        share = lengths[k] / rest
        stretches[k, X], stretches[k, Y], stretches[k, PHI] = share * dx, share * dy, share * turn
        stretches[k, V], stretches[k, DELTA] = share * a, share * rate
        effort += on_controls[A, k] * a * a + on_controls[DELTA_DOT, k] * rate * rate
        effort += _excess_cost(a, beyond.acceleration[k], comfort.acceleration)
        effort += _excess_cost(rate, beyond.steering_rate[k], comfort.steering_rate)
        lateral = v * v * tan(states[k, DELTA]) / wheelbase
        effort += _excess_cost(lateral, beyond.lateral_acceleration[k], comfort.lateral_acceleration)
    return stretches, effort


@kernel
def stretched_times(begin: float, lengths: Array1, change: float) -> Out1:
    """Times (N+1,) [s] of the stages' ends from `begin` [s] on, with T changed by so much [s]."""
    times, factor = np.empty(len(lengths) + 1), 1.0 + change / np.sum(lengths[1:])
    times[0], times[1] = begin, begin + lengths[0]
    for k in range(1, len(lengths)):
        times[k + 1] = times[k] + factor * lengths[k]
    return times
