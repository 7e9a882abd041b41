"""The vehicle's own state from noisy measurements, whose noise is learnt from them; and its poses of late.

With m the measured state, z the estimate, and F(z) the state z driven on by the commands to the next
measurement; all differences are taken along and across the vehicle:

(V1)  nu_k = m_k - F(m_k-1),   R = -E[nu_k nu_k-1]
(V2)  Q = h walk² + (slip l)²,   l the distance |v| h; for the heading the largest turn over that
                                  distance, for the speed its change by the commands
(V3)  K = (sqrt(Q² + 4 Q R) - Q) / (2 R),   at least 1/k with the k-th measurement
(V4)  z_k = m_k + (1 - K) (F(z_k-1) - m_k),   no farther from m_k than `_WIDEST` sqrt(R)

White noise of variance R makes neighbouring differences (V1) pull against each other; a model that is off
makes them alike, which leaves less R, and so more of what is measured. Without noise R is 0 and the state is
what is measured. (V3) is the steady gain of a Kalman filter of a random walk, each quantity by itself; 1/k is
the mean of a few first measurements.
"""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import dataclass, field, replace
from math import ceil, cos, exp, isfinite, pi, sin, sqrt
from typing import NamedTuple

import numpy as np

from estimation.types import Array
from geometry import Pose2, lift
from geometry.compiled import Array1, Out1, inner, kernel
from geometry.validation import validated

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
GAP = 0.5
"""Poses farther apart in time than this [s] are not interpolated between."""


class Noise(NamedTuple):
    """Standard deviations: along, across [m], heading [rad], speed [m/s], steering [rad]."""

    along: float = 0.0
    across: float = 0.0
    heading: float = 0.0
    speed: float = 0.0
    steering: float = 0.0


class Elapsed(NamedTuple):
    """Since the last measurement: the time [s], by what the commands have changed the speed [m/s], and the
    curvature of the sharpest bend that the vehicle can drive [1/m]."""

    seconds: float
    gained: float
    curvature: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MeasurementNoise:
    """What is known of the noise of a measured state.

    Attributes:
        residual: (5,) the last nu of (V1); variance: (5,) R of (V1), negative where differences are alike.
        stds: standard deviations of the noise, by R.
        pairs: number of neighbours nu seen; run: number of measurements without a break.
    """

    residual: Array = field(default_factory=lambda: np.zeros(QUANTITIES))
    variance: Array = field(default_factory=lambda: np.zeros(QUANTITIES))
    stds: Noise = field(default_factory=Noise)
    pairs: int = 0
    run: int = 0

    def broken(self) -> MeasurementNoise:
        """The same noise, at the first measurement of a new run."""
        return replace(self, run=0)


def filtered(
    noise: MeasurementNoise, measured: Array, follows: Array, expected: Array, since: Elapsed
) -> tuple[Array, MeasurementNoise]:
    """The state (6,) after one more measurement, and what is known of the noise then.

    Args:
        noise: known before; measured: (6,) x, y, phi, v, delta and a last number that is left as it is.
        follows: (6,) F of the last measurement; expected: (6,) F of the estimate before.
    """
    residual = np.empty(QUANTITIES)
    _between(measured, follows, residual)
    run, pairs, variance = noise.run + 1, noise.pairs, noise.variance
    if noise.run > 0:  # else the last difference is of another run
        pairs += 1
        share = max(1.0 - exp(-since.seconds / _MEMORY), 1.0 / pairs)
        variance = variance + share * (-residual * noise.residual - variance)
    stds = Noise(*np.sqrt(variance.clip(0.0)).tolist())
    known = MeasurementNoise(residual=residual, variance=variance, stds=stds, pairs=pairs, run=run)
    state = measured.copy()
    _correct(measured, expected, variance, since, 1.0 / (run + 1), state)
    return state, known


@kernel
def _between(one: Array1, other: Array1, out: Out1) -> None:
    """(5,) one state less another, along and across the heading of the first one."""
    x, y, c, s = one[0] - other[0], one[1] - other[1], cos(one[2]), sin(one[2])
    turn = one[2] - other[2]
    out[0], out[1], out[2] = c * x + s * y, c * y - s * x, turn - 2.0 * pi * ceil((turn - pi) / (2.0 * pi))
    out[3], out[4] = one[3] - other[3], one[4] - other[4]


@inner
def _gain(r: float, q: float) -> float:
    """(V3)."""
    if r <= 0.0:
        return 1.0
    return 2.0 / (1.0 + sqrt(1.0 + 4.0 * r / q)) if q > 0.0 else 0.0


@kernel
def _correct(
    measured: Array1, expected: Array1, variance: Array1, since: Elapsed, least: float, state: Out1
) -> None:
    """(V2) to (V4) into `state`, which is `measured`."""
    c, s, way = cos(measured[2]), sin(measured[2]), abs(measured[3]) * since.seconds
    x, y = expected[0] - measured[0], expected[1] - measured[1]
    off = np.array((c * x + s * y, c * y - s * x, 0.0, expected[3] - measured[3], expected[4] - measured[4]))
    off[2] = (expected[2] - measured[2] + np.pi) % (2.0 * np.pi) - np.pi
    slips = (_SLIP * way, _SLIP * way, _SLIP * since.curvature * way, _SLIP * abs(since.gained), 0.0)
    for i in range(QUANTITIES):
        q = since.seconds * _WALKS[i] ** 2 + slips[i] ** 2
        most = _WIDEST * sqrt(max(variance[i], 0.0))
        kept = (1.0 - max(_gain(variance[i], q), least)) * off[i]
        off[i] = min(max(kept, -most), most)
    state[0] += c * off[0] - s * off[1]
    state[1] += s * off[0] + c * off[1]
    for i in range(2, QUANTITIES):
        state[i] += off[i]


@dataclass(frozen=True, slots=True)
class PoseHistory:
    """Vehicle poses by time, the latest last. A value: `noted` gives a new one.

    Attributes:
        stamps: [s], increasing; poses: as many, world frame.
    """

    stamps: tuple[float, ...] = ()
    poses: tuple[Pose2, ...] = ()

    @validated(late=True)
    def noted(self, stamp: float, pose: Pose2, *, length: float) -> PoseHistory:
        """With one more pose, without those older than `length` [s]. A clock that runs back begins anew."""
        if not isfinite(stamp):
            return self
        if self.stamps and stamp <= self.stamps[-1]:
            if stamp == self.stamps[-1]:
                return PoseHistory(self.stamps, (*self.poses[:-1], pose))
            return PoseHistory((stamp,), (pose,))
        # One pose older than the length stays: a stamp just inside of it lies between two.
        first = max(bisect_left(self.stamps, stamp - length) - 1, 0)
        return PoseHistory((*self.stamps[first:], stamp), (*self.poses[first:], pose))

    @validated(late=True)
    def at(self, stamp: float, *, ahead: float = 0.0) -> Pose2 | None:
        """The pose at `stamp` [s], interpolated; None where it is not known.

        Up to `ahead` [s] behind the latest pose the motion is carried on from the last two.
        """
        stamps = self.stamps
        if not stamps or not isfinite(stamp) or stamp < stamps[0] or stamp > stamps[-1] + ahead:
            return None
        after = bisect_left(stamps, stamp)
        if after < len(stamps) and stamps[after] == stamp:
            return self.poses[after]
        after = min(after, len(stamps) - 1)
        first = max(after - 1, 0)
        # What is carried on is a motion over as long a time at least: in a shorter one noise looks fast.
        while first > 0 and stamps[after] - stamps[first] < stamp - stamps[after]:
            first -= 1
        if after == 0 or stamps[after] - stamps[first] > GAP:
            return None
        before, last = self.poses[first], self.poses[after]
        share = min((stamp - stamps[first]) / (stamps[after] - stamps[first]), 2.0)
        turn = lift(last.phi, before.phi) - before.phi
        return Pose2(
            before.x + share * (last.x - before.x),
            before.y + share * (last.y - before.y),
            before.phi + share * turn,
        )

    @validated(late=True)
    def mean(self, since: float) -> Pose2 | None:
        """The mean of the poses from `since` on [s], on the branch of the latest; None: there are none."""
        poses = self.poses[bisect_left(self.stamps, since) :]
        if not poses:
            return None
        last, share = poses[-1], 1.0 / len(poses)
        return Pose2(
            last.x + share * sum(pose.x - last.x for pose in poses),
            last.y + share * sum(pose.y - last.y for pose in poses),
            last.phi + share * sum(lift(pose.phi, last.phi) - last.phi for pose in poses),
        )
