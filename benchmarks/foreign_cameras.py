"""Cameras with faults for `benchmarks.foreign`: each sees a true dock, noisily, at some rate.

A `Dock` says where the dock truly is over time. `DockCamera` detects it in the vehicle's frame; its faults
turn detections by 180 deg, put them elsewhere in bursts, and stamp them wrongly.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import cos, hypot, pi, sin

import numpy as np

from benchmarks.foreign import Array, at_time
from estimation import Frame, GoalMeasurement
from geometry import Pose2


@dataclass(frozen=True, slots=True, kw_only=True)
class MovingDock:
    """The true dock: at `pose`, moving by `velocity` (x, y, world) [m/s] from `begin` to `end` [s]."""

    pose: Pose2
    velocity: tuple[float, float] = (0.0, 0.0)
    begin: float = 0.0
    end: float = 0.0

    def at(self, time: float) -> Pose2:
        """The true dock."""
        moved = min(max(time, self.begin), self.end) - self.begin
        return Pose2(
            self.pose.x + moved * self.velocity[0], self.pose.y + moved * self.velocity[1], self.pose.phi
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Bursts:
    """False detections that agree with each other.

    Attributes:
        period: from the beginning of one to that of the next [s]; length: of each [s]; first: begins at [s].
        offset: from the true dock, along and across [m], heading [rad].
        turns: each burst has another direction of its offset.
    """

    period: float = 3.0
    length: float = 1.0
    first: float = 0.0
    offset: tuple[float, float, float] = (1.0, 0.0, 0.0)
    turns: bool = True

    def at(self, time: float) -> Pose2 | None:
        """What is added to the dock's pose, in its own frame, or None between two bursts."""
        count, phase = divmod(time - self.first, self.period)
        if count < 0 or phase >= self.length - 1e-9:
            return None
        x, y, turn = self.offset
        angle = 2.4 * count if self.turns else 0.0
        return Pose2(cos(angle) * x - sin(angle) * y, sin(angle) * x + cos(angle) * y, turn)


@dataclass(slots=True, kw_only=True)
class DockCamera:
    """Detects the dock in the vehicle's frame.

    Attributes:
        dock: the truth; rate: [1/s]; delay: from exposure to arrival [s].
        noise: standard deviations at 10 m, in proportion to the range [m], [rad]; floor: at least.
        reach: no detection beyond this [m].
        flips: share of the detections that are turned by 180 deg; lever: of the marker, ahead of the goal in
            its frame [m]: a detection is turned about it.
        bursts: of false detections, or None.
        unit: of the stamps, in a second; 1000: milliseconds. late: stamps are older than the truth [s].
    """

    dock: MovingDock
    rate: float = 10.0
    delay: float = 0.0
    noise: tuple[float, float] = (0.05, 0.035)
    floor: tuple[float, float] = (0.002, 0.001)
    reach: float = 15.0
    flips: float = 0.0
    lever: float = 0.0
    bursts: Bursts | None = None
    unit: float = 1.0
    late: float = 0.0
    _next: float = field(default=0.0, init=False)

    def __call__(self, history: Array, rng: np.random.Generator) -> Sequence[GoalMeasurement]:
        """Detections that arrive now."""
        now = float(history[-1, 0])
        if now < self._next - 1e-9:
            return ()
        self._next = max(self._next, now - 1.0 / self.rate) + 1.0 / self.rate
        seen = at_time(history, self.delay)
        stamp, x, y, phi = map(float, seen[:4])
        vehicle, goal = Pose2(x, y, phi), self._seen(stamp, rng)
        off = goal.relative_to(vehicle)
        far = hypot(off.x, off.y)
        error = rng.normal(size=3)
        if far > self.reach:
            return ()
        share = far / 10.0
        position, heading = (max(f, n * share) for f, n in zip(self.floor, self.noise, strict=True))
        x, y, phi = off.x + position * error[0], off.y + position * error[1], off.phi + heading * error[2]
        stamp = (stamp - self.late) * self.unit
        return (GoalMeasurement(stamp=stamp, x=x, y=y, phi=phi, frame=Frame.VEHICLE),)

    def _seen(self, stamp: float, rng: np.random.Generator) -> Pose2:
        goal = self.dock.at(stamp)
        if rng.random() < self.flips:
            return goal.compose(Pose2(2.0 * self.lever, 0.0, pi))
        off = None if self.bursts is None else self.bursts.at(stamp)
        return goal if off is None else goal.compose(off)
