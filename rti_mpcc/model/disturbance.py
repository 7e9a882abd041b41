"""What acts beside the commands, and the coordinates in which it is not seen.

The controller plans with what acts, the *effective* acceleration and steering; what is commanded and measured
is without them:

(O4)  a_eff = (1 + g) a + d,   delta_eff = delta + o

So the model (M1) stays as it is. Only where something comes in (the measured state, the commands under way)
or goes out (a command, a plan) one is turned into the other.
"""

from __future__ import annotations

from typing import NamedTuple

from rti_mpcc.model.layout import DELTA
from rti_mpcc.types import Array


class Disturbance(NamedTuple):
    """d, along the body's axis, positive to the front [m/s²]; o, of the wheels to the left [rad]; 1 + g."""

    acceleration: float = 0.0
    steering: float = 0.0
    gain: float = 1.0

    def commanded(self, acceleration: float) -> float:
        """What has to be commanded [m/s²] for an acceleration that acts."""
        return (acceleration - self.acceleration) / self.gain

    def acting(self, commanded: float) -> float:
        """The acceleration [m/s²] that acts when this is commanded."""
        return self.gain * commanded + self.acceleration

    def effective(self, measured: Array) -> Array:
        """The state (6,) with the steering that acts."""
        state = measured.copy()
        state[DELTA] += self.steering
        return state


UNDISTURBED = Disturbance()
