"""Coordinates local to the vehicle: numbers stay small wherever in the world it is, and however turned."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, sin

import numpy as np

from geometry import PathReference, Pose2
from geometry.compiled import Array2, Out2, kernel
from rti_mpcc.model.layout import PHI, POSE, X, Y
from rti_mpcc.types import Array


@dataclass(frozen=True, slots=True, kw_only=True)
class LocalFrame:
    """A frame at a pose x [m], y [m], phi [rad] (any branch; headings are counted from it)."""

    x: float
    y: float
    phi: float

    @classmethod
    def at(cls, state: Array) -> LocalFrame:
        """The frame in which `state` (>= 3,) has pose 0."""
        return cls(x=float(state[X]), y=float(state[Y]), phi=float(state[PHI]))

    @property
    def _turn(self) -> complex:
        return complex(cos(self.phi), sin(self.phi))

    def states_in(self, states: Array) -> Array:
        """World states (..., >= 3) in this frame."""
        out = np.empty(states.shape)
        _poses_in(_rows(states), self.x, self.y, self.phi, _rows(out))
        return out

    def states_out(self, states: Array) -> Array:
        """Local states (..., >= 3) in the world."""
        out = np.empty(states.shape)
        _poses_out(_rows(states), self.x, self.y, self.phi, _rows(out))
        return out

    def reference_in(self, reference: PathReference) -> PathReference:
        """References in this frame."""
        poses = np.column_stack((reference.x, reference.y, reference.phi))
        _poses_in(poses, self.x, self.y, self.phi, poses)
        x, y, phi = poses.T
        return PathReference(x=x, y=y, phi=phi, slope=reference.slope)

    def pose_in(self, pose: Pose2) -> Pose2:
        """A pose in this frame, heading not wrapped."""
        place = complex(pose.x - self.x, pose.y - self.y) * self._turn.conjugate()
        return Pose2(place.real, place.imag, pose.phi - self.phi)


def _rows(states: Array) -> Array:
    return states.reshape(-1, states.shape[-1])


@kernel
def _poses_in(poses: Array2, x: float, y: float, phi: float, turned: Out2) -> None:
    c, s = cos(phi), sin(phi)
    for k in range(len(poses)):
        dx, dy = poses[k, X] - x, poses[k, Y] - y
        turned[k, X] = c * dx + s * dy
        turned[k, Y] = c * dy - s * dx
        turned[k, PHI] = poses[k, PHI] - phi
        for j in range(POSE, poses.shape[1]):
            turned[k, j] = poses[k, j]


@kernel
def _poses_out(poses: Array2, x: float, y: float, phi: float, turned: Out2) -> None:
    c, s = cos(phi), sin(phi)
    for k in range(len(poses)):
        dx, dy = poses[k, X], poses[k, Y]
        turned[k, X] = x + (c * dx - s * dy)
        turned[k, Y] = y + (s * dx + c * dy)
        turned[k, PHI] = poses[k, PHI] + phi
        for j in range(POSE, poses.shape[1]):
            turned[k, j] = poses[k, j]
