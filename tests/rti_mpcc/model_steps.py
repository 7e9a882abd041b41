"""The model written down once more, in the terms of which its tests speak."""

from __future__ import annotations

import numpy as np

from rti_mpcc.model.bicycle import ModelStep, rollout
from rti_mpcc.model.layout import CONTROLS, DELTA, DELTA_DOT, PHI, POSE, STATES, THETA, THETA_DOT, A, V
from rti_mpcc.types import Array


def rates(state: Array, control: Array, wheelbase: float) -> Array:
    """Time derivative (6,) of a state (6,) under a control (3,), Eq. (M1)."""
    phi, v = state[PHI], state[V]
    return np.array([v * np.cos(phi), v * np.sin(phi), v * np.tan(state[DELTA]) / wheelbase, *control])


def step(states: Array, controls: Array, lengths: Array, wheelbase: float) -> Array:
    """States (n, 6) reached from `states` (n, 6) under `controls` (n, 3) after `lengths` (n,) [s]."""
    count = range(len(lengths))
    return np.array(
        [rollout(states[k], controls[k : k + 1], lengths[k : k + 1], wheelbase)[1] for k in count]
    )


def by_state(step: ModelStep) -> Array:
    """Sensitivity (n, 6, 6) of a step to the state."""
    by = np.tile(np.eye(STATES), (len(step.state), 1, 1))
    by[:, :POSE, PHI : DELTA + 1] = step.pose_by[:, :, :3]
    return by


def by_control(step: ModelStep, lengths: Array) -> Array:
    """Sensitivity (n, 6, 3) of a step of these lengths (n,) [s] to the control."""
    by = np.zeros((len(step.state), STATES, CONTROLS))
    by[:, :POSE, : DELTA_DOT + 1] = step.pose_by[:, :, 3:]
    by[:, V, A] = by[:, DELTA, DELTA_DOT] = by[:, THETA, THETA_DOT] = lengths
    return by
