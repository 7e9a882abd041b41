"""What a scenario file says, as frozen validated models, and the objects that follow from it.

A scenario gives either a path and its corridor, or a start and an area in which the way to the goal is
planned. The models check each value by itself (type, range, finiteness, unknown keys); what values must be to
one another is checked by `scenario_checks`. `scenario_file.load_scenario` does both and words the errors.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal, TypeVar

from pydantic import Field, field_validator

from estimation import DetectionNoise, GoalFilterConfig
from geometry import Area, Corridor, Narrowing, Pose2, ReferencePath
from rti_mpcc.config import EXIT, ControllerConfig, GoalTracking, Limits, Ride, RoutePlanner, Vehicle
from rti_mpcc.errors import InputError
from rti_mpcc.paper import with_method
from rti_mpcc.planning.timing import config_for_docking_time
from rti_mpcc.simulation.faults import FaultSection, plant_faults
from rti_mpcc.simulation.fields import (
    AreaSection,
    Obstacle,
    Polygon,
    Positive,
    Tolerance,
    Triple,
    VehicleSection,
    beside_the_file,
)
from rti_mpcc.simulation.mission import MissionSection
from rti_mpcc.simulation.plant import PlantParameters
from rti_mpcc.simulation.scenario_camera import CameraSection
from rti_mpcc.simulation.section import Section

PRESETS = ("default", "paper", "paper_printed")

Rate = Annotated[float, Field(gt=0.0, le=100.0)]
NotNegative = Annotated[float, Field(ge=0.0)]
AnySection = TypeVar("AnySection", bound=Section)
StateNoise = Annotated[
    tuple[NotNegative, NotNegative, NotNegative, NotNegative, NotNegative], Field(strict=False)
]


class SegmentSection(Section):
    """One piece of constant curvature [1/m] and length [m]; direction -1 is reverse."""

    direction: Literal[1, -1]
    curvature: float
    length: Positive


class PathSection(Section):
    """Either `start` (x, y [m], heading [rad] of the vehicle) and `segments`, or a CSV `file`."""

    start: Triple | None = None
    segments: Annotated[tuple[SegmentSection, ...], Field(strict=False, min_length=1)] | None = None
    file: str | None = None

    _beside = field_validator("file")(beside_the_file)


class NarrowingSection(Section):
    """Other offsets [m] of one or both boundaries between two arc lengths [m] of the whole route."""

    start: float = Field(alias="from", ge=0.0)
    end: float = Field(alias="to")
    left: float | None = None
    right: float | None = None


class CorridorSection(Section):
    """Either offsets `left` and `right` [m] of the path (positive to the left) or a `polygon`; obstacles."""

    left: float | None = None
    right: float | None = None
    narrowings: Annotated[tuple[NarrowingSection, ...], Field(strict=False)] = ()
    polygon: Polygon | None = None
    obstacles: Annotated[tuple[Obstacle, ...], Field(strict=False)] = ()


class StartSection(Section):
    """Where the vehicle stands at the beginning: x, y [m], heading [rad]."""

    pose: Triple


class ShiftSection(Section):
    """The true goal moves by `offset` (its own frame) once the rear axle is within `at_distance` [m]."""

    at_distance: Positive
    offset: Triple


Std = Annotated[float, Field(gt=0.0, le=100.0)]
Share = Annotated[float, Field(ge=0.0, le=1.0)]


class MeasurementSection(Section):
    """How the goal is detected: std(r) = max(floor, std r / reference_range), r from rear axle to goal.

    `initial_offset` is the goal that the plan starts from, in the true goal's frame.
    """

    rate: float = Field(default=10.0, gt=0.0, le=1000.0)
    position_std: Std = DetectionNoise().position_std
    heading_std: Std = DetectionNoise().heading_std
    position_floor: Std = DetectionNoise().position_floor
    heading_floor: Std = DetectionNoise().heading_floor
    reference_range: Positive = DetectionNoise().reference_range
    visible_range: Positive = 15.0
    blind_range: NotNegative = 0.0
    visible_after_cusp: bool = False
    delay: float = Field(default=0.0, ge=0.0, le=10.0)
    dropout: Share = 0.1
    outlier: Share = 0.02
    outlier_size: NotNegative = 1.0
    initial_offset: Triple = (0.4, -0.3, 0.1)

    @property
    def noise(self) -> DetectionNoise:
        """The law of the noise, for detector and filter alike."""
        return DetectionNoise(
            position_std=self.position_std,
            heading_std=self.heading_std,
            position_floor=self.position_floor,
            heading_floor=self.heading_floor,
            reference_range=self.reference_range,
        )


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
    shifts: Annotated[tuple[ShiftSection, ...], Field(strict=False)] = ()


class HomeSection(Section):
    """Where a mission drives after a step that failed for good and says so: x, y [m], heading [rad]."""

    pose: Triple


class LimitsSection(Section):
    """Limits of the vehicle, see `Limits`: [m/s], [m/s²], [rad], [rad/s]."""

    speed: Rate = Limits().speed
    acceleration: Rate = Limits().acceleration
    steering: float = Field(default=Limits().steering, gt=0.0, le=1.4)
    steering_rate: Rate = Limits().steering_rate


class ControllerSection(Section):
    """What the controller assumes or is asked for; None is the preset's own value."""

    dead_time: Annotated[float, Field(ge=0.0, le=1.0)] | None = None
    comfort_acceleration: Positive | None = None
    comfort_lateral_acceleration: Positive | None = None
    comfort_steering_rate: Positive | None = None
    comfort_jerk: Positive | None = None
    ride: Ride | None = None
    docking_time: Positive | None = None
    recovery: bool | None = None
    deadline: Annotated[float, Field(gt=EXIT, le=10.0)] | None = None


class SimulationSection(Section):
    """The plant and the clock. Times [s]; wheelbase_error relative; steering_offset [rad].

    `acceleration_offset` comes on top of what is commanded [m/s²], positive to the front.

    `state_noise` is the standard deviation of the measured x, y [m], phi [rad], v [m/s], delta [rad].
    """

    plant_step: float = Field(default=0.01, ge=0.0005, le=0.05)
    cycle: float = Field(default=0.05, ge=0.005, le=0.2)
    dead_time: float = Field(default=0.0, ge=0.0, le=1.0)
    duration: float = Field(default=120.0, gt=0.0, le=3600.0)
    wheelbase_error: float = Field(default=0.0, ge=-0.5, le=0.5)
    steering_offset: float = Field(default=0.0, ge=-0.3, le=0.3)
    acceleration_gain: float = Field(default=1.0, ge=0.1, le=3.0)
    acceleration_offset: float = Field(default=0.0, ge=-10.0, le=10.0)
    state_noise: StateNoise = (0.0, 0.0, 0.0, 0.0, 0.0)


class Scenario(Section):
    """A whole scenario file. Units are SI and radians; arc lengths count along the whole route.

    What it need not give is None here where it does not: `given_path` and `given_corridor`, or `start` and
    `area`. `path` and `corridor` are those of a scenario that has them.
    """

    name: str = Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$")
    description: str = ""
    given_path: PathSection | None = Field(default=None, alias="path")
    given_corridor: CorridorSection | None = Field(default=None, alias="corridor")
    start: StartSection | None = None
    area: AreaSection | None = None
    goal: GoalSection = GoalSection()
    vehicle: VehicleSection = VehicleSection()
    limits: LimitsSection = LimitsSection()
    controller: ControllerSection = ControllerSection()
    simulation: SimulationSection = SimulationSection()
    faults: Annotated[tuple[FaultSection, ...], Field(strict=False)] = ()
    mission: Annotated[tuple[MissionSection, ...], Field(strict=False)] = ()
    home: HomeSection | None = None

    @property
    def in_area(self) -> bool:
        """It gives a start and an area: the way to the goal is planned."""
        return self.area is not None

    @property
    def path(self) -> PathSection:
        """The path. Raises InputError where there is none."""
        return self._had(self.given_path, "path")

    @property
    def corridor(self) -> CorridorSection:
        """The corridor. Raises InputError where there is none."""
        return self._had(self.given_corridor, "corridor")

    def _had(self, section: AnySection | None, name: str) -> AnySection:
        if section is None:
            raise InputError(f"{self.name}: has no [{name}]")
        return section

    @property
    def goal_is_path_end(self) -> bool:
        """No goal pose is given: the controller is to stop at the path's last pose."""
        return self.goal.offset is None and self.goal.pose is None

    def build_vehicle(self) -> Vehicle:
        """The vehicle that the controller knows."""
        return self.vehicle.build()

    def build_limits(self) -> Limits:
        """The limits of vehicle and controller."""
        return Limits(**self.limits.model_dump())

    def build_path(self) -> ReferencePath:
        """The route. Raises PathError, or InputError where none is given."""
        if self.path.file is not None:
            return ReferencePath.from_csv(self.path.file)
        if self.path.start is None or self.path.segments is None:
            raise InputError("path: needs start and segments, or file")
        segments = [(piece.direction, piece.curvature, piece.length) for piece in self.path.segments]
        return ReferencePath.from_segments(start=Pose2(*self.path.start), segments=segments)

    def build_corridor(self, path: ReferencePath) -> Corridor:
        """The drivable area along `path`. Raises CorridorError, or InputError where none is given."""
        section = self.corridor
        if section.polygon is not None:
            return Corridor.from_polygon(path, section.polygon, obstacles=section.obstacles)
        if section.left is None or section.right is None:
            raise InputError("corridor: needs left and right, or polygon")
        narrowings = [
            Narrowing(piece.start, piece.end, piece.left, piece.right) for piece in section.narrowings
        ]
        return Corridor.from_offsets(
            path, left=section.left, right=section.right, narrowings=narrowings, obstacles=section.obstacles
        )

    def start_pose(self) -> Pose2:
        """Where the vehicle stands at the beginning, world frame. Raises as `build_path`."""
        return self.build_path().start if self.start is None else Pose2(*self.start.pose)

    def build_area(self) -> Area:
        """Where the vehicle may be. Raises AreaError, or InputError where none is given."""
        area = self._had(self.area, "area").build()
        ends = [(pose.x, pose.y) for pose in (self.start_pose(), self.goal_pose())]
        return area.bounded(ends, RoutePlanner().box)

    def goal_pose(self, path: ReferencePath | None = None) -> Pose2:
        """The true goal before any shift, world frame.

        `path`: the route, where there is one. Raises InputError where only a route says where the goal is.
        """
        if self.goal.pose is not None:
            return Pose2(*self.goal.pose)
        if path is None:
            raise InputError("goal.pose: required where there is no path")
        return path.end if self.goal.offset is None else path.end.compose(Pose2(*self.goal.offset))

    def planned_goal(self, path: ReferencePath | None = None) -> Pose2 | None:
        """The goal that the controller is told at the start: the true one where it is known.

        None where that is the path's last pose. Arguments and errors as `goal_pose`.
        """
        if self.goal.measurement is not None:
            return self.goal_pose(path).compose(Pose2(*self.goal.measurement.initial_offset))
        return None if self.goal_is_path_end else self.goal_pose(path)

    def controller_config(
        self, preset: str = "default", *, method: str = "dynamic", detections: bool | None = None
    ) -> ControllerConfig:
        """The controller's settings; `detections` says whether it knows the goal from such.

        By default it does where there is a [goal.measurement].

        Raises InputError for an unknown preset or method, ConfigError for bad values.
        """
        if preset not in PRESETS:
            raise InputError(f"preset = {preset!r}: must be one of {', '.join(PRESETS)}")
        section, simulation = self.controller, self.simulation
        changes: dict[str, Any] = {
            "vehicle": self.build_vehicle(),
            "limits": self.build_limits(),
            "cycle": simulation.cycle,
            "dead_time": simulation.dead_time if section.dead_time is None else section.dead_time,
            "goal_tolerance": self.goal.tolerance,
        }
        if detections is None:
            detections = self.goal.measurement is not None
        if detections:
            changes["goal_tracking"] = self._goal_tracking()
        changes.update(section.model_dump(exclude={"dead_time", "docking_time"}, exclude_none=True))
        make = {"paper": ControllerConfig.paper, "paper_printed": ControllerConfig.paper_printed}
        config = with_method(make.get(preset, ControllerConfig)(**changes), method)
        if section.docking_time is None:
            return config
        path = self.build_path()
        return config_for_docking_time(section.docking_time, path, config, self.planned_goal(path))

    def _goal_tracking(self) -> GoalTracking:
        """The filter knows the law of the detector's noise, and that detections may arrive late."""
        measurement = self.goal.measurement
        if measurement is None:
            return GoalTracking(required=True)
        longest = GoalFilterConfig().history + measurement.delay
        return GoalTracking(filter=GoalFilterConfig(noise=measurement.noise, history=longest), required=True)

    def plant_parameters(self) -> PlantParameters:
        """The plant, with the errors and faults that the controller does not know."""
        simulation = self.simulation
        return PlantParameters.of(
            self.build_vehicle(),
            self.build_limits(),
            dead_time=simulation.dead_time,
            wheelbase_error=simulation.wheelbase_error,
            steering_offset=simulation.steering_offset,
            acceleration_gain=simulation.acceleration_gain,
            acceleration_offset=simulation.acceleration_offset,
            faults=plant_faults(self.faults),
        )
