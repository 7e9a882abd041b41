"""Kinematic bicycle with progress, its Runge-Kutta step and the step's exact sensitivities.

(M1)  x' = v cos(phi),  y' = v sin(phi),  phi' = v tan(delta)/L,  v' = a,  delta' = delta_dot,
      theta' = theta_dot                                                  (state and input: paper Eq. 6)

Controls are constant over a step, so v, delta and theta are exact, phi' depends on time alone, and
the classical Runge-Kutta step of length h comes down to

(M2)  w_0, w_m, w_1 = phi' at 0, h/2, h;      phi_1 = phi + h/6 (w_0 + 4 w_m + w_1)
(M3)  x_1 = x + h/6 (v_0 cos phi_a + 2 v_m cos phi_b + 2 v_m cos phi_c + v_1 cos phi_d),
      phi_a = phi, phi_b = phi + h/2 w_0, phi_c = phi + h/2 w_m, phi_d = phi + h w_m; y_1 with sin.
"""

from __future__ import annotations

from math import cos, hypot, sin, tan
from typing import NamedTuple

import numpy as np

from geometry.compiled import Array1, Array2, Out2, Out3, copy_row, inner, kernel
from rti_mpcc.model.layout import DELTA, DELTA_DOT, PHI, POSE, STATES, THETA, THETA_DOT, A, V, X, Y
from rti_mpcc.types import Array


class ModelStep(NamedTuple):
    """One step of n stages: the states reached (n, 6) and what their poses gain by what they began with.

    Attributes:
        state: (n, 6).
        pose_by: (n, 3, 5) slopes of x, y, phi reached to phi, v, delta, a, delta_dot. Those of v, delta and
            theta to their controls are the length of the stage.
    """

    state: Out2
    pose_by: Out3


@inner
def _change(
    start: tuple[float, float, float], a: float, rate: float, h: float, wheelbase: float
) -> tuple[float, float, float]:
    """What a step of length h from phi, v, delta adds to x, y and phi, Eq. (M2), (M3)."""
    phi, v, delta = start
    half, sixth = 0.5 * h, h / 6.0
    v_m, v_1 = v + half * a, v + h * a
    w = v * tan(delta) / wheelbase
    w_m = v_m * tan(delta + half * rate) / wheelbase
    w_1 = v_1 * tan(delta + h * rate) / wheelbase
    phi_b, phi_c, phi_d = phi + half * w, phi + half * w_m, phi + h * w_m
    twice = 2.0 * v_m
    x = sixth * (v * cos(phi) + twice * (cos(phi_b) + cos(phi_c)) + v_1 * cos(phi_d))
    y = sixth * (v * sin(phi) + twice * (sin(phi_b) + sin(phi_c)) + v_1 * sin(phi_d))
    return x, y, sixth * (w + 4.0 * w_m + w_1)


@kernel
def step_one(
    state: tuple[float, float, float, float, float, float],
    control: tuple[float, float, float],
    h: float,
    wheelbase: float,
) -> tuple[float, float, float, float, float, float]:
    """The state to which a control leads after h [s] from the one given, in plain floats."""
    (x, y, phi, v, delta, theta), (a, rate, progress) = state, control
    dx, dy, turn = _change((phi, v, delta), a, rate, h, wheelbase)
    return x + dx, y + dy, phi + turn, v + h * a, delta + h * rate, theta + h * progress


@inner
def propagate(state: Array, control: Array, h: float, wheelbase: float, reached: Array) -> None:
    """One step of length h from `state`, into `reached`, which may be the same."""
    a, rate = control[A], control[DELTA_DOT]
    dx, dy, turn = _change((state[PHI], state[V], state[DELTA]), a, rate, h, wheelbase)
    reached[X] = state[X] + dx
    reached[Y] = state[Y] + dy
    reached[PHI] = state[PHI] + turn
    reached[V] = state[V] + h * a
    reached[DELTA] = state[DELTA] + h * rate
    reached[THETA] = state[THETA] + h * control[THETA_DOT]


@kernel
def rollout(state: Array1, controls: Array2, lengths: Array1, wheelbase: float) -> Out2:
    """The states (n+1, 6) that `controls` (n, 3) lead to from `state` (6,), each held for its length [s]."""
    states = np.empty((len(lengths) + 1, STATES))
    copy_row(state, states[0])
    for k in range(len(lengths)):
        propagate(states[k], controls[k], lengths[k], wheelbase, states[k + 1])
    return states


class Extremes(NamedTuple):
    """The largest values in a plan, wherever they are.

    Attributes:
        finite: all of its numbers are.
        drift [m], turn [rad]: what the errors against the model add up to over the first stages.
        position [m], heading [rad]: error of one stage.
        speed [m/s], angle [rad], acceleration [m/s²], steering_rate [rad/s]: absolute.
    """

    finite: bool
    drift: float
    turn: float
    position: float
    heading: float
    speed: float
    angle: float
    acceleration: float
    steering_rate: float


@kernel
def extremes(times: Array1, states: Array2, controls: Array2, wheelbase: float, span: float) -> Extremes:
    """Of a plan of N stages; the errors add up over those that begin within `span` [s], one at least."""
    reached, drift, turn, position, heading = np.empty(STATES), 0.0, 0.0, 0.0, 0.0
    speed, angle, a, rate = abs(states[0, V]), abs(states[0, DELTA]), 0.0, 0.0
    for k in range(len(controls)):
        propagate(states[k], controls[k], times[k + 1] - times[k], wheelbase, reached)
        off = hypot(reached[X] - states[k + 1, X], reached[Y] - states[k + 1, Y])
        turned = abs(reached[PHI] - states[k + 1, PHI])
        if k == 0 or times[k] < times[0] + span:
            drift += off
            turn += turned
        position, heading = max(position, off), max(heading, turned)
        speed, angle = max(speed, abs(states[k + 1, V])), max(angle, abs(states[k + 1, DELTA]))
        a, rate = max(a, abs(controls[k, A])), max(rate, abs(controls[k, DELTA_DOT]))
    finite = bool(np.isfinite(states).all() and np.isfinite(controls).all())
    return Extremes(finite, drift, turn, position, heading, speed, angle, a, rate)


_TIMES = (0.0, 0.5, 1.0)
_TURNS = (1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0)
"""Of a step's turn, Eq. (M2): the times at which its rate is taken, and what each weighs."""
_WAYS = (1.0 / 6.0, 2.0 / 6.0, 2.0 / 6.0, 1.0 / 6.0)
_DRIVEN_AT = (0, 1, 1, 2)
_TURNED_AT = (0, 0, 1, 1)
_TURNED_FOR = (0.0, 0.5, 0.5, 1.0)
"""Of the four parts of its way, Eq. (M3): what they weigh, at which of the times their speed is taken and the
rate at which the heading has been turning, and for how long it has."""


@kernel
def linearised_step(states: Array2, controls: Array2, lengths: Array1, wheelbase: float) -> ModelStep:
    """One Runge-Kutta step per stage with exact sensitivities, Eq. (M2), (M3).

    With g_j = h/6 (1, 2, 2, 1) of (M3),

    (M4)  dx_1 = sum_j g_j (cos phi_j dv_j - v_j sin phi_j dphi_j),   dv_j = dv + t_j da,
          dy_1 = sum_j g_j (sin phi_j dv_j + v_j cos phi_j dphi_j);   dphi_1 by (M2),
          dphi_b = dphi + h/2 dw_0,  dphi_c = dphi + h/2 dw_m,  dphi_d = dphi + h dw_m,
          dw(t) = tan(delta)/L (dv + t da) + v (1 + tan²)/L (ddelta + t ddelta_dot)

    Args:
        states: (>= n, 6); controls: (n, 3), constant over the step; lengths: (n,) [s]; wheelbase: [m].
    """
    reached, pose_by = np.empty((len(lengths), STATES)), np.zeros((len(lengths), POSE, 5))
    w, w_by_v, w_by_delta = np.empty(3), np.empty(3), np.empty(3)
    for k in range(len(lengths)):
        h, phi, v_0, a = lengths[k], states[k, PHI], states[k, V], controls[k, A]
        turn = 0.0
        pose_by[k, PHI, 0] = 1.0
        for i in range(3):
            t, g = h * _TIMES[i], h * _TURNS[i]
            v, tangent = v_0 + t * a, tan(states[k, DELTA] + t * controls[k, DELTA_DOT])
            w[i], w_by_v[i] = v * tangent / wheelbase, tangent / wheelbase
            w_by_delta[i] = v * (1.0 + tangent * tangent) / wheelbase
            turn += g * w[i]
            pose_by[k, PHI, 1] += g * w_by_v[i]
            pose_by[k, PHI, 2] += g * w_by_delta[i]
            pose_by[k, PHI, 3] += g * w_by_v[i] * t
            pose_by[k, PHI, 4] += g * w_by_delta[i] * t
        x = y = 0.0
        for j in range(4):
            at = _TURNED_AT[j]
            g, t, s, span = h * _WAYS[j], h * _TIMES[_DRIVEN_AT[j]], h * _TIMES[at], h * _TURNED_FOR[j]
            v, heading = v_0 + t * a, phi + span * w[at]
            by_v, by_delta = span * w_by_v[at], span * w_by_delta[at]
            # Along the heading, and what a turn moves it aside.
            ahead_x, ahead_y = g * cos(heading), g * sin(heading)
            aside_x, aside_y = -v * ahead_y, v * ahead_x
            x += v * ahead_x
            y += v * ahead_y
            pose_by[k, X, 0] += aside_x
            pose_by[k, X, 1] += ahead_x + aside_x * by_v
            pose_by[k, X, 2] += aside_x * by_delta
            pose_by[k, X, 3] += ahead_x * t + aside_x * by_v * s
            pose_by[k, X, 4] += aside_x * by_delta * s
            pose_by[k, Y, 0] += aside_y
            pose_by[k, Y, 1] += ahead_y + aside_y * by_v
            pose_by[k, Y, 2] += aside_y * by_delta
            pose_by[k, Y, 3] += ahead_y * t + aside_y * by_v * s
            pose_by[k, Y, 4] += aside_y * by_delta * s
        reached[k, X] = states[k, X] + x
        reached[k, Y] = states[k, Y] + y
        reached[k, PHI] = phi + turn
        reached[k, V] = v_0 + h * a
        reached[k, DELTA] = states[k, DELTA] + h * controls[k, DELTA_DOT]
        reached[k, THETA] = states[k, THETA] + h * controls[k, THETA_DOT]
    return ModelStep(reached, pose_by)


@inner
def pose_rate(state: Array, wheelbase: float) -> tuple[float, float, float]:
    """Time derivative of x, y, phi in one state, Eq. (M1)."""
    v, phi = state[V], state[PHI]
    return v * cos(phi), v * sin(phi), v * tan(state[DELTA]) / wheelbase
