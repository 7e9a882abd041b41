"""The motion of a vehicle that brakes with its steering held: what is sent along when no plan is driven."""

from __future__ import annotations

import numpy as np

from rti_mpcc.model.layout import CONTROLS, DELTA, PHI, STATES, THETA, A, V, X, Y
from rti_mpcc.ocp.horizon import read_only
from rti_mpcc.types import Array, Trajectory


def stopping_motion(state: Array, times: Array, deceleration: float, wheelbase: float) -> Trajectory:
    """Constant `deceleration` [m/s²] from `state` (6,) to rest on an arc, at `times` (N+1,) [s]."""
    speed, forward = abs(float(state[V])), float(np.sign(state[V]))
    elapsed = np.minimum(times - times[0], speed / deceleration)
    way = forward * (speed * elapsed - 0.5 * deceleration * elapsed**2)
    half_turn = 0.5 * way * np.tan(state[DELTA]) / wheelbase
    chord = way * np.sinc(half_turn / np.pi)
    states = np.tile(state, (len(times), 1)).astype(np.float64).reshape(len(times), STATES)
    states[:, X] += chord * np.cos(state[PHI] + half_turn)
    states[:, Y] += chord * np.sin(state[PHI] + half_turn)
    states[:, PHI] += 2.0 * half_turn
    states[:, V] = forward * (speed - deceleration * elapsed)
    states[:, THETA] += np.abs(way)
    controls = np.zeros((len(times) - 1, CONTROLS))
    controls[:, A] = np.diff(states[:, V]) / np.diff(times)
    read_only(times, states, controls)
    return Trajectory(times=times, states=states, controls=controls)
