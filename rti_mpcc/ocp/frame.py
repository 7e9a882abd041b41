"""Coordinates local to the vehicle: numbers stay small wherever in the world it is, and however turned."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import cos, sin

import numpy as np

from geometry import HalfPlanes, PathReference, Pose2
from rti_mpcc.model.layout import PHI, X, Y
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

    def states_in(self, states: Array) -> Array:
        """World states (..., >= 3) in this frame."""
        out = states.copy()
        c, s = cos(self.phi), sin(self.phi)
        dx, dy = states[..., X] - self.x, states[..., Y] - self.y
        out[..., X], out[..., Y] = c * dx + s * dy, -s * dx + c * dy
        out[..., PHI] -= self.phi
        return out

    def states_out(self, states: Array) -> Array:
        """Local states (..., >= 3) in the world."""
        out = states.copy()
        c, s = cos(self.phi), sin(self.phi)
        out[..., X] = self.x + c * states[..., X] - s * states[..., Y]
        out[..., Y] = self.y + s * states[..., X] + c * states[..., Y]
        out[..., PHI] += self.phi
        return out

    def reference_in(self, reference: PathReference) -> PathReference:
        """References in this frame."""
        pose = self.states_in(np.stack([reference.x, reference.y, reference.phi], axis=-1))
        return replace(reference, x=pose[:, X], y=pose[:, Y], phi=pose[:, PHI])

    def pose_in(self, pose: Pose2) -> Pose2:
        """A pose in this frame, heading not wrapped."""
        local = self.states_in(np.array([pose.x, pose.y, pose.phi]))
        return Pose2(float(local[X]), float(local[Y]), float(local[PHI]))

    def planes_in(self, planes: HalfPlanes) -> HalfPlanes:
        """Half-planes with normals turned into this frame (points stay in the world, nothing reads them)."""
        c, s = cos(self.phi), sin(self.phi)
        turn = np.array([[c, -s], [s, c]])
        return replace(planes, normal=planes.normal @ turn)
