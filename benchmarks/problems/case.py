"""A case of a study: which random problem it is, its scenario, and how difficult it is."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from itertools import pairwise
from math import hypot, tan
from typing import Any

import numpy as np

from benchmarks.problems.courses import CAMPAIGN, drawn_course
from benchmarks.problems.levels import Level, at_level
from benchmarks.problems.scenes import drawn_scene, kind_of, kind_of_number, scenario_of
from rti_mpcc.errors import InputError
from rti_mpcc.model.footprint import body_of
from rti_mpcc.simulation.campaign import MOST, Drawn
from rti_mpcc.simulation.scenario import Scenario, changed

DIGITS = 6
"""Of what is computed from the rounded numbers of a course."""


class Problems(Enum):
    """What a study draws."""

    COURSES = "courses"
    """A path with its corridor, and a goal near its end: `drawn_course`."""
    SCENES = "scenes"
    """No path: a start, a goal and obstacles, `drawn_scene`."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CampaignCase:
    """Case number `index` of a study of this seed and level; see `rti_mpcc.simulation.campaign.RandomCase`.

    Attributes:
        method, preset: of its controller; deadline: of its cycles [s], or None; ride: smooth or brisk, or
            None for the scenario's own.

    Raises InputError for a negative seed, or an index that is not in 0 ... MOST - 1.
    """

    seed: int
    level: Level
    index: int
    method: str = "dynamic"
    preset: str = "default"
    problems: Problems = Problems.COURSES
    deadline: float | None = None
    ride: str | None = None

    def __post_init__(self) -> None:
        if self.seed < 0:
            raise InputError(f"seed = {self.seed}: must be >= 0")
        if not 0 <= self.index < MOST:
            raise InputError(f"index = {self.index}: must be >= 0 and < {MOST}")

    @property
    def run(self) -> dict[str, Any]:
        """Of its run; the noise is another one for each case of each study."""
        return {"method": self.method, "preset": self.preset, "seed": MOST * self.seed + self.index}

    @property
    def name(self) -> str:
        """Of its scenario."""
        if self.problems is Problems.SCENES:
            return f"{kind_of_number(self.index)}_{self.seed}_{self.index}_{self.level.value}"
        return f"{CAMPAIGN.prefix}_{self.seed}_{self.index:02d}_{self.level.value}"

    def scenario(self) -> Scenario:
        """Always the same. Raises InputError where none of many draws can be docked in."""
        if self.problems is Problems.SCENES:
            drawn = scenario_of(drawn_scene(self.seed, self.index))
        else:
            drawn = drawn_course(self.seed, self.index, CAMPAIGN)
        scenario = at_level(drawn, self.level, self.seed, self.index)
        asked = {"controller.deadline": self.deadline, "controller.ride": self.ride}
        changes = {name: value for name, value in asked.items() if value is not None}
        return changed(scenario, changes) if changes else scenario

    def drawn(self, scenario: Scenario) -> Drawn:
        """How difficult it is."""
        course = scene_figures(scenario) if scenario.in_area else course_figures(scenario)
        return {"course": course, "disturbances": disturbance_figures(scenario)}


def course_figures(scenario: Scenario) -> dict[str, Any]:
    """How difficult a scenario with arcs for a route, and offsets for corridor and goal, is.

    Direction of the last arc (1 forward, -1 reverse); number of arcs (pieces) and of changes of direction
    (cusps); length [m] and largest |kappa| [1/m] of the route; room from the body on the route to the nearest
    boundary, narrowings included [m]; the goal behind the end of the route along the travel, negative inside
    [m], beside it to the left of the vehicle's heading [m], and turned [rad].

    Raises InputError for other scenarios.
    """
    path, corridor, offset = scenario.path, scenario.corridor, scenario.goal.offset
    route = None if path is None else path.segments
    if route is None or corridor is None or corridor.left is None or corridor.right is None or offset is None:
        raise InputError(f"{scenario.name}: needs path.segments, corridor.left and .right and goal.offset")
    sides = [(corridor.left, corridor.right), *((one.left, one.right) for one in corridor.narrowings)]
    nearest = min(abs(side) for pair in sides for side in pair if side is not None)
    directions = [piece.direction for piece in route]
    along, beside, turned = offset
    return {
        "direction": directions[-1],
        "pieces": len(route),
        "cusps": sum(one != other for one, other in pairwise(directions)),
        "length_m": round(sum(piece.length for piece in route), DIGITS),
        "curvature": max(abs(piece.curvature) for piece in route),
        "room_m": round(nearest - 0.5 * scenario.vehicle.width, DIGITS),
        "narrowings": len(corridor.narrowings),
        "obstacles": len(corridor.obstacles),
        "goal_behind_m": directions[-1] * along,
        "goal_beside_m": beside,
        "goal_turned_rad": turned,
    }


def scene_figures(scenario: Scenario) -> dict[str, Any]:
    """How difficult a scenario in an area is: its vehicle, start to goal, and room around the body there."""
    vehicle, area = scenario.vehicle, scenario.area
    assert area is not None
    start, goal = scenario.start_pose(), scenario.goal_pose()
    poses = np.array([(pose.x, pose.y, pose.phi) for pose in (start, goal)])
    room = scenario.build_area().signed_distances(body_of(vehicle), poses)
    return {
        "kind": kind_of(scenario),
        "wheelbase_m": vehicle.wheelbase,
        "radius_m": round(vehicle.wheelbase / tan(scenario.limits.steering), DIGITS),
        "apart_m": round(hypot(goal.x - start.x, goal.y - start.y), DIGITS),
        "turned_rad": round(abs(goal.relative_to(start).phi), DIGITS),
        "room_at_start_m": round(float(room[0]), DIGITS),
        "room_at_goal_m": round(float(room[1]), DIGITS),
        "obstacles": len(area.obstacles),
        "bounded": int(area.boundary is not None),
        "comfort_acceleration": scenario.controller_config().comfort_acceleration,
    }


def disturbance_figures(scenario: Scenario) -> dict[str, Any]:
    """What a scenario has of errors and noise: zeros, and a gain of 1, where there is none.

    Standard deviations of a detection from 10 m away [m], [rad], its probabilities of dropout and outlier,
    its delay [s]; the planned goal in the frame of the true one [m], [m], [rad]; standard deviations of the
    measured x, y [m], phi [rad], v [m/s], delta [rad]; errors of the plant, and its dead time [s].
    """
    seen, simulation = scenario.goal.measurement, scenario.simulation
    names = {
        "position_std_m": "position_std",
        "heading_std_rad": "heading_std",
        "dropout": "dropout",
        "outlier": "outlier",
        "delay_s": "delay",
    }
    return {
        **{name: getattr(seen, source) if seen else 0.0 for name, source in names.items()},
        "initial_offset": seen.initial_offset if seen else (0.0, 0.0, 0.0),
        "state_noise": simulation.state_noise,
        "wheelbase_error": simulation.wheelbase_error,
        "steering_offset_rad": simulation.steering_offset,
        "acceleration_gain": simulation.acceleration_gain,
        "dead_time_s": simulation.dead_time,
    }
