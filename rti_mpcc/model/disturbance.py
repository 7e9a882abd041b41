"""What acts beside the commands, and the coordinates in which it is not seen.

The controller plans with what acts, the *effective* acceleration and steering; what is commanded and measured
is without them:

(O4)  a_eff = (1 + g) a + d,   tan(delta_eff) = (1 + c) tan(delta + o)

A vehicle that turns too tightly, by a wrong wheelbase say, acts as if its wheels stood otherwise.
So the model (M1) stays as it is. Only where something comes in (the measured state, the commands under way)
or goes out (a command, a plan) one is turned into the other.
"""

from __future__ import annotations

from math import atan, isfinite, tan
from typing import NamedTuple

from geometry.compiled import inner
from rti_mpcc.model.layout import DELTA
from rti_mpcc.types import Array

ACROSS = 1.55
"""Wheels turned farther than this are across the vehicle [rad]: the tangent ends there."""


class Disturbance(NamedTuple):
    """d, along the body's axis, to the front [m/s²]; o, of the wheels to the left [rad]; 1 + g, 1 + c."""

    acceleration: float = 0.0
    steering: float = 0.0
    gain: float = 1.0
    turn: float = 1.0

    def commanded(self, acceleration: float) -> float:
        """What has to be commanded [m/s²] for an acceleration that acts."""
        return (acceleration - self.acceleration) / self.gain

    def acting(self, commanded: float) -> float:
        """The acceleration [m/s²] that acts when this is commanded."""
        return self.gain * commanded + self.acceleration

    def acting_steering(self, measured: float) -> float:
        """The angle [rad] that acts when this is measured, (O4)."""
        if self.turn == 1.0:
            return measured + self.steering
        return atan(self.turn * tan(min(max(measured + self.steering, -ACROSS), ACROSS)))

    def measured_steering(self, acting: float) -> float:
        """The angle [rad] that is measured when this acts, (O4); NaN stays."""
        if self.turn == 1.0 or not isfinite(acting):
            return acting - self.steering
        return atan(tan(acting) / self.turn) - self.steering

    def commanded_rate(self, rate: float, acting: float, seconds: float) -> float:
        """The steering rate [rad/s] by which an angle that acts changes at `rate` [rad/s] for so long [s]."""
        if self.turn == 1.0:
            return rate
        end = self.measured_steering(acting + seconds * rate)
        return (end - self.measured_steering(acting)) / seconds

    def effective(self, measured: Array) -> Array:
        """The state (6,) with the steering that acts."""
        state = measured.copy()
        state[DELTA] = self.acting_steering(float(state[DELTA]))
        return state


acting_steering, measured_steering = inner(Disturbance.acting_steering), inner(Disturbance.measured_steering)
"""In kernels."""
UNDISTURBED = Disturbance()
