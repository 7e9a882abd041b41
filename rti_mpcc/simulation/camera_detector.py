"""The camera of a scenario: rendered pictures of the board at the goal, looked at by the real detector.

Where [goal.camera] is given pictures take the place of the random detections of [goal.measurement]: its rate,
delay, ranges and `visible_after_cusp` hold for the camera, its noise, dropouts and outliers do not.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import hypot

import numpy as np

from estimation import CharucoDetection, CharucoGoalDetector, GoalMeasurement
from geometry import Pose2
from rti_mpcc.simulation.camera import BoardCamera, Image
from rti_mpcc.simulation.goal_feed import TimedDetector
from rti_mpcc.simulation.sections.camera import CameraSection
from rti_mpcc.simulation.sections.goal import MeasurementSection

Seen = Callable[[float, Image, CharucoDetection | None], None]
"""Called with every picture: stamp [s], the picture, and the detection that the controller gets, or None."""
_OFTEN = MeasurementSection(rate=5.0, delay=0.1, visible_range=1e3)
_EXACT = CameraSection()
_STREAM = 7  # random stream of the camera's mounting errors


@dataclass(kw_only=True)
class CameraDetector(TimedDetector):
    """The goal by camera: a picture at each exposure, and the detection in it. See `Detector`.

    Attributes:
        pictures: by the true camera, with the true board and light.
        detector: works with the assumed camera and board.
        section: rate, delay and ranges; faults: lost and wrong detections.
        seen: called with every exposure, see `Seen`.
        first: time of the first detection [s], or None; erred: the wrong detection is over.
    """

    pictures: BoardCamera
    detector: CharucoGoalDetector
    section: MeasurementSection = _OFTEN
    faults: CameraSection = _EXACT
    seen: Seen | None = None
    first: float | None = None
    erred: bool = False

    @classmethod
    def of(
        cls, section: CameraSection, limits: MeasurementSection, seed: int, seen: Seen | None
    ) -> CameraDetector:
        """Mount the camera and the boards. Raises as `CameraSection.check`."""
        random = np.random.default_rng([seed, _STREAM])
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

    def _lost(self, stamp: float) -> bool:
        lost = self.faults.lost
        return lost is not None and self.first is not None and lost[0] <= stamp - self.first < lost[1]

    def _detected(self, picture: Image, stamp: float) -> CharucoDetection | None:
        """The detection in a picture within range: none while it is lost, and once a wrong one."""
        # A lost detection is not computed: that takes longer than drawing.
        detection = None if self._lost(stamp) else self.detector.detect(picture, stamp)
        if detection is None:
            return None
        if self.first is None:
            self.first = stamp
            if self._lost(stamp):
                return None
        wrong = self.faults.wrong
        if wrong is None or self.erred or stamp - self.first < wrong.after:
            return detection
        self.erred = True
        measurement = detection.measurement
        off = Pose2(measurement.x, measurement.y, measurement.phi).compose(Pose2(*wrong.offset))
        return replace(detection, measurement=replace(measurement, x=off.x, y=off.y, phi=off.phi))
