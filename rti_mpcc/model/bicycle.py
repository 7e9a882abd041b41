"""Kinematic bicycle with progress, its Runge-Kutta step and the step's exact sensitivities.

(M1)  x' = v cos(phi),  y' = v sin(phi),  phi' = v tan(delta)/L,  v' = a,  delta' = delta_dot,
      theta' = theta_dot                                                  (paper Eq. 1, 2)

Controls are constant over a step, so v, delta and theta are exact, phi' depends on time alone, and
the classical Runge-Kutta step of length h comes down to

(M2)  w_0, w_m, w_1 = phi' at 0, h/2, h;      phi_1 = phi + h/6 (w_0 + 4 w_m + w_1)
(M3)  x_1 = x + h/6 (v_0 cos phi_a + 2 v_m cos phi_b + 2 v_m cos phi_c + v_1 cos phi_d),
      phi_a = phi, phi_b = phi + h/2 w_0, phi_c = phi + h/2 w_m, phi_d = phi + h w_m; y_1 with sin.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from types import ModuleType
from typing import NamedTuple, TypeVar

import numpy as np

from rti_mpcc.model.layout import CONTROLS, DELTA, DELTA_DOT, PHI, STATES, THETA, THETA_DOT, A, V, X, Y
from rti_mpcc.types import Array

Real = TypeVar("Real", float, Array)


class Step(NamedTuple):
    """One step of n stages: the states reached (n, 6) and their sensitivities to state and control."""

    state: Array
    by_state: Array  # (n, 6, 6)
    by_control: Array  # (n, 6, 3)


def rates(states: Array, controls: Array, wheelbase: float) -> Array:
    """Time derivative (n, 6) of states (n, 6) under controls (n, 3), Eq. (M1)."""
    phi, v, delta = states[:, PHI], states[:, V], states[:, DELTA]
    out = np.empty_like(states)
    out[:, X] = v * np.cos(phi)
    out[:, Y] = v * np.sin(phi)
    out[:, PHI] = v * np.tan(delta) / wheelbase
    out[:, V] = controls[:, A]
    out[:, DELTA] = controls[:, DELTA_DOT]
    out[:, THETA] = controls[:, THETA_DOT]
    return out


def step(states: Array, controls: Array, lengths: Array, wheelbase: float) -> Array:
    """States (n, 6) reached from `states` (n, 6) under `controls` (n, 3) after `lengths` (n,) [s]."""
    phi, v, delta = states[:, PHI], states[:, V], states[:, DELTA]
    a, rate = controls[:, A], controls[:, DELTA_DOT]
    dx, dy, turn = _change(np, phi, v, delta, a, rate, lengths, wheelbase)
    reached = states.copy()
    reached[:, X] += dx
    reached[:, Y] += dy
    reached[:, PHI] += turn
    reached[:, V] += lengths * a
    reached[:, DELTA] += lengths * rate
    reached[:, THETA] += lengths * controls[:, THETA_DOT]
    return reached


# Columns of the sensitivities below: to phi, v, delta, a and delta_dot.
_P_PHI, _P_V, _P_DELTA, _P_A, _P_RATE = range(5)
_POSE = np.array([X, Y, PHI])
_STATE_COLUMNS = np.array([PHI, V, DELTA])
_CONTROL_COLUMNS = np.array([A, DELTA_DOT])


def rollout(state: Array, controls: Array, lengths: Array, wheelbase: float) -> Array:
    """The states (n+1, 6) that `controls` (n, 3) lead to from `state` (6,), each held for its length [s].

    Speed, steering and progress are sums of the controls, the heading is one of what these turn it, and the
    position one of what all of them move it: three sums instead of n steps.
    """
    states = np.tile(state, (len(lengths) + 1, 1)).astype(np.float64)
    for quantity, control in ((V, A), (DELTA, DELTA_DOT), (THETA, THETA_DOT)):
        states[1:, quantity] += np.cumsum(lengths * controls[:, control])
    for pose in ([PHI], [X, Y]):
        moved = step(states[:-1], controls, lengths, wheelbase) - states[:-1]
        states[1:, pose] = states[0, pose] + np.cumsum(moved[:, pose], axis=0)
    return states


def step_one(
    state: Sequence[float], control: tuple[float, float, float], seconds: float, wheelbase: float
) -> tuple[float, ...]:
    """`step` of a single state (6,) under a control (3,), in plain floats: many times as fast for one."""
    x, y, phi, v, delta, theta = state
    a, rate, progress = control
    dx, dy, turn = _change(math, phi, v, delta, a, rate, seconds, wheelbase)
    return (x + dx, y + dy, phi + turn, v + seconds * a, delta + seconds * rate, theta + seconds * progress)


def _change(
    trig: ModuleType, phi: Real, v: Real, delta: Real, a: Real, rate: Real, h: Real, wheelbase: float
) -> tuple[Real, Real, Real]:
    """What a step of length h adds to x, y and phi, Eq. (M2), (M3); `trig`: `math` for floats, `numpy`."""
    half, sixth = 0.5 * h, h / 6.0
    v_m, v_1 = v + half * a, v + h * a
    w = v * trig.tan(delta) / wheelbase
    w_m = v_m * trig.tan(delta + half * rate) / wheelbase
    w_1 = v_1 * trig.tan(delta + h * rate) / wheelbase
    phi_b, phi_c, phi_d = phi + half * w, phi + half * w_m, phi + h * w_m
    twice = 2.0 * v_m
    x = sixth * (v * trig.cos(phi) + twice * (trig.cos(phi_b) + trig.cos(phi_c)) + v_1 * trig.cos(phi_d))
    y = sixth * (v * trig.sin(phi) + twice * (trig.sin(phi_b) + trig.sin(phi_c)) + v_1 * trig.sin(phi_d))
    return x, y, sixth * (w + 4.0 * w_m + w_1)


def linearised_step(states: Array, controls: Array, lengths: Array, wheelbase: float) -> Step:
    """One Runge-Kutta step per stage with exact sensitivities, Eq. (M2), (M3).

    Args:
        states: (n, 6); controls: (n, 3), constant over the step; lengths: (n,) [s]; wheelbase: [m].
    """
    n, h = len(states), lengths
    phi, v_0, delta_0 = states[:, PHI], states[:, V], states[:, DELTA]
    a, rate = controls[:, A], controls[:, DELTA_DOT]

    # v, delta and phi' at 0, h/2, h, axis 1; then their sensitivities, axis 2 the five parameters.
    time = h[:, None] * np.array([0.0, 0.5, 1.0])
    v = v_0[:, None] + a[:, None] * time
    tangent = np.tan(delta_0[:, None] + rate[:, None] * time)
    w = v * tangent / wheelbase
    w_by = np.zeros((n, 3, 5))
    w_by[:, :, _P_V] = tangent / wheelbase
    w_by[:, :, _P_DELTA] = v * (1.0 + tangent**2) / wheelbase
    w_by[:, :, _P_A] = w_by[:, :, _P_V] * time
    w_by[:, :, _P_RATE] = w_by[:, :, _P_DELTA] * time

    # The four headings, speeds and weights of (M3), axis 1.
    weight = h[:, None] / 6.0 * np.array([1.0, 2.0, 2.0, 1.0])
    advance = h[:, None] * np.array([0.0, 0.5, 0.5, 1.0])
    source = np.array([0, 0, 1, 1])  # which of w_0, w_m turns the heading
    heading = phi[:, None] + advance * w[:, source]
    heading_by = advance[:, :, None] * w_by[:, source]
    heading_by[:, :, _P_PHI] = 1.0
    speed = v[:, [0, 1, 1, 2]]
    speed_time = time[:, [0, 1, 1, 2]]
    cos, sin = weight * np.cos(heading), weight * np.sin(heading)

    reached = states.copy()
    reached[:, X] += (cos * speed).sum(axis=1)
    reached[:, Y] += (sin * speed).sum(axis=1)
    simpson = h[:, None] / 6.0 * np.array([1.0, 4.0, 1.0])
    reached[:, PHI] += (simpson * w).sum(axis=1)
    reached[:, V] += h * a
    reached[:, DELTA] += h * rate
    reached[:, THETA] += h * controls[:, THETA_DOT]

    pose_by = np.empty((n, 3, 5))
    pose_by[:, 0] = np.matmul((-sin * speed)[:, None, :], heading_by)[:, 0]
    pose_by[:, 1] = np.matmul((cos * speed)[:, None, :], heading_by)[:, 0]
    pose_by[:, 2] = np.matmul(simpson[:, None, :], w_by)[:, 0]
    pose_by[:, 2, _P_PHI] = 1.0
    for row, along in ((0, cos), (1, sin)):
        pose_by[:, row, _P_V] += along.sum(axis=1)
        pose_by[:, row, _P_A] += (along * speed_time).sum(axis=1)

    by_state = np.zeros((n, STATES, STATES))
    by_state[:, np.arange(STATES), np.arange(STATES)] = 1.0
    by_state[:, _POSE[:, None], _STATE_COLUMNS] = pose_by[:, :, :3]
    by_control = np.zeros((n, STATES, CONTROLS))
    by_control[:, _POSE[:, None], _CONTROL_COLUMNS] = pose_by[:, :, 3:]
    by_control[:, V, A] = h
    by_control[:, DELTA, DELTA_DOT] = h
    by_control[:, THETA, THETA_DOT] = h
    return Step(reached, by_state, by_control)
