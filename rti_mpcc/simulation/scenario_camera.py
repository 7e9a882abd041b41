"""The camera of a scenario: drawn pictures of the board at the goal, looked at by the real detector.

Where [goal.camera] is given pictures take the place of the drawn detections of [goal.measurement]: its rate,
delay, ranges and `visible_after_cusp` hold for the camera, its noise, dropouts and outliers do not.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from math import hypot
from typing import TYPE_CHECKING, Annotated

import numpy as np
from pydantic import Field

from estimation import Camera, CharucoBoard, CharucoDetection, CharucoGoalDetector, GoalMeasurement
from geometry import Pose2
from rti_mpcc.simulation.camera import BoardCamera, CameraDetector, Image, Optics
from rti_mpcc.simulation.section import Section

if TYPE_CHECKING:
    from rti_mpcc.simulation.scenario import MeasurementSection

Seen = Callable[[float, Image, CharucoDetection | None], None]
"""Is told of every exposure: stamp [s], picture, and detection or None."""
Pair = Annotated[tuple[float, float], Field(strict=False)]
Triple = Annotated[tuple[float, float, float], Field(strict=False)]
_STREAM = 7  # of the chance that mounts the camera


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

    mount: Camera = Camera()
    board: CharucoBoard = CharucoBoard()
    optics: Optics = Optics()
    exact: bool = False
    others: Annotated[tuple[OtherBoardSection, ...], Field(strict=False)] = ()
    lost: Pair | None = None
    wrong: WrongSection | None = None


@dataclass(slots=True, kw_only=True)
class ScenarioCamera:
    """The detector of a scenario with a camera. See `Detector`.

    Attributes:
        section: of the camera; limits: when and how far it sees.
        eye: takes the pictures and looks at them.
        first: time of the first detection [s], or None; erred: the wrong one has been.
    """

    section: CameraSection
    limits: MeasurementSection
    eye: CameraDetector
    first: float | None = None
    erred: bool = field(default=False)

    @classmethod
    def of(
        cls, section: CameraSection, limits: MeasurementSection, seed: int, seen: Seen | None
    ) -> ScenarioCamera:
        """Mount the camera and hang up the boards. Raises MissingExtraError without OpenCV, ConfigError for a
        board that its dictionary is too small for."""
        random = np.random.default_rng([seed, _STREAM])
        mount, board = section.mount, section.board
        off = random.standard_normal(3) * (mount.height_std, mount.tilt_std, mount.tilt_std)
        height, pitch, roll = (0.0 if section.exact else 1.0) * off
        turned = {"z": mount.z + height, "pitch": mount.pitch + pitch, "roll": mount.roll + roll}
        others = [
            (board.model_copy(update={"first_marker": other.first_marker}), Pose2(*other.pose))
            for other in section.others
        ]
        pictures = BoardCamera(mount.model_copy(update=turned), board, section.optics, random, others)
        eye = CameraDetector(
            pictures=pictures,
            detector=CharucoGoalDetector(mount, board),
            rate=limits.rate,
            delay=limits.delay,
            seen=seen,
        )
        return cls(section=section, limits=limits, eye=eye)

    @property
    def rate(self) -> float:
        """Exposures a second [Hz]."""
        return self.eye.rate

    @property
    def delay(self) -> float:
        """From exposure to arrival [s]."""
        return self.eye.delay

    def expose(self, stamp: float, vehicle: Pose2, goal: Pose2, *, last_part: bool) -> GoalMeasurement | None:
        """See `Detector`. Before the last part no picture is taken where the scenario says so."""
        limits = self.limits
        if limits.visible_after_cusp and not last_part:
            return None
        measurement = self.eye.expose(stamp, vehicle, goal, last_part=last_part)
        distance = hypot(goal.x - vehicle.x, goal.y - vehicle.y)
        if measurement is None or not limits.blind_range <= distance <= limits.visible_range:
            return None
        if self.first is None:
            self.first = stamp
        return self._suffered(measurement, stamp - self.first)

    def _suffered(self, measurement: GoalMeasurement, since: float) -> GoalMeasurement | None:
        """What is told of a detection so long after the first one [s]."""
        lost, wrong = self.section.lost, self.section.wrong
        if lost is not None and lost[0] <= since < lost[1]:
            return None
        if wrong is None or self.erred or since < wrong.after:
            return measurement
        self.erred = True
        seen = Pose2(measurement.x, measurement.y, measurement.phi).compose(Pose2(*wrong.offset))
        return replace(measurement, x=seen.x, y=seen.y, phi=seen.phi)
