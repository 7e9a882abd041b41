"""The goal as a detector sees it: noisy, late, now and then not at all or in the wrong place."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import cos, hypot, pi, sin
from typing import Protocol

import numpy as np

from estimation import Frame, GoalMeasurement
from geometry import Pose2
from rti_mpcc.simulation.plant import SAME_TIME
from rti_mpcc.simulation.scenario import MeasurementSection


class Detector(Protocol):
    """What can be put into the loop to look for the goal.

    Attributes:
        rate: exposures a second [Hz].
        delay: from an exposure to the arrival of what was detected in it [s].
    """

    @property
    def rate(self) -> float: ...  # noqa: D102
    @property
    def delay(self) -> float: ...  # noqa: D102

    def expose(self, stamp: float, vehicle: Pose2, goal: Pose2, *, last_part: bool) -> GoalMeasurement | None:
        """What is detected of `goal` from `vehicle` (both true poses) at `stamp` [s], or None.

        Args:
            last_part: whether the vehicle is on the last part of its route.
        """
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulatedDetector:
    """Detections in the vehicle's frame by the laws of [goal.measurement].

    Each exposure draws the same number of random values whatever it sees, so that two runs with one seed
    are given the same noise.
    """

    section: MeasurementSection
    random: np.random.Generator

    @property
    def rate(self) -> float:
        """Exposures a second [Hz]."""
        return self.section.rate

    @property
    def delay(self) -> float:
        """From exposure to arrival [s]."""
        return self.section.delay

    def expose(self, stamp: float, vehicle: Pose2, goal: Pose2, *, last_part: bool) -> GoalMeasurement | None:
        """See `Detector`."""
        section = self.section
        dropped, outlier, direction = self.random.random(3)
        noise = self.random.standard_normal(3)
        seen = goal.relative_to(vehicle)
        distance = hypot(seen.x, seen.y)
        if not section.blind_range <= distance <= section.visible_range or dropped < section.dropout:
            return None
        if section.visible_after_cusp and not last_part:
            return None
        x, y, phi = noise * np.sqrt(np.diag(section.noise.covariance(distance)))
        if outlier < section.outlier:
            x += section.outlier_size * cos(2.0 * pi * direction)
            y += section.outlier_size * sin(2.0 * pi * direction)
        return GoalMeasurement(
            stamp=stamp, x=seen.x + x, y=seen.y + y, phi=seen.phi + phi, frame=Frame.VEHICLE
        )


@dataclass(slots=True, kw_only=True)
class Lookout:
    """A detector on the clock of a run: when it exposes, and what has not arrived yet."""

    detector: Detector
    exposures: int = 0
    under_way: list[tuple[float, GoalMeasurement]] = field(default_factory=list)

    @property
    def next_exposure(self) -> float:
        """Time of the next exposure [s]."""
        return round(self.exposures / self.detector.rate, 9)

    def expose(self, vehicle: Pose2, goal: Pose2, *, last_part: bool) -> None:
        """Expose now, at `next_exposure`."""
        stamp = self.next_exposure
        self.exposures += 1
        measurement = self.detector.expose(stamp, vehicle, goal, last_part=last_part)
        if measurement is not None:
            self.under_way.append((stamp + self.detector.delay, measurement))

    def arrived(self, now: float) -> tuple[GoalMeasurement, ...]:
        """What has arrived by `now` [s] and was not handed out before."""
        ready = tuple(m for at, m in self.under_way if at <= now + SAME_TIME)
        self.under_way = [(at, m) for at, m in self.under_way if at > now + SAME_TIME]
        return ready
