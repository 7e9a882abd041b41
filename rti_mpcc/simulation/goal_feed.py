"""The true goal of a run, and what the controller is told of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from math import hypot
from typing import NamedTuple

from estimation import GoalFilterConfig, GoalMeasurement, PoseHistory
from estimation.measurement import in_world
from geometry import Pose2
from rti_mpcc.errors import InputError
from rti_mpcc.simulation.detector import Lookout
from rti_mpcc.simulation.scenario import ShiftSection
from rti_mpcc.types import VehicleState

RAW_HISTORY = 10.0
"""So late a detection may arrive when it is used as it is [s]."""


class GoalSource(Enum):
    """How the controller knows the goal of a scenario with [goal.measurement]."""

    DETECTED = "detected"
    """Detections go through the controller's filter."""
    RAW = "raw"
    """The newest detection is the goal, as it is: for comparison."""
    KNOWN = "known"
    """The true goal is told at every cycle: for comparison."""


def source_in(scenario: str, asked: GoalSource, *, detector: bool) -> GoalSource:
    """How the goal is known in a run of the scenario of this name, with or without a detector.

    Raises InputError where a source is asked for that needs a detector, and there is none.
    """
    if detector:
        return asked
    if asked is not GoalSource.DETECTED:
        raise InputError(
            f"goal_source = {asked.value!r}: must be {GoalSource.DETECTED.value!r}, the default, "
            f"in a scenario without [goal.measurement] such as {scenario}"
        )
    return GoalSource.KNOWN


@dataclass(frozen=True, slots=True, kw_only=True)
class TrueGoal:
    """The true goal, and the shifts of it still to come."""

    pose: Pose2
    shifts: tuple[ShiftSection, ...] = ()
    moved: bool = False

    def seen_from(self, x: float, y: float) -> TrueGoal:
        """Moved by every shift whose distance the rear axle has come within."""
        goal = self
        for shift in self.shifts:
            if hypot(x - goal.pose.x, y - goal.pose.y) <= shift.at_distance:
                left = tuple(other for other in goal.shifts if other is not shift)
                goal = TrueGoal(pose=goal.pose.compose(Pose2(*shift.offset)), shifts=left, moved=True)
        return goal


class Given(NamedTuple):
    """Arguments of a step: goal, None for the one told before, and detections."""

    goal: Pose2 | None
    measurements: tuple[GoalMeasurement, ...]


@dataclass(slots=True, kw_only=True)
class GoalFeed:
    """What the controller is told of the goal, cycle by cycle.

    Attributes:
        source: see there; without a `lookout` the goal is known.
        planned: the goal at the start, None for the path's last pose.
        lookout: the detector, or None.
        newest: the goal by the newest detection; its stamp [s]; and where the vehicle was measured, to place
            raw detections by.
    """

    source: GoalSource
    planned: Pose2 | None
    lookout: Lookout | None
    newest: Pose2 | None = None
    stamp: float = -1.0
    poses: PoseHistory = field(default_factory=PoseHistory)

    def given(self, now: float, state: VehicleState, goal: TrueGoal) -> Given:
        """What the controller is told at `now` [s], where the vehicle's state is measured as `state`."""
        arrived = self.lookout.arrived(now) if self.lookout else ()
        if self.source is GoalSource.KNOWN or self.lookout is None:
            return Given(goal.pose if goal.moved or self.planned is not None else None, ())
        if self.source is GoalSource.DETECTED:
            return Given(self.planned, arrived)
        self.poses = self.poses.noted(now, Pose2(state.x, state.y, state.phi), length=RAW_HISTORY)
        self._take(arrived)
        return Given(self.planned if self.newest is None else self.newest, ())

    def _take(self, measurements: Sequence[GoalMeasurement]) -> None:
        for measurement in measurements:
            placed = replace(measurement, vehicle=measurement.vehicle or self.poses.at(measurement.stamp))
            detection = in_world(placed, GoalFilterConfig())
            if not isinstance(detection, str) and detection.stamp > self.stamp:
                self.newest, self.stamp = detection.pose, detection.stamp
