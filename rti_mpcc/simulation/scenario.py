"""A whole scenario file as a frozen checked model, and the objects that follow from it.

A scenario gives either a path and its corridor, or a start and an area in which the route to the goal is
planned. Its tables are in `sections`; what they must be to one another is checked here.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from math import tan
from typing import Any, TypeVar

from pydantic import Field

from estimation import GoalFilterConfig
from geometry import Area, Corridor, InputError, Pose2, ReferencePath
from geometry.angles import degrees_hint
from rti_mpcc.config import (
    COMFORT_ACCELERATION,
    ActuatorModel,
    ControllerConfig,
    GoalTracking,
    Limits,
    Vehicle,
)
from rti_mpcc.paper import with_method
from rti_mpcc.planning import goals
from rti_mpcc.planning.timing import config_for_docking_time
from rti_mpcc.route_planner.problem import BOX
from rti_mpcc.simulation.faults import FaultSection, plant_faults
from rti_mpcc.simulation.plant import PlantParameters
from rti_mpcc.simulation.sections.base import KeyProblem, ListOf, Section, Triple, VehicleTable, refusal
from rti_mpcc.simulation.sections.controller import ControllerSection, SimulationSection
from rti_mpcc.simulation.sections.goal import GoalSection
from rti_mpcc.simulation.sections.ground import AreaSection, CorridorSection, PathSection
from rti_mpcc.simulation.sections.mission import DockStep, MissionSection, StraightStep, built_step

PRESETS = ("default", "paper", "paper_printed")
_ERRORS = {"wheelbase_error", "steering_offset", "acceleration_gain", "acceleration_offset"}
_EITHER = "either [path] and [corridor], or [start], [area] and goal.pose"

AnySection = TypeVar("AnySection", bound=Section)


class PoseSection(Section):
    """The start, or the home after a step failed for good: x, y [m], heading [rad]."""

    pose: Triple


class Scenario(Section):
    """A whole scenario file. Units are SI and radians; arc lengths count along the whole route.

    A table that is not in the file is None here: `given_path` and `given_corridor`, or `start` and `area`.
    `path` and `corridor` are those of a scenario that has them.
    """

    name: str = Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$")
    description: str = ""
    given_path: PathSection | None = Field(default=None, alias="path")
    given_corridor: CorridorSection | None = Field(default=None, alias="corridor")
    start: PoseSection | None = None
    area: AreaSection | None = None
    goal: GoalSection = GoalSection()
    vehicle: VehicleTable = Vehicle()
    limits: Limits = Limits()
    controller: ControllerSection = ControllerSection()
    simulation: SimulationSection = SimulationSection()
    faults: ListOf[FaultSection] = ()
    mission: ListOf[MissionSection] = ()
    home: PoseSection | None = None

    @property
    def in_area(self) -> bool:
        """It gives a start and an area: the route to the goal is planned."""
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

    def build_path(self) -> ReferencePath:
        """The route. Raises PathError, or InputError where none is given."""
        return self.path.build()

    def build_corridor(self, path: ReferencePath) -> Corridor:
        """The drivable area along `path`. Raises CorridorError, or InputError where none is given."""
        return self.corridor.build(path)

    def start_pose(self) -> Pose2:
        """Where the vehicle stands at the beginning, world frame. Raises as `build_path`."""
        pose = self.build_path().start if self.start is None else Pose2(*self.start.pose)
        offset = self.simulation.start_offset
        return pose.compose(Pose2(*offset)) if any(offset) else pose

    def build_area(self) -> Area:
        """Where the vehicle may be. Raises AreaError, or InputError where none is given."""
        area = self._had(self.area, "area").build()
        ends = [(pose.x, pose.y) for pose in (self.start_pose(), self.goal_pose())]
        return area.bounded(ends, BOX)

    def goal_pose(self, path: ReferencePath | None = None) -> Pose2:
        """The true goal before any shift, world frame. Raises InputError where it needs the `path`."""
        if self.goal.pose is not None:
            return Pose2(*self.goal.pose)
        if path is None:
            raise InputError("goal.pose: required where there is no path")
        return path.end if self.goal.offset is None else path.end.compose(Pose2(*self.goal.offset))

    def planned_goal(self, path: ReferencePath | None = None) -> Pose2 | None:
        """The goal at the start of the controller.

        None: the path's last pose. Arguments and errors as `goal_pose`.
        """
        if self.goal.measurement is not None:
            return self.goal_pose(path).compose(Pose2(*self.goal.measurement.initial_offset))
        return None if self.goal.is_path_end else self.goal_pose(path)

    def controller_config(
        self, preset: str = "default", *, method: str = "dynamic", detections: bool | None = None
    ) -> ControllerConfig:
        """The controller's settings. Raises InputError for an unknown preset or method, ConfigError.

        `detections`: whether it detects the goal, by default with [goal.measurement].
        """
        if preset not in PRESETS:
            raise InputError(f"preset = {preset!r}: must be one of {', '.join(PRESETS)}")
        section, simulation, measurement = self.controller, self.simulation, self.goal.measurement
        changes: dict[str, Any] = {
            "vehicle": self.vehicle,
            "limits": self.limits,
            "cycle": simulation.cycle,
            "actuators": self._actuators(),
            "goal_tolerance": self.goal.tolerance,
        }
        if (measurement is not None) if detections is None else detections:
            changes["goal_tracking"] = GoalTracking(required=True)
            if measurement is not None:
                # The filter knows the law of the detector's noise, and that detections may arrive late.
                longest = GoalFilterConfig().history + measurement.delay
                noise = GoalFilterConfig(noise=measurement.noise, history=longest)
                changes["goal_tracking"] = GoalTracking(filter=noise, required=True)
        changes.update(
            section.model_dump(exclude={*ActuatorModel.model_fields, "docking_time"}, exclude_none=True)
        )
        make = {"paper": ControllerConfig.paper, "paper_printed": ControllerConfig.paper_printed}
        config = with_method(make.get(preset, ControllerConfig)(**changes), method)
        if section.docking_time is None:
            return config
        path = self.build_path()
        return config_for_docking_time(section.docking_time, path, config, self.planned_goal(path))

    def _actuators(self) -> ActuatorModel:
        """What the controller assumes: as its section says, or else the truth."""
        names = set(ActuatorModel.model_fields)
        given = self.controller.model_dump(include=names, exclude_none=True)
        return ActuatorModel(**(self.simulation.model_dump(include=names) | given))

    def plant_parameters(self) -> PlantParameters:
        """The plant, with the errors and faults that the controller does not know."""
        errors = self.simulation.model_dump(include={*ActuatorModel.model_fields, *_ERRORS})
        return PlantParameters.of(self.vehicle, self.limits, faults=plant_faults(self.faults), **errors)

    def _problems(self) -> Iterator[KeyProblem]:
        found = [*self._ground_problems(), *self._comfort_problems(), *self._mission_problems()]
        yield from found or (self._settings_problems() if self.in_area else self._path_problems())

    def _ground_problems(self) -> Iterator[KeyProblem]:
        on_path = {"path": self.given_path, "corridor": self.given_corridor}
        in_area = {"start": self.start, "area": self.area}
        given = [key for key, section in in_area.items() if section is not None]
        if given and any(section is not None for section in on_path.values()):
            for key in given:
                yield KeyProblem(key, None, f"{_EITHER}, not both")
            return
        if self.in_area and self.goal.offset is not None:
            allowed = "only with [path], from whose end it is counted: give goal.pose"
            yield KeyProblem("goal.offset", self.goal.offset, allowed)
        for key, section in ({**in_area, "goal.pose": self.goal.pose} if given else on_path).items():
            if section is None:
                yield KeyProblem(key, None, f"required: {_EITHER}")
        if self.in_area and (time := self.controller.docking_time) is not None:
            allowed = "only with [path]: the time of a planned route is not known before"
            yield KeyProblem("controller.docking_time", time, allowed)

    def _comfort_problems(self) -> Iterator[KeyProblem]:
        comfort = self.controller.comfort_acceleration or COMFORT_ACCELERATION
        if comfort > self.limits.acceleration:
            allowed = f"must be <= limits.acceleration = {self.limits.acceleration}"
            yield KeyProblem("controller.comfort_acceleration", comfort, allowed)

    def _mission_problems(self) -> Iterator[KeyProblem]:
        body = self.goal.body
        if not self.mission:
            if body is not None:
                yield KeyProblem("goal.body", None, "only with [[mission]], which keeps clear of it")
            if self.home is not None:
                yield KeyProblem("home", None, "only with [[mission]]")
        goal = Pose2(0.0, 0.0, 0.0) if self.in_area else None
        for index, step in enumerate(self.mission):
            key = f"mission[{index}]"
            if isinstance(step, StraightStep) and step.contact and body is None:
                yield KeyProblem(f"{key}.contact", True, "needs goal.body, what is to be touched")
            planned = ("approach", "tolerance", "uncertainty") if isinstance(step, DockStep) else ()
            misplaced = [name for name in planned if not self.in_area and name in step.model_fields_set]
            allowed = "only in an area, where the route to the dock is planned"
            yield from (KeyProblem(f"{key}.{name}", None, allowed) for name in misplaced)
            if not misplaced:
                yield from refusal(key, None, partial(built_step, step, goal, body))
            if step.retry_from is not None and step.retry_from > index:
                yield KeyProblem(f"{key}.retry_from", step.retry_from, f"must be <= {index}, its own place")
            if step.then == "home" and self.home is None:
                yield KeyProblem(f"{key}.then", "home", "needs [home]")

    def _path_problems(self) -> Iterator[KeyProblem]:
        """Of corridor, then goals: a problem hides those that follow from it."""
        path, width = self.build_path(), self.vehicle.least_width
        if narrow := [each.below("corridor") for each in self.corridor.problems_along(path, width)]:
            yield from narrow
            return
        try:
            corridor = self.build_corridor(path)
        except InputError as error:
            yield KeyProblem("corridor", None, str(error))
            return
        narrowest, theta = corridor.narrowest()
        # The narrowest place is sampled: only what is clearly below the width is refused.
        if narrowest < width - 1e-6:
            value = f"{narrowest:.4g} m wide at {theta:.4g} m along the path"
            yield KeyProblem("corridor", value, f"must be at least as wide as the body, {width} m")
        for key, goal in self._goals(path):
            problem = goals.checked_goal(goal, path, corridor, self.vehicle).problem
            if problem:
                value = f"pose ({goal.x:.4g}, {goal.y:.4g}, {goal.phi:.4g})"
                yield KeyProblem(key, value, f"out of reach, {problem}")
        yield from self._settings_problems()

    def _goals(self, path: ReferencePath) -> Iterator[tuple[str, Pose2]]:
        planned, goal = self.planned_goal(path), self.goal_pose(path)
        if self.goal.measurement is not None and planned is not None:
            yield "goal.measurement.initial_offset", planned
        if not self.goal.is_path_end:
            yield "goal", goal
        for index, shift in enumerate(self.goal.shifts):
            goal = goal.compose(Pose2(*shift.offset))
            yield f"goal.shifts[{index}]", goal

    def _settings_problems(self) -> Iterator[KeyProblem]:
        yield from refusal("controller", None, self.controller_config)

    def remarks(self) -> list[str]:
        """Warnings, a line each: degrees in place of radians, and a path that bends too sharply."""
        path = self.given_path
        poses: dict[str, Any] = {
            "start.pose": self.start and self.start.pose,
            "path.start": path and path.start,
            "goal.pose": self.goal.pose,
            "goal.offset": self.goal.offset,
            "home.pose": self.home and self.home.pose,
        }
        found = [degrees_hint(f"{key}[2]", pose[2]) for key, pose in poses.items() if pose is not None]
        if path is not None:
            bend, possible = path.build().max_curvature, tan(self.limits.steering) / self.vehicle.wheelbase
            if bend > possible * (1.0 + 1e-9):
                most = f"(tan(limits.steering) / vehicle.wheelbase = {possible:.4g} 1/m)"
                told = f"path: its largest curvature {bend:.4g} 1/m is more than the vehicle can steer {most}"
                found.append(f"{told}; it is smoothed or left there")
        return [remark for remark in found if remark]
