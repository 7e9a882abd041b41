"""A scenario file as a frozen checked model, the objects that follow from it; read, changed, written back.

A scenario gives either a path and its corridor, or a start and an area in which the route to the goal is
planned. Its tables are in `sections`; what they must be to one another is checked here.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from math import tan
from pathlib import Path
from typing import Any

from pydantic import Field

from estimation import GoalFilterConfig
from geometry import Area, Corridor, InputError, Pose2, ReferencePath
from geometry.errors import check_extra
from geometry.pose import degrees_hint
from rti_mpcc.config import ActuatorModel, ControllerConfig, GoalTracking, Limits, Vehicle
from rti_mpcc.course.docking_time import config_for_docking_time
from rti_mpcc.errors import ScenarioError
from rti_mpcc.paper import with_method
from rti_mpcc.route_planner.problem import BOX
from rti_mpcc.simulation.faults import FaultSection, plant_faults
from rti_mpcc.simulation.plant import PlantParameters
from rti_mpcc.simulation.sections.base import (
    KeyProblem,
    ListOf,
    Section,
    Triple,
    VehicleTable,
    key_problem,
    parsed,
    read_toml,
    refusal,
)
from rti_mpcc.simulation.sections.controller import ControllerSection, SimulationSection
from rti_mpcc.simulation.sections.goal import GoalSection
from rti_mpcc.simulation.sections.ground import AreaSection, CorridorSection, MovingSection, PathSection
from rti_mpcc.simulation.sections.mission import CONTACT, MissionSection
from rti_mpcc.world.goals import checked_goal

_LOG = logging.getLogger(__name__)
_BUILT_IN = Path(__file__).with_name("scenarios")
PRESETS: dict[str, Callable[..., ControllerConfig]] = {
    "default": ControllerConfig,
    "paper": ControllerConfig.paper,
    "paper_printed": ControllerConfig.paper_printed,
}
_ERRORS = {"wheelbase_error", "steering_offset", "acceleration_gain", "acceleration_offset"}
_EITHER = "either [path] and [corridor], or [start], [area] and goal.pose"


class PoseSection(Section):
    """The start, or the home after a step failed for good: x, y [m], heading [rad]."""

    pose: Triple


class Scenario(Section):
    """A whole scenario file. Units are SI and radians; arc lengths count along the whole route.

    It has either `path` and `corridor`, or `start` and `area`; the others are None.
    """

    name: str = Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$")
    description: str = ""
    path: PathSection | None = None
    corridor: CorridorSection | None = None
    start: PoseSection | None = None
    area: AreaSection | None = None
    goal: GoalSection = GoalSection()
    vehicle: VehicleTable = Vehicle()
    limits: Limits = Limits()
    controller: ControllerSection = ControllerSection()
    simulation: SimulationSection = SimulationSection()
    moving: ListOf[MovingSection] = ()
    faults: ListOf[FaultSection] = ()
    mission: ListOf[MissionSection] = ()
    home: PoseSection | None = None

    @property
    def in_area(self) -> bool:
        """It gives a start and an area: the route to the goal is planned."""
        return self.area is not None

    def build_path(self) -> ReferencePath:
        """The route. Raises PathError, or InputError where none is given."""
        if self.path is None:
            raise InputError(f"{self.name}: has no [path]")
        return self.path.build()

    def build_corridor(self, path: ReferencePath) -> Corridor:
        """The drivable area along `path`. Raises CorridorError, or InputError where none is given."""
        if self.corridor is None:
            raise InputError(f"{self.name}: has no [corridor]")
        return self.corridor.build(path)

    def start_pose(self) -> Pose2:
        """Where the vehicle stands at the beginning, world frame. Raises as `build_path`."""
        pose = self.build_path().start if self.start is None else Pose2(*self.start.pose)
        offset = self.simulation.start_offset
        return pose.compose(Pose2(*offset)) if any(offset) else pose

    def build_area(self) -> Area:
        """Where the vehicle may be. Raises AreaError, or InputError where none is given."""
        if self.area is None:
            raise InputError(f"{self.name}: has no [area]")
        ends = [(pose.x, pose.y) for pose in (self.start_pose(), self.goal_pose())]
        return self.area.build().bounded(ends, BOX)

    def goal_pose(self) -> Pose2:
        """The true goal before any shift, world frame. Raises as `build_path`."""
        if self.goal.pose is not None:
            return Pose2(*self.goal.pose)
        end = self.build_path().end
        return end if self.goal.offset is None else end.compose(Pose2(*self.goal.offset))

    def planned_goal(self) -> Pose2 | None:
        """The goal at the controller's start; None: the path's last pose."""
        if self.goal.measurement is not None:
            return self.goal_pose().compose(Pose2(*self.goal.measurement.initial_offset))
        return None if self.goal.is_path_end else self.goal_pose()

    def controller_config(
        self, preset: str = "default", *, method: str | None = None, detections: bool | None = None
    ) -> ControllerConfig:
        """The controller's settings. Raises InputError for an unknown preset or method, ConfigError.

        `method`: by default that of [controller]; `detections`: whether it detects the goal, by default with
        [goal.measurement].
        """
        if preset not in PRESETS:
            raise InputError(f"preset = {preset!r}: must be one of {', '.join(PRESETS)}")
        section, simulation, measurement = self.controller, self.simulation, self.goal.measurement
        # What the controller assumes of its actuators is the truth where its section does not say otherwise.
        names = set(ActuatorModel.model_fields)
        assumed = simulation.model_dump(include=names) | section.model_dump(include=names, exclude_none=True)
        changes: dict[str, Any] = {
            "vehicle": self.vehicle,
            "limits": self.limits,
            "cycle": simulation.cycle,
            "actuators": ActuatorModel(**assumed),
            "goal_tolerance": self.goal.tolerance,
            "deadline": None,  # the simulation's time stands while a cycle is computed
            **section.model_dump(exclude={*names, "docking_time", "weights", "method"}, exclude_none=True),
        }
        if (measurement is not None) if detections is None else detections:
            changes["goal_tracking"] = GoalTracking(required=True)
            if measurement is not None:
                # The filter knows the law of the detector's noise, and that detections may arrive late.
                longest = GoalFilterConfig().history + measurement.delay
                noise = GoalFilterConfig(noise=measurement.noise, history=longest)
                changes["goal_tracking"] = GoalTracking(filter=noise, required=True)
        config = with_method(PRESETS[preset](**changes), method or section.method)
        if section.weights is not None:
            config = config.changed(weights=section.weights.model_dump(exclude_unset=True))
        if section.docking_time is None:
            return config
        path = self.build_path()
        goal, corridor = self.planned_goal(), self.build_corridor(path)
        return config_for_docking_time(section.docking_time, path, config, goal, corridor=corridor)

    def plant_parameters(self) -> PlantParameters:
        """The plant, with the errors and faults that the controller does not know."""
        errors = self.simulation.model_dump(include={*ActuatorModel.model_fields, *_ERRORS})
        return PlantParameters.of(self.vehicle, self.limits, faults=plant_faults(self.faults), **errors)

    def _problems(self) -> Iterator[KeyProblem]:
        found = [*self._ground_problems(), *self._mission_problems()]
        if not found and self.path is not None and self.corridor is not None:
            found += self._problems_along(self.path.build(), self.corridor)
        yield from found or refusal("controller", None, self.controller_config)

    def _ground_problems(self) -> Iterator[KeyProblem]:
        on_path = {"path": self.path, "corridor": self.corridor}
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
            if getattr(step, CONTACT, False) and body is None:
                yield KeyProblem(f"{key}.contact", True, "needs goal.body, what is to be touched")
            yield from refusal(key, None, partial(step.build, goal, body), type(step))
            if step.retry_from is not None and step.retry_from > index:
                yield KeyProblem(f"{key}.retry_from", step.retry_from, f"must be <= {index}, its own place")
            if step.then == "home" and self.home is None:
                yield KeyProblem(f"{key}.then", "home", "needs [home]")

    def _problems_along(self, path: ReferencePath, section: CorridorSection) -> Iterator[KeyProblem]:
        """Of corridor, then goals: a problem hides those that follow from it."""
        try:
            corridor = section.build(path)
        except InputError as error:
            yield key_problem(error, "corridor", table=CorridorSection)
            return
        (narrowest, theta), width = corridor.narrowest(), self.vehicle.least_width
        # The narrowest place is sampled: only what is clearly below the width is refused.
        if narrowest < width - 1e-6:
            value = f"{narrowest:.4g} m wide at {theta:.4g} m along the path"
            yield KeyProblem("corridor", value, f"must be at least as wide as the body, {width} m")
        goal = self.goal_pose()
        goals = {} if self.goal.is_path_end else {"goal": goal}
        if (seen := self.goal.measurement) is not None:
            goals = {"goal.measurement.initial_offset": goal.compose(Pose2(*seen.initial_offset)), **goals}
        for index, shift in enumerate(self.goal.shifts):
            goal = goal.compose(Pose2(*shift.offset))
            goals[f"goal.shifts[{index}]"] = goal
        for key, goal in goals.items():
            if problem := checked_goal(goal, path, corridor, self.vehicle).problem:
                value = f"pose ({goal.x:.4g}, {goal.y:.4g}, {goal.phi:.4g})"
                yield KeyProblem(key, value, f"out of reach, {problem}")


def builtin_names() -> tuple[str, ...]:
    """Names of the scenarios that come with the package, sorted."""
    return tuple(sorted(file.stem for file in _BUILT_IN.glob("*.toml")))


def load_scenario(name_or_file: str | Path) -> Scenario:
    """A built-in scenario by name, or a .toml file; logs warnings.

    Raises ScenarioError with one line a problem: `file: key = value: what is allowed`.
    """
    name, file = str(name_or_file), Path(name_or_file)
    if name in builtin_names():
        file = _BUILT_IN / f"{name}.toml"
        name = file.name
    elif file.suffix != ".toml":
        raise ScenarioError(f"{name}: must be a .toml file or one of {', '.join(builtin_names())}")
    return _remarked(read_toml(Scenario, file, name), name)


def scenario_from_dict(
    data: Mapping[str, Any], *, source: str = "scenario", folder: Path | None = None
) -> Scenario:
    """A scenario from the tables of a file as dicts and lists. Raises ScenarioError as `load_scenario`.

    `source` stands in front of error messages; a relative path.file or area.map lies in `folder`, by default
    in the working directory.
    """
    return _remarked(parsed(Scenario, data, source=source, folder=folder), source)


def _remarked(scenario: Scenario, source: str) -> Scenario:
    """Warn of degrees in place of radians, and of a path that bends too sharply."""
    for key in ("start.pose", "path.start", "goal.pose", "goal.offset", "home.pose"):
        table, name = key.split(".")
        pose = getattr(getattr(scenario, table), name, None)
        if pose is not None and (hint := degrees_hint(f"{key}[2]", pose[2])):
            _LOG.warning("%s: %s", source, hint)
    if (path := scenario.path) is not None:
        bend = path.build().max_curvature
        possible = tan(scenario.limits.steering) / scenario.vehicle.wheelbase
        if bend > possible * (1.0 + 1e-9):
            most = f"(tan(limits.steering) / vehicle.wheelbase = {possible:.4g} 1/m)"
            told = f"path: its largest curvature {bend:.4g} 1/m is more than the vehicle can steer {most}"
            _LOG.warning("%s: %s; it is smoothed or left there", source, told)
    return scenario


def changed(scenario: Scenario, changes: Mapping[str, Any]) -> Scenario:
    """The scenario with other values, checked anew: changed(s, {"goal.offset": [1, 3, 0]}).

    A key is dotted as in the file (lists are replaced whole); the value None takes the key out.
    """
    data = scenario.model_dump(by_alias=True, exclude_unset=True)
    for key, value in changes.items():
        *tables, last = key.split(".")
        table = data
        for name in tables:
            table = table.setdefault(name, {})
        if value is None:
            table.pop(last, None)
        else:
            table[last] = value
    return scenario_from_dict(data, source=scenario.name)


def scenario_text(scenario: Scenario) -> str:
    """The scenario file (TOML): only what was set, so that defaults stay defaults. It is read back as equal.

    A path.file or area.map is written as an absolute path: the text may be put anywhere. Raises
    MissingExtraError without the extra `sim`.
    """
    data = scenario.model_dump(by_alias=True, exclude_unset=True, exclude_none=True)
    for table, key in (("path", "file"), ("area", "map")):
        if key in data.get(table, {}):
            data[table][key] = str(Path(data[table][key]).absolute())
    check_extra("sim", "writing a scenario file needs", "tomlkit")
    import tomlkit

    return tomlkit.dumps(data)


def save_scenario(scenario: Scenario, folder: Path) -> Path:
    """Write FOLDER/<name>.toml, making the folder where it is missing, and return that file."""
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / f"{scenario.name}.toml"
    file.write_text(scenario_text(scenario), encoding="utf-8")
    return file
