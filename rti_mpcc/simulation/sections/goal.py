"""[goal] with its [goal.measurement], [goal.camera] and shifts."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated

from pydantic import Field

from estimation import Camera, CharucoBoard, DetectionNoise
from estimation.charuco import opencv_board
from geometry.outline import checked_polygon
from rti_mpcc.simulation.camera import Optics
from rti_mpcc.simulation.sections.base import (
    KeyProblem,
    ListOf,
    NotNegative,
    Pair,
    Polygon,
    Positive,
    Section,
    Tolerance,
    Triple,
    refusal,
)

_NOISE = DetectionNoise()
Std = Annotated[float, Field(gt=0.0, le=100.0)]
Share = Annotated[float, Field(ge=0.0, le=1.0)]


class ShiftSection(Section):
    """The true goal moves by `offset` (its own frame) once the rear axle is within `at_distance` [m]."""

    at_distance: Positive
    offset: Triple


class MeasurementSection(Section):
    """How the goal is detected: std(r) = max(floor, std r / reference_range), r from rear axle to goal.

    `initial_offset` is the goal that the plan starts from, in the true goal's frame.
    """

    rate: float = Field(default=10.0, gt=0.0, le=1000.0)
    position_std: Std = _NOISE.position_std
    heading_std: Std = _NOISE.heading_std
    position_floor: Std = _NOISE.position_floor
    heading_floor: Std = _NOISE.heading_floor
    reference_range: Positive = _NOISE.reference_range
    visible_range: Positive = 15.0
    blind_range: NotNegative = 0.0
    visible_after_cusp: bool = False
    delay: float = Field(default=0.0, ge=0.0, le=10.0)
    dropout: Share = 0.1
    outlier: Share = 0.02
    outlier_size: NotNegative = 1.0
    initial_offset: Triple = (0.4, -0.3, 0.1)

    def _problems(self) -> Iterator[KeyProblem]:
        if self.blind_range >= self.visible_range:
            allowed = f"must be < goal.measurement.visible_range = {self.visible_range}"
            yield KeyProblem("blind_range", self.blind_range, allowed)

    @property
    def noise(self) -> DetectionNoise:
        """The law of the noise, for detector and filter alike."""
        return DetectionNoise(**self.model_dump(include=set(DetectionNoise.model_fields)))

    def sees(self, distance: float) -> bool:
        """Whether a goal at this distance [m] is in its range."""
        return self.blind_range <= distance <= self.visible_range


class OtherBoardSection(Section):
    """The board of another dock: pose of that dock, x, y [m], heading [rad]; number of its first marker."""

    pose: Triple
    first_marker: int = Field(ge=0)


class WrongSection(Section):
    """One wrong detection: `after` so long after the first one [s] the dock is seen off by `offset`, in its
    own frame (longitudinal [m], lateral [m], heading [rad])."""

    after: NotNegative
    offset: Triple


class CameraSection(Section):
    """A camera on the vehicle and the board at the goal, in place of random detections.

    Attributes:
        mount: the assumed camera; board: at the goal; optics: of its pictures; others: boards of other docks.
        exact: the camera is mounted as assumed; else height, pitch and roll have random errors.
        lost: nothing is detected between these times after the first detection [s]; wrong: see there.
    """

    mount: Camera = Camera()
    board: CharucoBoard = CharucoBoard()
    optics: Optics = Optics()
    exact: bool = False
    others: ListOf[OtherBoardSection] = ()
    lost: Pair | None = None
    wrong: WrongSection | None = None

    def _problems(self) -> Iterator[KeyProblem]:
        if self.lost is not None and not 0.0 <= self.lost[0] < self.lost[1]:
            allowed = "must be two times after the first detection, the later one last"
            yield KeyProblem("lost", list(self.lost), allowed)
        own = self.board
        yield from too_many_markers("board", own)
        for index, board in enumerate(self.other_boards):
            key = f"others[{index}]"
            found = list(too_many_markers(key, board))
            yield from found
            if not found and own.shares_markers(board):
                taken = f"{own.markers.start} to {own.markers.stop - 1}"
                allowed = f"must leave the markers {taken} to the board at the goal"
                yield KeyProblem(f"{key}.first_marker", board.first_marker, allowed)

    @property
    def other_boards(self) -> tuple[CharucoBoard, ...]:
        """The boards of `others`, like the one at the goal but for their markers."""
        return tuple(self.board.changed(first_marker=other.first_marker) for other in self.others)

    def check(self) -> None:
        """Check whether pictures can be taken. Raises MissingExtraError without OpenCV, ConfigError for a
        board whose dictionary is unknown or too small."""
        for board in (self.board, *self.other_boards):
            opencv_board(board)


def too_many_markers(key: str, board: CharucoBoard) -> Iterator[KeyProblem]:
    """That the dictionary of the board at `key` has fewer markers than the board."""
    size = board.dictionary_size
    if size is not None and board.markers.stop > size:
        room = f"must leave room for its {len(board.markers)} markers"
        allowed = f"{room}, {board.dictionary!r} has 0 to {size - 1}"
        yield KeyProblem(f"{key}.first_marker", board.first_marker, allowed)


class GoalSection(Section):
    """The goal by `offset` from the path's last pose or by its `pose`; neither: the path's last pose.

    In an area it is its `pose`. `body` is the outline of what is docked at, in the goal's frame [m]: the
    vehicle keeps clear of it until it drives on straight to touch it.
    """

    offset: Triple | None = None
    pose: Triple | None = None
    tolerance: Tolerance = (0.05, 0.05, 0.03490658503988659)
    body: Polygon | None = None
    measurement: MeasurementSection | None = None
    camera: CameraSection | None = None
    shifts: ListOf[ShiftSection] = ()

    @property
    def is_path_end(self) -> bool:
        """No goal is given: the controller stops at the path's last pose."""
        return self.offset is None and self.pose is None

    def _problems(self) -> Iterator[KeyProblem]:
        if self.offset is not None and self.pose is not None:
            yield KeyProblem("pose", self.pose, "either offset or pose, not both")
        if (body := self.body) is not None:
            yield from refusal("", None, lambda: checked_polygon(body, "body"), GoalSection)
        if self.camera is not None and self.measurement is None:
            allowed = "needs [goal.measurement], which says when and how far it sees"
            yield KeyProblem("camera", None, allowed)
