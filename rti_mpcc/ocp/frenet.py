"""Frenet errors of vehicle states at references of their own progress (paper Eq. 3, 4).

With c = cos phi_r, s = sin phi_r and dir the direction of the part:

(F1)  e_l =  c (x - x_r) + s (y - y_r)        lag error [m]
      e_c = -s (x - x_r) + c (y - y_r)        contouring error [m]
      e_phi = phi - phi_r                     heading error [rad]
(F2)  de_l/dtheta = -dir + e_c phi_r',  de_c/dtheta = -e_l phi_r',  de_phi/dtheta = -phi_r'

with phi_r' = dphi_r/dtheta = dir kappa. They are valid Frenet coordinates only near e_l = 0.
"""

from __future__ import annotations

from math import cos, sin
from typing import Final, NamedTuple

import numpy as np

from geometry import PathReference
from geometry.compiled import Array1, Array2, Out2, Out3, kernel
from rti_mpcc.model.layout import PHI, STATES, THETA, X, Y
from rti_mpcc.types import Array

LAG: Final = 0
CONTOURING: Final = 1
HEADING: Final = 2
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


def frenet_errors(states: Array, reference: PathReference, direction: int) -> FrenetErrors:
    """Errors of `states` (n, 6) at `reference` (n of them, on the states' branch), Eq. (F1), (F2)."""
    values, slopes = np.empty((len(states), 3)), np.zeros((len(states), 3, STATES))
    x, y, phi = (np.ascontiguousarray(each) for each in (reference.x, reference.y, reference.phi))
    _frenet_errors(states, x, y, phi, reference.slope, float(direction), values, slopes)
    return FrenetErrors(values, slopes)


@kernel
def _frenet_errors(
    states: Array2,
    x: Array1,
    y: Array1,
    phi: Array1,
    turning: Array1,
    direction: float,
    values: Out2,
    slopes: Out3,
) -> None:
    """Equations (F1), (F2), `turning` being phi_r'."""
    for k in range(len(states)):
        c, s = cos(phi[k]), sin(phi[k])
        dx, dy = states[k, X] - x[k], states[k, Y] - y[k]
        values[k, LAG] = c * dx + s * dy
        values[k, CONTOURING] = c * dy - s * dx
        values[k, HEADING] = states[k, PHI] - phi[k]
        slopes[k, LAG, X] = slopes[k, CONTOURING, Y] = c
        slopes[k, LAG, Y] = s
        slopes[k, CONTOURING, X] = -s
        slopes[k, HEADING, PHI] = 1.0
        slopes[k, LAG, THETA] = -direction + values[k, CONTOURING] * turning[k]
        slopes[k, CONTOURING, THETA] = -values[k, LAG] * turning[k]
        slopes[k, HEADING, THETA] = -turning[k]
