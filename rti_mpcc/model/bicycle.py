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

import math
from collections.abc import Sequence
from types import ModuleType
from typing import NamedTuple, TypeVar

import numpy as np

from rti_mpcc.model.layout import CONTROLS, DELTA, DELTA_DOT, PHI, POSE, STATES, THETA, THETA_DOT, A, V, X, Y
from rti_mpcc.types import Array

Real = TypeVar("Real", float, Array)


class Step(NamedTuple):
    """One step of n stages: the states reached (n, 6) and what their poses gain by what they began with.

    Attributes:
        state: (n, 6).
        pose_by: (n, 3, 5) slopes of x, y, phi reached to phi, v, delta, a, delta_dot.
        lengths: (n,) h [s], the slopes of v, delta and theta to their controls.
    """

    state: Array
    pose_by: Array
    lengths: Array

    @property
    def by_state(self) -> Array:
        """Sensitivity (n, 6, 6) to the state."""
        by = np.tile(np.eye(STATES), (len(self.state), 1, 1))
        by[:, :POSE, PHI : DELTA + 1] = self.pose_by[:, :, :3]
        return by

    @property
    def by_control(self) -> Array:
        """Sensitivity (n, 6, 3) to the control."""
        by = np.zeros((len(self.state), STATES, CONTROLS))
        by[:, :POSE, : DELTA_DOT + 1] = self.pose_by[:, :, 3:]
        by[:, V, A] = by[:, DELTA, DELTA_DOT] = by[:, THETA, THETA_DOT] = self.lengths
        return by


def pose_rates(states: Array, wheelbase: float) -> Array:
    """Time derivative (n, 3) of x, y, phi in states (n, 6): the part of Eq. (M1) that no control enters."""
    phi, v = states[:, PHI], states[:, V]
    out = np.empty((len(states), POSE))
    np.multiply(v, np.cos(phi), out=out[:, X])
    np.multiply(v, np.sin(phi), out=out[:, Y])
    np.multiply(v / wheelbase, np.tan(states[:, DELTA]), out=out[:, PHI])
    return out


def rates(states: Array, controls: Array, wheelbase: float) -> Array:
    """Time derivative (n, 6) of states (n, 6) under controls (n, 3), Eq. (M1)."""
    out = np.empty_like(states)
    out[:, :POSE] = pose_rates(states, wheelbase)
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


# Of the times 0, h/2, h in a step, and of the four parts of its way (M3).
_TIMES = np.array([0.0, 0.5, 1.0])[:, None]
_SIMPSON = np.array([1.0, 4.0, 1.0])[:, None] / 6.0
_PARTS = np.array([1.0, 2.0, 2.0, 1.0])[:, None] / 6.0
_TURNED_FOR = np.array([0.0, 0.5, 0.5, 1.0])[:, None]
_TURNED_AT = np.array([0, 0, 1, 1])
_DRIVEN_AT = np.array([0, 1, 1, 2])


def linearised_step(states: Array, controls: Array, lengths: Array, wheelbase: float) -> Step:
    """One Runge-Kutta step per stage with exact sensitivities, Eq. (M2), (M3).

    With x + iy for the position, and e_j = g_j exp(i phi_j) with the weights g_j = h/6 (1, 2, 2, 1) of (M3),

    (M4)  d(x_1 + i y_1) = sum_j e_j (dv_j + i v_j dphi_j),   dv_j = dv + t_j da,
          dphi_b = dphi + h/2 dw_0,  dphi_c = dphi + h/2 dw_m,  dphi_d = dphi + h dw_m;   dphi_1 by (M2),
          dw(t) = tan(delta)/L (dv + t da) + v (1 + tan²)/L (ddelta + t ddelta_dot)

    Args:
        states: (n, 6); controls: (n, 3), constant over the step; lengths: (n,) [s]; wheelbase: [m].
    """
    h, count = lengths, len(lengths)
    # v and delta along axis 0, the three times along axis 1.
    t = h * _TIMES
    motion = states[:, V : DELTA + 1].T[:, None] + controls[:, A : DELTA_DOT + 1].T[:, None] * t
    v, tangent = motion[0], np.tan(motion[1])
    by = np.empty((2, 3, count))  # slopes of phi' to v and delta
    np.divide(tangent, wheelbase, out=by[0])
    np.multiply(by[0] * tangent + 1.0 / wheelbase, v, out=by[1])
    w = v * by[0]

    heading = states[:, PHI] + h * _TURNED_FOR * w[_TURNED_AT]
    e = np.empty((4, count), dtype=np.complex128)
    np.cos(heading, out=e.real)
    np.sin(heading, out=e.imag)
    e *= h * _PARTS
    distance = e * v[_DRIVEN_AT]
    moved = distance.sum(axis=0)

    # The slopes of position and heading to phi, v, delta, a, delta_dot along axis 0.
    by_w = 1j * distance * (h * _TURNED_FOR)
    by_w0, by_wm = by_w[1], by_w[2] + by_w[3]
    position = np.empty((5, count), dtype=np.complex128)
    position[0] = 1j * moved
    later = by_wm * by[:, 1]
    position[1:3] = by_w0 * by[:, 0] + later
    position[1] += e.sum(axis=0)
    position[3:5] = later * t[1]
    position[3] += (e * t[_DRIVEN_AT]).sum(axis=0)
    simpson = h * _SIMPSON
    pose_by = np.empty((POSE, 5, count))
    pose_by[X], pose_by[Y] = position.real, position.imag
    pose_by[PHI, 0] = 1.0
    pose_by[PHI, 1:3] = (simpson * by).sum(axis=1)
    pose_by[PHI, 3:5] = (simpson * t * by).sum(axis=1)

    reached = states.copy()
    reached[:, : Y + 1].view(np.complex128)[:, 0] += moved
    reached[:, PHI] += (simpson * w).sum(axis=0)
    reached[:, V : DELTA + 1] = motion[:, 2].T
    reached[:, THETA] += h * controls[:, THETA_DOT]
    return Step(reached, pose_by.transpose(2, 0, 1), lengths)
