"""The tables of a scenario file, in its order; those of missions and faults have modules of their own."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from estimation import Camera, CharucoBoard, DetectionNoise
from estimation.charuco import opencv_board
from geometry import Area, Corridor, Narrowing, Pose2, ReferencePath
from geometry.outline import checked_polygon, checked_shape, outline_at
from rti_mpcc.config import EXIT, Ride, Weights
from rti_mpcc.config.vehicle import Delay
from rti_mpcc.paper import METHODS
from rti_mpcc.simulation.camera import Optics
from rti_mpcc.simulation.sections.base import (
    FileName,
    KeyProblem,
    ListOf,
    NotNegative,
    Outline,
    Pair,
    Polygon,
    Positive,
    Section,
    Tolerance,
    Triple,
    refusal,
)
from rti_mpcc.types import Obstacle

_NOISE = DetectionNoise()
Std = Annotated[float, Field(gt=0.0, le=100.0)]
Share = Annotated[float, Field(ge=0.0, le=1.0)]
Noise = Annotated[tuple[NotNegative, NotNegative, NotNegative, NotNegative, NotNegative], Field(strict=False)]


class SegmentSection(Section):
    """One piece of constant curvature [1/m] and length [m]; direction -1 is reverse."""

    direction: Literal[1, -1]
    curvature: float
    length: Positive


class PathSection(Section):
    """Either `start` (x, y [m], heading [rad] of the vehicle) and `segments`, or a CSV `file`."""

    start: Triple | None = None
    segments: Annotated[ListOf[SegmentSection], Field(min_length=1)] | None = None
    file: FileName | None = None

    def _problems(self) -> Iterator[KeyProblem]:
        missing = [key for key in ("start", "segments") if getattr(self, key) is None]
        if self.file is not None and len(missing) < 2:
            yield KeyProblem("file", self.file, "either file, or start and segments, not both")
        elif self.file is None and missing:
            for key in missing:
                yield KeyProblem(key, None, "required where path.file is not given")
        else:
            yield from refusal("" if self.file is None else "file", self.file, self.build, PathSection)

    def build(self) -> ReferencePath:
        """The route. Raises PathError."""
        if self.file is not None:
            return ReferencePath.from_csv(self.file)
        assert self.start is not None
        assert self.segments is not None
        segments = [(piece.direction, piece.curvature, piece.length) for piece in self.segments]
        return ReferencePath.from_segments(start=Pose2(*self.start), segments=segments)


class NarrowingSection(Section):
    """Other offsets [m] of one or both boundaries between two arc lengths [m] of the whole route."""

    start: float = Field(alias="from", ge=0.0)
    end: float = Field(alias="to")
    left: float | None = None
    right: float | None = None

    def _problems(self) -> Iterator[KeyProblem]:
        if self.left is None and self.right is None:
            yield KeyProblem("", None, "needs left, right or both")


class CorridorSection(Section):
    """Either offsets `left` and `right` [m] of the path (positive to the left) or a `polygon`; obstacles."""

    left: float | None = None
    right: float | None = None
    narrowings: ListOf[NarrowingSection] = ()
    polygon: Polygon | None = None
    obstacles: ListOf[Outline] = ()

    def _problems(self) -> Iterator[KeyProblem]:
        for key, value in (("left", self.left), ("right", self.right)):
            if self.polygon is None and value is None:
                yield KeyProblem(key, None, "required where corridor.polygon is not given")
            if self.polygon is not None and value is not None:
                yield KeyProblem(key, value, "either polygon, or left and right, not both")
        if self.polygon is not None and self.narrowings:
            tables = f"{len(self.narrowings)} tables"
            yield KeyProblem("narrowings", tables, "only with left and right, not with polygon")

    def build(self, path: ReferencePath) -> Corridor:
        """The drivable area along `path`. Raises CorridorError."""
        if self.polygon is not None:
            return Corridor.from_polygon(path, self.polygon, obstacles=self.obstacles)
        assert self.left is not None
        assert self.right is not None
        narrowings = [Narrowing(each.start, each.end, each.left, each.right) for each in self.narrowings]
        return Corridor.from_offsets(
            path, left=self.left, right=self.right, narrowings=narrowings, obstacles=self.obstacles
        )


class MovingSection(Section):
    """An obstacle that moves: `polygon` [m] where it is at `from` [s], `velocity` [m/s], until `to` [s]."""

    polygon: Outline
    velocity: Pair
    turn_rate: float = 0.0
    start: float = Field(0.0, alias="from", ge=0.0)
    end: float | None = Field(None, alias="to")
    name: str = ""

    def _problems(self) -> Iterator[KeyProblem]:
        if self.end is not None and self.end <= self.start:
            yield KeyProblem("to", self.end, f"must be above from = {self.start}")
        yield from refusal("", None, lambda: self.at(self.start), MovingSection)

    def at(self, now: float) -> Obstacle | None:
        """The obstacle at `now` [s]; None: it is not there. Raises InputError."""
        if now < self.start or (self.end is not None and now > self.end):
            return None
        corners, seconds = np.array(self.polygon), now - self.start
        middle = checked_shape(corners, "polygon").centroid
        turning = Pose2(middle.x, middle.y, self.turn_rate * seconds)
        turned = outline_at(corners - (middle.x, middle.y), turning)
        return Obstacle(turned + seconds * np.array(self.velocity), self.velocity, self.turn_rate, self.name)


class PoseSection(Section):
    """The start, or the home after a step failed for good: x, y [m], heading [rad]."""

    pose: Triple


class AreaSection(Section):
    """Where the vehicle may be: either `boundary` and `obstacles` [m], or an occupancy grid, the YAML `map`.

    Without a boundary a scenario has a box, `route_planner.problem.BOX` beyond all that is given.
    """

    boundary: Polygon | None = None
    obstacles: ListOf[Outline] = ()
    map: FileName | None = None

    def _problems(self) -> Iterator[KeyProblem]:
        if self.map is not None and (self.boundary or self.obstacles):
            yield KeyProblem("map", self.map, "either map, or boundary and obstacles, not both")
        else:
            yield from refusal("" if self.map is None else "map", self.map, self.build, AreaSection)

    def build(self) -> Area:
        """The area. Raises AreaError."""
        if self.map is not None:
            return Area.from_map(self.map)
        return Area(boundary=self.boundary, obstacles=self.obstacles)


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


class ControllerSection(Section):
    """What the controller assumes or is asked for; None, and a weight that is not given, is the preset's.

    `method`: of the objective, where the command line asks for none.
    """

    dead_time: Delay | None = None
    drive_lag: Delay | None = None
    steering_lag: Delay | None = None
    steering_dead_time: Delay | None = None
    comfort_acceleration: Positive | None = None
    comfort_lateral_acceleration: Positive | None = None
    comfort_steering_rate: Positive | None = None
    comfort_jerk: Positive | None = None
    ride: Ride | None = None
    docking_time: Positive | None = None
    recovery: bool | None = None
    deadline: Annotated[float, Field(gt=EXIT, le=10.0)] | None = None
    weights: Weights | None = None
    method: str = "dynamic"

    def _problems(self) -> Iterator[KeyProblem]:
        if self.method not in METHODS:
            yield KeyProblem("method", self.method, f"must be one of {', '.join(METHODS)}")


class SimulationSection(Section):
    """The plant and the clock. Times [s]; wheelbase_error relative; steering_offset [rad].

    `acceleration_offset` is added to the command [m/s²], positive to the front. `state_noise`: standard
    deviations of the measured x, y [m], phi [rad], v [m/s], delta [rad]. `start_offset`: of the start pose,
    in its own frame [m], [m], [rad].
    """

    plant_step: float = Field(default=0.01, ge=0.0005, le=0.05)
    cycle: float = Field(default=0.05, ge=0.005, le=0.2)
    dead_time: float = Field(default=0.0, ge=0.0, le=1.0)
    drive_lag: float = Field(default=0.0, ge=0.0, le=1.0)
    steering_lag: float = Field(default=0.0, ge=0.0, le=1.0)
    duration: float = Field(default=120.0, gt=0.0, le=3600.0)
    wheelbase_error: float = Field(default=0.0, ge=-0.5, le=0.5)
    steering_offset: float = Field(default=0.0, ge=-0.3, le=0.3)
    acceleration_gain: float = Field(default=1.0, ge=0.1, le=3.0)
    acceleration_offset: float = Field(default=0.0, ge=-10.0, le=10.0)
    state_noise: Noise = (0.0, 0.0, 0.0, 0.0, 0.0)
    start_offset: Triple = (0.0, 0.0, 0.0)

    def _problems(self) -> Iterator[KeyProblem]:
        if self.plant_step > self.cycle:
            allowed = f"must be <= simulation.cycle = {self.cycle}"
            yield KeyProblem("plant_step", self.plant_step, allowed)
