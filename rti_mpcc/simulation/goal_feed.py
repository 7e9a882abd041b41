"""The true goal of a run, what a detector or a camera sees of it, and what the controller is given.

Where [goal.camera] is given, rendered pictures of the board, looked at by the real detector, take the place
of the random detections of [goal.measurement]: its rate, delay, ranges and `visible_after_cusp` hold for the
camera, its noise, dropouts and outliers do not.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from enum import Enum
from math import cos, hypot, pi, sin
from typing import Protocol

import numpy as np

from estimation import CharucoDetection, CharucoGoalDetector, GoalFilterConfig, GoalMeasurement, PoseHistory
from estimation.measurement import Frame, in_world
from geometry import Pose2
from rti_mpcc.errors import InputError
from rti_mpcc.simulation.camera import BoardCamera, Image
from rti_mpcc.simulation.plant import SAME_TIME
from rti_mpcc.simulation.sections.goal import CameraSection, GoalSection, MeasurementSection, ShiftSection
from rti_mpcc.types import VehicleState

RAW_HISTORY = 10.0  # a detection that is used as it is may arrive this late [s]
Seen = Callable[[float, Image, CharucoDetection | None], None]
"""Called with every picture: stamp [s], the picture, and the detection that the controller gets, or None."""
_OFTEN, _EXACT = MeasurementSection(rate=5.0, delay=0.1, visible_range=1e3), CameraSection()


class GoalSource(Enum):
    """How the controller knows the goal of a scenario with [goal.measurement]."""

    DETECTED = "detected"  # detections go through the controller's filter
    RAW = "raw"  # the newest detection is the goal, as it is: for comparison
    KNOWN = "known"  # the true goal is given at every cycle: for comparison


def source_in(scenario: str, source: GoalSource, *, detector: bool) -> GoalSource:
    """How the goal is known in a run of this scenario. Raises InputError if that needs a detector."""
    if detector:
        return source
    if source is not GoalSource.DETECTED:
        raise InputError(
            f"goal_source = {source.value!r}: must be {GoalSource.DETECTED.value!r}, the default, "
            f"in a scenario without [goal.measurement] such as {scenario}"
        )
    return GoalSource.KNOWN


class Detector(Protocol):
    """A detector of the goal in the loop.

    Attributes:
        rate: number of exposures a second [Hz]; delay: time from an exposure to its detection's arrival [s].
    """

    @property
    def rate(self) -> float: ...  # noqa: D102
    @property
    def delay(self) -> float: ...  # noqa: D102

    def expose(self, stamp: float, vehicle: Pose2, goal: Pose2, *, last_part: bool) -> GoalMeasurement | None:
        """The detection of `goal` from `vehicle` (both true poses) at `stamp` [s], or None.

        `last_part`: whether the vehicle is on the last part of its route.
        """


@dataclass(kw_only=True)
class TimedDetector:
    """A `Detector` with the rate and the delay of a [goal.measurement]."""

    section: MeasurementSection

    def __post_init__(self) -> None:
        self.rate, self.delay = self.section.rate, self.section.delay


@dataclass(kw_only=True)
class SimulatedDetector(TimedDetector):
    """Detections in the vehicle's frame by the laws of [goal.measurement].

    Each exposure draws the same number of random values: two runs with one seed have the same noise.
    """

    random: np.random.Generator

    def expose(self, stamp: float, vehicle: Pose2, goal: Pose2, *, last_part: bool) -> GoalMeasurement | None:
        """See `Detector`."""
        section = self.section
        dropped, outlier, direction = self.random.random(3)
        noise = self.random.standard_normal(3)
        seen = goal.relative_to(vehicle)
        distance = hypot(seen.x, seen.y)
        hidden = section.visible_after_cusp and not last_part
        if hidden or not section.sees(distance) or dropped < section.dropout:
            return None
        x, y, phi = noise * np.sqrt(np.diag(section.noise.covariance(distance)))
        if outlier < section.outlier:
            x += section.outlier_size * cos(2.0 * pi * direction)
            y += section.outlier_size * sin(2.0 * pi * direction)
        return GoalMeasurement(
            stamp=stamp, x=seen.x + x, y=seen.y + y, phi=seen.phi + phi, frame=Frame.VEHICLE
        )


@dataclass(kw_only=True)
class CameraDetector(TimedDetector):
    """The goal by camera: a picture at each exposure, and the detection in it. See `Detector`."""

    pictures: BoardCamera  # by the true camera, with the true board and light
    detector: CharucoGoalDetector  # works with the assumed camera and board
    section: MeasurementSection = _OFTEN  # rate, delay and ranges
    faults: CameraSection = _EXACT  # lost and wrong detections
    seen: Seen | None = None  # called with every exposure
    first: float | None = None  # time of the first detection [s]
    erred: bool = False  # the wrong detection is over

    @classmethod
    def of(
        cls, section: CameraSection, limits: MeasurementSection, seed: int, seen: Seen | None
    ) -> CameraDetector:
        """Mount the camera and the boards. Raises as `CameraSection.check`."""
        random = np.random.default_rng([seed, 7])
        mount, board = section.mount, section.board
        off = random.standard_normal(3) * (mount.height_std, mount.tilt_std, mount.tilt_std)
        height, pitch, roll = (0.0 if section.exact else 1.0) * off
        turned = {"z": mount.z + height, "pitch": mount.pitch + pitch, "roll": mount.roll + roll}
        others = list(zip(section.other_boards, (Pose2(*o.pose) for o in section.others), strict=True))
        pictures = BoardCamera(mount.changed(**turned), board, section.optics, random, others)
        detector = CharucoGoalDetector(mount, board)
        return cls(section=limits, faults=section, pictures=pictures, detector=detector, seen=seen)

    def expose(self, stamp: float, vehicle: Pose2, goal: Pose2, *, last_part: bool) -> GoalMeasurement | None:
        """See `Detector`. Before the last part no picture is taken where the scenario says so."""
        if self.section.visible_after_cusp and not last_part:
            return None
        picture = self.pictures.expose(vehicle, goal)
        distance = hypot(goal.x - vehicle.x, goal.y - vehicle.y)
        detection = self._detected(picture, stamp) if self.section.sees(distance) else None
        if self.seen is not None:
            self.seen(stamp, picture, detection)
        return None if detection is None else detection.measurement

    def _detected(self, picture: Image, stamp: float) -> CharucoDetection | None:
        """The detection in a picture within range: none while it is lost, and once a wrong one."""
        since = 0.0 if self.first is None else stamp - self.first
        lost, wrong = self.faults.lost, self.faults.wrong
        is_lost = lost is not None and lost[0] <= since < lost[1]
        # A lost detection is not computed, as that takes longer than drawing; the first one starts the clock.
        detection = None if is_lost and self.first is not None else self.detector.detect(picture, stamp)
        if detection is None:
            return None
        if self.first is None:
            self.first = stamp
        if is_lost:
            return None
        if wrong is None or self.erred or since < wrong.after:
            return detection
        self.erred = True
        measurement = detection.measurement
        off = Pose2(measurement.x, measurement.y, measurement.phi).compose(Pose2(*wrong.offset))
        return replace(detection, measurement=replace(measurement, x=off.x, y=off.y, phi=off.phi))


def detector_of(goal: GoalSection, seed: int, seen: Seen | None) -> Detector | None:
    """The detector that a scenario describes, None where it has none. Raises as `CameraSection.check`."""
    if goal.measurement is None:
        return None
    if goal.camera is not None:
        return CameraDetector.of(goal.camera, goal.measurement, seed, seen)
    return SimulatedDetector(section=goal.measurement, random=np.random.default_rng([seed, 1]))


@dataclass(slots=True, kw_only=True)
class GoalFeed:
    """The true goal, the detector on the clock of a run, and the goal that the controller is given."""

    source: GoalSource
    planned: Pose2 | None  # at the start; None: the path's last pose
    goal: Pose2  # the true one
    shifts: tuple[ShiftSection, ...] = ()  # of the true goal, still to come
    moved: bool = False  # whether there was a shift
    detector: Detector | None
    exposures: int = 0  # number of them
    under_way: list[tuple[float, GoalMeasurement]] = field(default_factory=list)  # (arrival [s], detection)
    newest: Pose2 | None = None  # the goal by the newest raw detection
    stamp: float = -1.0  # of that detection [s]
    poses: PoseHistory = field(default_factory=PoseHistory)  # to place raw detections

    def approach(self, vehicle: Pose2) -> Pose2:
        """The goal, moved by every shift whose distance the rear axle has come within."""
        for shift in self.shifts:
            if hypot(vehicle.x - self.goal.x, vehicle.y - self.goal.y) <= shift.at_distance:
                self.shifts = tuple(other for other in self.shifts if other is not shift)
                self.goal, self.moved = self.goal.compose(Pose2(*shift.offset)), True
        return self.goal

    def next_exposure(self, until: float) -> float | None:
        """Time [s] of the next exposure, if that is not after `until`."""
        if self.detector is None:
            return None
        at = round(self.exposures / self.detector.rate, 9)
        return at if at <= until + SAME_TIME else None

    def expose(self, stamp: float, vehicle: Pose2, *, last_part: bool) -> None:
        """Let the detector look, at `next_exposure`."""
        assert self.detector is not None
        self.exposures += 1
        measurement = self.detector.expose(stamp, vehicle, self.goal, last_part=last_part)
        if measurement is not None:
            self.under_way.append((stamp + self.detector.delay, measurement))

    def given(self, now: float, state: VehicleState) -> tuple[Pose2 | None, tuple[GoalMeasurement, ...]]:
        """Goal (None: the one given before) and detections for the step at `now` [s], with the vehicle
        measured at `state`."""
        arrived = tuple(each for at, each in self.under_way if at <= now + SAME_TIME)
        self.under_way = [(at, each) for at, each in self.under_way if at > now + SAME_TIME]
        if self.source is GoalSource.KNOWN or self.detector is None:
            return (self.goal if self.moved or self.planned is not None else None), ()
        if self.source is GoalSource.DETECTED:
            return self.planned, arrived
        self.poses = self.poses.noted(now, Pose2(state.x, state.y, state.phi), length=RAW_HISTORY)
        for measurement in arrived:
            placed = replace(measurement, vehicle=measurement.vehicle or self.poses.at(measurement.stamp))
            detection = in_world(placed, GoalFilterConfig())
            if not isinstance(detection, str) and detection.stamp > self.stamp:
                self.newest, self.stamp = detection.pose, detection.stamp
        return (self.planned if self.newest is None else self.newest), ()
