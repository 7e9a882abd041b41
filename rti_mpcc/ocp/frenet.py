"""Frenet errors of vehicle states at references of their own progress (paper Eq. 3, 4).

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

LAG, CONTOURING, HEADING = range(3)
"""Where each error stands in `FrenetErrors`."""


class FrenetErrors(NamedTuple):
    """Errors (n, 3), lag, contouring and heading, and their slopes (n, 3, 6) with respect to the state."""

    values: Array
    slopes: Array

    @property
    def lag(self) -> Array:
        """e_l (n,) [m]."""
        return self.values[:, LAG]

    @property
    def contouring(self) -> Array:
        """e_c (n,) [m]."""
        return self.values[:, CONTOURING]

    @property
    def heading(self) -> Array:
        """e_phi (n,) [rad]."""
        return self.values[:, HEADING]


def frenet_errors(
    states: Array, reference: PathReference, direction: int, *, turns: bool = True
) -> FrenetErrors:
    """Errors of `states` (n, 6) at `reference` (n of them, on the states' branch), Eq. (F1), (F2).

    Args:
        turns: whether the slopes know that the reference turns with theta; False takes phi_r' for 0 in (F2).
    """
    values, slopes = np.empty((len(states), 3)), np.zeros((len(states), 3, STATES))
    c, s = np.cos(reference.phi), np.sin(reference.phi)
    dx, dy = states[:, X] - reference.x, states[:, Y] - reference.y
    values[:, LAG] = c * dx + s * dy
    values[:, CONTOURING] = c * dy - s * dx
    values[:, HEADING] = states[:, PHI] - reference.phi
    slopes[:, LAG, X] = slopes[:, CONTOURING, Y] = c
    slopes[:, LAG, Y] = s
    slopes[:, CONTOURING, X] = -s
    slopes[:, HEADING, PHI] = 1.0
    slopes[:, LAG, THETA] = -direction
    if turns and reference.slope.any():
        slopes[:, LAG, THETA] += values[:, CONTOURING] * reference.slope
        slopes[:, CONTOURING, THETA] = -values[:, LAG] * reference.slope
        slopes[:, HEADING, THETA] = -reference.slope
    return FrenetErrors(values, slopes)
