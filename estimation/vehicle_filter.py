"""The vehicle's own state from noisy measurements: how noisy they are is learnt from the measurements.

With f(z) the state z driven on by the commands to the next measurement, and all differences taken along and
across the vehicle:

(V1)  d_k = z_k - f(z_k-1),   r = -E[d_k d_k-1]
(V2)  q = h walk² + (slip s)²,   s the way |v| h, of the heading the turn on it with the largest curvature,
                                  of the speed what the commands change it by
(V3)  K = (sqrt(q² + 4 q r) - q) / (2 r),   at least 1/k with the k-th measurement
(V4)  x_k = z_k + (1 - K) (f(x_k-1) - z_k),   no farther from z_k than `_WIDEST` sqrt(r)

White noise of variance r makes neighbouring differences (V1) pull against each other; a model that is off
makes them alike, which leaves less r, and so more of what is measured. Without noise r is 0 and the state is
what is measured. (V3) is the steady gain of a Kalman filter of a random walk, each quantity by itself; 1/k is
the mean of a few first measurements.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import cos, exp, sin, sqrt

import numpy as np

from estimation.types import Array
from geometry import wrap
from geometry.compiled import Array1, Out1, inner, kernel

_MEMORY = 3.0
"""Time over which the noise is learnt [s]."""
_WALKS = (0.002, 0.002, 5e-4, 0.02, 0.01)
"""What nobody models: of position [m/sqrt(s)] along and across, heading [rad/sqrt(s)], speed [m/s/sqrt(s)]
and steering [rad/sqrt(s)]: lag of drive and steering, slopes that start. The more, the more a measurement
counts."""
_SLIP = 0.05  # share of the distance driven, and of a change of speed, by which the model is off
_WIDEST = 3.0  # the state is no farther from a measurement than so many standard deviations of the noise
QUANTITIES = 5
"""Along [m], across [m], heading [rad], speed [m/s], steering [rad]."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MeasurementNoise:
    """What is known of the noise of a measured state.

    Attributes:
        residual: (5,) the last d of (V1); variance: (5,) r of (V1), negative where differences are alike.
        pairs: so many neighbours d were seen; run: so many measurements without a break.
    """

    residual: Array = field(default_factory=lambda: np.zeros(QUANTITIES))
    variance: Array = field(default_factory=lambda: np.zeros(QUANTITIES))
    pairs: int = 0
    run: int = 0

    @property
    def stds(self) -> Array:
        """(5,) standard deviations of the noise."""
        return np.sqrt(np.maximum(self.variance, 0.0))

    def broken(self) -> MeasurementNoise:
        """The same noise, at the first measurement of a new run."""
        return MeasurementNoise(residual=self.residual, variance=self.variance, pairs=self.pairs)


def filtered(
    noise: MeasurementNoise,
    measured: Array,
    follows: Array,
    expected: Array,
    seconds: float,
    gained: float,
    curvature: float,
) -> tuple[Array, MeasurementNoise]:
    """The state (6,) after one more measurement, and what is known of the noise then.

    Args:
        noise: known before; measured: (6,) x, y, phi, v, delta and a last number that is left as it is.
        follows: (6,) f of the last measurement; expected: (6,) f of the state before; seconds: since then.
        gained: what the commands have changed the speed by since then [m/s].
        curvature: of the vehicle's sharpest bend [1/m].
    """
    heading = float(measured[2])
    residual = _between(measured, follows, heading)
    run, pairs, variance = noise.run + 1, noise.pairs, noise.variance
    if noise.run > 0:  # else the last difference is of another run
        pairs += 1
        share = max(1.0 - exp(-seconds / _MEMORY), 1.0 / pairs)
        variance = variance + share * (-residual * noise.residual - variance)
    known = MeasurementNoise(residual=residual, variance=variance, pairs=pairs, run=run)
    state = measured.copy()
    _correct(measured, expected, variance, seconds, gained, _SLIP * curvature, 1.0 / (run + 1), state)
    return state, known


def _between(one: Array, other: Array, heading: float) -> Array:
    """(5,) one state less another, along and across a heading [rad]."""
    x, y, c, s = one[0] - other[0], one[1] - other[1], cos(heading), sin(heading)
    turn = wrap(float(one[2] - other[2]))
    return np.array((c * x + s * y, c * y - s * x, turn, one[3] - other[3], one[4] - other[4]))


@inner
def _gain(r: float, q: float) -> float:
    """(V3)."""
    if r <= 0.0:
        return 1.0
    return 2.0 / (1.0 + sqrt(1.0 + 4.0 * r / q)) if q > 0.0 else 0.0


@kernel
def _correct(
    measured: Array1,
    expected: Array1,
    variance: Array1,
    seconds: float,
    gained: float,
    turn: float,
    least: float,
    state: Out1,
) -> None:
    """(V2) to (V4) into `state`, which is `measured`."""
    c, s, way = cos(measured[2]), sin(measured[2]), abs(measured[3]) * seconds
    x, y = expected[0] - measured[0], expected[1] - measured[1]
    off = np.array((c * x + s * y, c * y - s * x, 0.0, expected[3] - measured[3], expected[4] - measured[4]))
    off[2] = (expected[2] - measured[2] + np.pi) % (2.0 * np.pi) - np.pi
    slips = (_SLIP * way, _SLIP * way, turn * way, _SLIP * abs(gained), 0.0)
    for i in range(QUANTITIES):
        q = seconds * _WALKS[i] ** 2 + slips[i] ** 2
        most = _WIDEST * sqrt(max(variance[i], 0.0))
        kept = (1.0 - max(_gain(variance[i], q), least)) * off[i]
        off[i] = min(max(kept, -most), most)
    state[0] += c * off[0] - s * off[1]
    state[1] += s * off[0] + c * off[1]
    for i in range(2, QUANTITIES):
        state[i] += off[i]
