"""The vehicle's local frame, and Frenet errors of states at references of their own progress (Eq. 3, 4).

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

from geometry import PathReference, Pose2
from geometry.compiled import Array1, Array2, Out2, Out3, copy_row, kernel
from rti_mpcc.model.layout import PHI, POSE, STATES, THETA, X, Y
from rti_mpcc.types import Array

LAG: Final = 0
CONTOURING: Final = 1
HEADING: Final = 2
"""Where each error stands in `FrenetErrors`."""


class LocalFrame(NamedTuple):
    """A frame at a pose x [m], y [m], phi [rad], from whose branch headings are counted: numbers in it stay
    small wherever in the world the vehicle is, and however turned."""

    x: float
    y: float
    phi: float


@kernel
def world_to_local(frame: LocalFrame, poses: Array2) -> Out2:
    """World states or poses (n, >= 3) in a frame, headings not wrapped."""
    x, y, phi = frame
    turned, c, s = np.empty(poses.shape), cos(phi), sin(phi)
    for k in range(len(poses)):
        dx, dy = poses[k, X] - x, poses[k, Y] - y
        turned[k, X] = c * dx + s * dy
        turned[k, Y] = c * dy - s * dx
        turned[k, PHI] = poses[k, PHI] - phi
        copy_row(poses[k, POSE:], turned[k, POSE:])
    return turned


@kernel
def local_to_world(frame: LocalFrame, poses: Array2) -> Out2:
    """States or poses (n, >= 3) in a frame, in the world."""
    x, y, phi = frame
    turned, c, s = np.empty(poses.shape), cos(phi), sin(phi)
    for k in range(len(poses)):
        dx, dy = poses[k, X], poses[k, Y]
        turned[k, X] = x + (c * dx - s * dy)
        turned[k, Y] = y + (s * dx + c * dy)
        turned[k, PHI] = poses[k, PHI] + phi
        copy_row(poses[k, POSE:], turned[k, POSE:])
    return turned


def pose_in(frame: LocalFrame, pose: Pose2) -> Array:
    """A pose (3,) of the world in a frame."""
    (local,) = world_to_local(frame, np.array([[pose.x, pose.y, pose.phi]]))
    return np.asarray(local)


def reference_in(frame: LocalFrame, reference: PathReference) -> PathReference:
    """References of the world in a frame."""
    x, y, phi = world_to_local(frame, np.column_stack((reference.x, reference.y, reference.phi))).T
    return PathReference(x=x, y=y, phi=phi, slope=reference.slope)


class FrenetErrors(NamedTuple):
    """Errors (n, 3), lag, contouring and heading, and their slopes (n, 3, 6) with respect to the state."""

    values: Out2
    slopes: Out3


def frenet_errors(states: Array, reference: PathReference, direction: int) -> FrenetErrors:
    """Errors of `states` (n, 6) at `reference` (n of them, on the states' branch), Eq. (F1), (F2)."""
    x, y, phi = (np.ascontiguousarray(each) for each in (reference.x, reference.y, reference.phi))
    return _frenet_errors(states, x, y, phi, reference.slope, float(direction))


@kernel
def _frenet_errors(
    states: Array2, x: Array1, y: Array1, phi: Array1, turning: Array1, direction: float
) -> FrenetErrors:
    """Equations (F1), (F2), `turning` being phi_r'."""
    values, slopes = np.empty((len(states), 3)), np.zeros((len(states), 3, STATES))
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
    return FrenetErrors(values, slopes)
