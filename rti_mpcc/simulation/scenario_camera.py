"""The camera of a scenario: drawn pictures of the board at the goal, looked at by the real detector.

Where [goal.camera] is given pictures take the place of the drawn detections of [goal.measurement]: its rate,
delay, ranges and `visible_after_cusp` hold for the camera, its noise, dropouts and outliers do not.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import hypot
from typing import TYPE_CHECKING, Annotated

import numpy as np
from pydantic import ConfigDict, Field

from estimation import Camera, CharucoBoard, CharucoDetection, CharucoGoalDetector, GoalMeasurement
from estimation.charuco import opencv_board
from geometry import Pose2
from rti_mpcc.simulation.camera import BoardCamera, Image, Optics
from rti_mpcc.simulation.fields import Pair, Triple
from rti_mpcc.simulation.section import Section

if TYPE_CHECKING:
    from rti_mpcc.simulation.scenario import MeasurementSection

Seen = Callable[[float, Image, CharucoDetection | None], None]
"""Is told of every picture: stamp [s], the picture, and the detection that is told of it, or None."""
_STREAM = 7  # of the chance that mounts the camera


class MountSection(Camera):
    """`Camera` as a table of a file: exact types, as in `Section`."""

    model_config = ConfigDict(strict=True)
    distortion: Annotated[tuple[float, float, float, float, float], Field(strict=False)] = Camera().distortion


class BoardSection(CharucoBoard):
    """`CharucoBoard` as a table of a file: exact types, as in `Section`."""

    model_config = ConfigDict(strict=True)


class OpticsSection(Optics):
    """`Optics` as a table of a file: exact types, as in `Section`."""

    model_config = ConfigDict(strict=True)


class OtherBoardSection(Section):
    """The board of another dock: pose of that dock, x, y [m], heading [rad]; number of its first marker."""

    pose: Triple
    first_marker: int = Field(ge=0)


class WrongSection(Section):
    """One detection that is wrong: so long after the first one [s], the dock is seen off by this, in its own
    frame (longitudinal [m], lateral [m], heading [rad])."""

    after: float = Field(ge=0.0)
    offset: Triple


class CameraSection(Section):
    """A camera on the vehicle and the board at the goal, in the place of drawn detections.

    `mount` is the camera as it is believed to be, `board` the board; `optics` what its pictures suffer. With
    `exact` the camera is mounted as it is believed to be; else height, pitch and roll are off by chance, as
    its tolerances say. `others` are boards of other docks. `lost`: from and to so long after the first
    detection [s] nothing is detected. `wrong`: see there.
    """

    mount: MountSection = MountSection()
    board: BoardSection = BoardSection()
    optics: OpticsSection = OpticsSection()
    exact: bool = False
    others: Annotated[tuple[OtherBoardSection, ...], Field(strict=False)] = ()
    lost: Pair | None = None
    wrong: WrongSection | None = None

    @property
    def other_boards(self) -> tuple[CharucoBoard, ...]:
        """The boards of `others`, like the one at the goal but for their markers."""
        return tuple(self.board.changed(first_marker=other.first_marker) for other in self.others)

    def check(self) -> None:
        """See whether pictures can be taken: what `Section`s alone do not show. Raises MissingExtraError
        without OpenCV, ConfigError for a board whose dictionary is unknown or too small."""
        for board in (self.board, *self.other_boards):
            opencv_board(board)


@dataclass(slots=True, kw_only=True)
class ScenarioCamera:
    """The detector of a scenario with a camera. See `Detector`.

    Attributes:
        section: of the camera; limits: when and how far it sees.
        pictures: takes them; detector: looks at them.
        seen: is told of every picture, and of what is told of it; see `Seen`.
        first: time of the first detection [s], or None; erred: the wrong one has been.
    """

    section: CameraSection
    limits: MeasurementSection
    pictures: BoardCamera
    detector: CharucoGoalDetector
    seen: Seen | None = None
    first: float | None = None
    erred: bool = False

    @classmethod
    def of(
        cls, section: CameraSection, limits: MeasurementSection, seed: int, seen: Seen | None
    ) -> ScenarioCamera:
        """Mount the camera and hang up the boards. Raises MissingExtraError without OpenCV, ConfigError for a
        board whose dictionary is unknown or too small."""
        random = np.random.default_rng([seed, _STREAM])
        mount, board = section.mount, section.board
        off = random.standard_normal(3) * (mount.height_std, mount.tilt_std, mount.tilt_std)
        height, pitch, roll = (0.0 if section.exact else 1.0) * off
        turned = {"z": mount.z + height, "pitch": mount.pitch + pitch, "roll": mount.roll + roll}
        others = list(zip(section.other_boards, (Pose2(*o.pose) for o in section.others), strict=True))
        pictures = BoardCamera(mount.changed(**turned), board, section.optics, random, others)
        detector = CharucoGoalDetector(mount, board)
        return cls(section=section, limits=limits, pictures=pictures, detector=detector, seen=seen)

    @property
    def rate(self) -> float:
        """Exposures a second [Hz]."""
        return self.limits.rate

    @property
    def delay(self) -> float:
        """From exposure to arrival [s]."""
        return self.limits.delay

    def expose(self, stamp: float, vehicle: Pose2, goal: Pose2, *, last_part: bool) -> GoalMeasurement | None:
        """See `Detector`. Before the last part no picture is taken where the scenario says so."""
        if self.limits.visible_after_cusp and not last_part:
            return None
        picture = self.pictures.expose(vehicle, goal)
        distance = hypot(goal.x - vehicle.x, goal.y - vehicle.y)
        detection = self._told(picture, stamp) if self._in_range(distance) else None
        if self.seen is not None:
            self.seen(stamp, picture, detection)
        return None if detection is None else detection.measurement

    def _in_range(self, distance: float) -> bool:
        return self.limits.blind_range <= distance <= self.limits.visible_range

    def _lost(self, stamp: float) -> bool:
        lost = self.section.lost
        return lost is not None and self.first is not None and lost[0] <= stamp - self.first < lost[1]

    def _told(self, picture: Image, stamp: float) -> CharucoDetection | None:
        """What is told of a picture within range: nothing while it is lost, and once something wrong."""
        # Nobody is told of it then, and looking takes longer than drawing.
        detection = None if self._lost(stamp) else self.detector.detect(picture, stamp)
        if detection is None:
            return None
        if self.first is None:
            self.first = stamp
            if self._lost(stamp):
                return None
        wrong = self.section.wrong
        if wrong is None or self.erred or stamp - self.first < wrong.after:
            return detection
        self.erred = True
        measurement = detection.measurement
        off = Pose2(measurement.x, measurement.y, measurement.phi).compose(Pose2(*wrong.offset))
        return replace(detection, measurement=replace(measurement, x=off.x, y=off.y, phi=off.phi))
