"""Random changes of a user's scenario: start, goal, noise, and errors of the plant.

Each value is uniform, from the generator of its case. All parts are drawn each time, so a case has the same
start whether or not the noise varies, too.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from contextlib import suppress
from dataclasses import dataclass
from math import radians
from typing import Any

import numpy as np

from geometry import Pose2
from rti_mpcc.errors import InputError
from rti_mpcc.model.footprint import body_of, clearances
from rti_mpcc.simulation.campaign import MOST, Drawn
from rti_mpcc.simulation.scenario import Scenario, changed

START = GOAL = (0.5, 0.3, radians(5.0))
"""Start and goal are shifted along and across [m] and turned [rad], in their own frames; see `CLEARANCE`."""
STATE_NOISE = (0.015, 0.003, 0.015, 0.003)
"""Largest additions to the standard deviations of the measured position [m], heading [rad], speed [m/s],
steering [rad]."""
DETECTION = 0.5
"""Share by which the noise of detections is more or less, where the scenario has [goal.measurement]."""
WHEELBASE_ERROR, STEERING_OFFSET, GAIN, DEAD_TIME = 0.05, radians(1.0), 0.2, 0.07
"""Errors of the plant that the controller does not know: relative, [rad], relative, [s]."""
PARTS = ("start", "goal", "noise", "plant")
CLEARANCE = 0.1
"""A shift is halved, at most `HALVINGS` times, until the body has this clearance [m], or that without the
shift, at the start and at the goal of an area."""
HALVINGS = 6
DIGITS = 5  # of all random values, so that a saved case is readable


@dataclass(frozen=True, slots=True, kw_only=True)
class VariedCase:
    """Case `index` of a campaign that varies some of `PARTS` of the scenario `base`; see `RandomCase`."""

    base: Scenario
    vary: tuple[str, ...]
    seed: int
    index: int

    @property
    def name(self) -> str:
        """Of its scenario."""
        return f"{self.base.name}_{self.seed}_{self.index:02d}"

    @property
    def run(self) -> dict[str, Any]:
        """A seed of its own for each case of each campaign."""
        return {"seed": MOST * self.seed + self.index}

    def scenario(self) -> Scenario:
        """See `RandomCase`."""
        random = np.random.default_rng([self.seed, self.index])
        return varied(changed(self.base, {"name": self.name}), self.vary, random)

    def drawn(self, scenario: Scenario) -> Drawn:
        """How start and goal are shifted: along, beside [m], turned [rad]; the plant as in the scenario."""
        start = scenario.start_pose().relative_to(self.base.start_pose())
        goal = scenario.goal_pose().relative_to(self.base.goal_pose())
        names = ("state_noise", "wheelbase_error", "steering_offset", "acceleration_gain", "dead_time")
        return {
            "course": {"start": _rounded(start), "goal": _rounded(goal)},
            "disturbances": scenario.simulation.model_dump(include=set(names)),
        }


def varied(scenario: Scenario, vary: Collection[str], random: np.random.Generator) -> Scenario:
    """The scenario with some of `PARTS` drawn. Raises ScenarioError where it allows no change of a part."""
    start, goal = ([_drawn(random, most) for most in shift] for shift in (START, GOAL))
    changes = {"noise": _noise(scenario, random), "plant": _plant(scenario, random)}
    for part, values in changes.items():
        scenario = changed(scenario, values) if part in vary else scenario
    if "start" in vary:
        scenario = _shifted(scenario, "simulation.start_offset", scenario.simulation.start_offset, start)
    if "goal" in vary:
        own = scenario.goal
        key, pose = ("goal.offset", own.offset) if own.pose is None else ("goal.pose", own.pose)
        scenario = _shifted(scenario, key, pose or (0.0, 0.0, 0.0), goal)
    return scenario


def _noise(scenario: Scenario, random: np.random.Generator) -> dict[str, Any]:
    position, *others = (round(float(random.uniform(0.0, most)), DIGITS) for most in STATE_NOISE)
    noise = np.add(scenario.simulation.state_noise, (position, position, *others)).tolist()
    changes: dict[str, Any] = {"simulation.state_noise": noise}
    for name in ("position_std", "heading_std"):
        factor = 1.0 + _drawn(random, DETECTION)
        if (seen := scenario.goal.measurement) is not None:
            changes[f"goal.measurement.{name}"] = factor * getattr(seen, name)
    return changes


def _plant(scenario: Scenario, random: np.random.Generator) -> dict[str, Any]:
    """The controller continues to assume its dead time."""
    plant, assumed = scenario.simulation, scenario.controller.dead_time
    return {
        "simulation.wheelbase_error": plant.wheelbase_error + _drawn(random, WHEELBASE_ERROR),
        "simulation.steering_offset": plant.steering_offset + _drawn(random, STEERING_OFFSET),
        "simulation.acceleration_gain": plant.acceleration_gain * (1.0 + _drawn(random, GAIN)),
        "simulation.dead_time": max(plant.dead_time + _drawn(random, DEAD_TIME), 0.0),
        "controller.dead_time": plant.dead_time if assumed is None else assumed,
    }


def _shifted(scenario: Scenario, key: str, pose: Sequence[float], shift: Sequence[float]) -> Scenario:
    """The scenario with the pose at a key shifted in its own frame, by less where there is no room."""
    least = min(CLEARANCE, _clearance(scenario))
    for halved in range(HALVINGS):
        moved = Pose2(*pose).compose(Pose2(*(0.5**halved * value for value in shift)))
        with suppress(InputError):
            found = changed(scenario, {key: _rounded(moved)})
            if _clearance(found) >= least:
                return found
    return scenario


def _clearance(scenario: Scenario) -> float:
    """Least clearance of the body at the start, and at the goal of an area [m]."""
    poses, vehicle = [_rounded(scenario.start_pose())], scenario.vehicle
    if scenario.in_area:
        poses.append(_rounded(scenario.goal_pose()))
        return float(scenario.build_area().signed_distances(body_of(vehicle), np.array(poses)).min())
    corridor = scenario.build_corridor(scenario.build_path())
    return float(clearances(np.array(poses), corridor, 0, vehicle).min())


def _drawn(random: np.random.Generator, most: float) -> float:
    return round(float(random.uniform(-most, most)), DIGITS)


def _rounded(pose: Pose2) -> list[float]:
    return [round(value, DIGITS) for value in (pose.x, pose.y, pose.phi)]
