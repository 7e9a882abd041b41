"""Frenet errors of vehicle states at references of their own progress (paper Eq. 4).

With c = cos phi_r, s = sin phi_r and d the direction of the part:

(F1)  e_l =  c (x - x_r) + s (y - y_r)        lag error [m]
      e_c = -s (x - x_r) + c (y - y_r)        contouring error [m]
      e_phi = phi - phi_r                     heading error [rad]
(F2)  de_l/dtheta = -d + e_c phi_r',  de_c/dtheta = -e_l phi_r',  de_phi/dtheta = -phi_r'

with phi_r' = dphi_r/dtheta = d kappa. They are valid Frenet coordinates only near e_l = 0.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from geometry import PathReference
from rti_mpcc.model.layout import PHI, STATES, THETA, X, Y
from rti_mpcc.types import Array


class FrenetErrors(NamedTuple):
    """Errors (n,) and their slopes (n, 6) with respect to the state."""

    lag: Array
    contouring: Array
    heading: Array
    lag_by: Array
    contouring_by: Array
    heading_by: Array


def frenet_errors(
    states: Array, reference: PathReference, direction: int, *, turns: bool = True
) -> FrenetErrors:
    """Errors of `states` (n, 6) at `reference` (n of them, on the states' branch), Eq. (F1), (F2).

    Args:
        turns: whether the slopes know that the reference turns with theta; False takes phi_r' for 0 in (F2).
    """
    turn = reference.slope if turns else np.zeros_like(reference.slope)
    c, s = np.cos(reference.phi), np.sin(reference.phi)
    dx, dy = states[:, X] - reference.x, states[:, Y] - reference.y
    lag, contouring = c * dx + s * dy, -s * dx + c * dy
    lag_by, contouring_by, heading_by = (np.zeros((len(states), STATES)) for _ in range(3))
    lag_by[:, X], lag_by[:, Y], lag_by[:, THETA] = c, s, -direction + contouring * turn
    contouring_by[:, X], contouring_by[:, Y], contouring_by[:, THETA] = -s, c, -lag * turn
    heading_by[:, PHI], heading_by[:, THETA] = 1.0, -turn
    return FrenetErrors(lag, contouring, states[:, PHI] - reference.phi, lag_by, contouring_by, heading_by)
