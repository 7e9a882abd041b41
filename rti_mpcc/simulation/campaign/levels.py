"""Levels of difficulty: the same drawn course or scene, with what disturbs a real vehicle on top.

All that a case is disturbed by stands in its scenario, so a saved case is driven again as it was. What it is
drawn from is a `DisturbanceRange`. Every value is drawn at every level, from a stream of the case's own, and
only those of the level are put into the scenario: a case of `hard` has the noise of the same case of `noisy`
and the model errors of the same case of `mismatched`, on the course of all four. In a scene something fills
the way for a while at level `hard`.
"""

from __future__ import annotations

from enum import Enum
from math import radians
from typing import Annotated, Any, Self

import numpy as np
from pydantic import Field, model_validator

from benchmarks.problems.scenes import SLOT_CLEARANCE
from geometry import Pose2
from geometry.settings import NonNegative, Positive, Settings
from rti_mpcc.errors import ScenarioError
from rti_mpcc.simulation.scenario import Scenario
from rti_mpcc.simulation.scenario_file import changed
from rti_mpcc.simulation.solid import SolidThings

STREAM = 7
"""Told the generator behind seed and index, so that courses don't change with what is drawn here."""
DIGITS = 5
"""Of all that is drawn, so that a saved case is readable."""
_HALVINGS = 8
_DETECTION = (
    "position_std",
    "heading_std",
    "position_floor",
    "heading_floor",
    "visible_range",
    "delay",
    "dropout",
    "outlier",
    "outlier_size",
)
Share = Annotated[float, Field(ge=0.0, le=1.0)]
Span = tuple[NonNegative, NonNegative]
PositiveSpan = tuple[Positive, Positive]
ShareSpan = tuple[Share, Share]


class Level(Enum):
    """How much disturbs a case."""

    NOMINAL = "nominal"
    """Nothing: goal and state are known exactly, the plant is the model."""
    NOISY = "noisy"
    """The goal is known from detections only, and the measured state is noisy."""
    MISMATCHED = "mismatched"
    """The plant is not the model, and its dead time is not the one assumed."""
    HARD = "hard"
    """All of it, and in a scene something that fills the way for a while."""

    @property
    def noisy(self) -> bool:
        """Whether goal and state are measured with noise."""
        return self in (Level.NOISY, Level.HARD)

    @property
    def mismatched(self) -> bool:
        """Whether the plant is another one than the controller's model."""
        return self in (Level.MISMATCHED, Level.HARD)


class DisturbanceRange(Settings):
    """What disturbances are drawn from, evenly between two bounds or up to one to either side.

    Attributes:
        position_std [m], heading_std [rad]: of a detection of the goal from `reference_range` [m] away;
            position_floor [m], heading_floor [rad]: near it. See [goal.measurement] of scenario files.
        visible_range: from where on the goal is seen [m].
        delay: of detections [s]; dropout, outlier: probabilities; outlier_size: [m].
        initial_offset: the planned goal is up to so far beside the true one along, across [m] and turned
            [rad], in the true goal's frame; halved until the body has room there.
        state_position [m], state_heading [rad], state_speed [m/s], state_steering [rad]: standard deviations
            of the measured state.
        wheelbase_error: relative; steering_offset: [rad]; acceleration_gain: of the plant.
        dead_time: of the plant [s]; assumed_dead_time: what the controller takes it for [s].
        appears: when something fills the way of a vehicle in an area [s]; stays: for so long [s]; ahead: so
            far beyond the way in which the vehicle can stop at its largest speed [m].
    """

    position_std: PositiveSpan = (0.02, 0.08)
    heading_std: PositiveSpan = (0.015, 0.05)
    position_floor: PositiveSpan = (0.001, 0.003)
    heading_floor: PositiveSpan = (0.0005, 0.002)
    reference_range: Positive = 10.0
    visible_range: PositiveSpan = (10.0, 20.0)
    delay: Span = (0.0, 0.1)
    dropout: ShareSpan = (0.0, 0.2)
    outlier: ShareSpan = (0.0, 0.04)
    outlier_size: Span = (0.5, 1.5)
    initial_offset: tuple[NonNegative, NonNegative, NonNegative] = (0.4, 0.3, 0.1)
    state_position: Span = (0.0, 0.015)
    state_heading: Span = (0.0, 0.003)
    state_speed: Span = (0.0, 0.015)
    state_steering: Span = (0.0, 0.003)
    wheelbase_error: NonNegative = 0.05
    steering_offset: NonNegative = radians(1.0)
    acceleration_gain: PositiveSpan = (0.8, 1.2)
    dead_time: Span = (0.1, 0.25)
    assumed_dead_time: NonNegative = 0.18
    appears: Span = (3.0, 15.0)
    stays: Span = (3.0, 10.0)
    ahead: Span = (1.0, 4.0)

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        for name in type(self).model_fields:
            value = getattr(self, name)
            if isinstance(value, tuple) and len(value) == 2 and value[0] > value[1]:
                raise ValueError(f"{name} = {value}: the first must not be above the second")
        return self


def at_level(
    course: Scenario, level: Level, seed: int, index: int, within: DisturbanceRange | None = None
) -> Scenario:
    """The course number `index` of a seed at a level, always the same; its name tells the level.

    Raises ScenarioError where what is drawn makes no scenario, which the default range does not.
    """
    within = within or DisturbanceRange()
    random = np.random.default_rng([seed, index, STREAM])
    noise, mismatch = _noise(random, within), _mismatch(random, within)
    appearing = _appearing(random, course, within)
    changes: dict[str, Any] = {"name": f"{course.name}_{level.value}"}
    if level.noisy:
        changes |= noise
    if level.mismatched:
        changes |= mismatch
    if level is Level.HARD and course.in_area:
        changes |= appearing
    return _with_room(course, changes) if level.noisy else changed(course, changes)


def _noise(random: np.random.Generator, within: DisturbanceRange) -> dict[str, Any]:
    """Keys of the scenario: how goal and state are measured."""
    drawn = {name: _number(random, *getattr(within, name)) for name in _DETECTION}
    offset = [_number(random, -most, most) for most in within.initial_offset]
    position = _number(random, *within.state_position)
    others = (within.state_heading, within.state_speed, within.state_steering)
    measurement = {**drawn, "reference_range": within.reference_range, "initial_offset": offset}
    return {
        "goal.measurement": measurement,
        "simulation.state_noise": [position, position, *(_number(random, *span) for span in others)],
    }


def _mismatch(random: np.random.Generator, within: DisturbanceRange) -> dict[str, Any]:
    """Keys of the scenario: what the plant is, and what the controller takes it for."""
    return {
        "simulation.wheelbase_error": _number(random, -within.wheelbase_error, within.wheelbase_error),
        "simulation.steering_offset": _number(random, -within.steering_offset, within.steering_offset),
        "simulation.acceleration_gain": _number(random, *within.acceleration_gain),
        "simulation.dead_time": _number(random, *within.dead_time),
        "controller.dead_time": within.assumed_dead_time,
    }


def _appearing(random: np.random.Generator, course: Scenario, within: DisturbanceRange) -> dict[str, Any]:
    """Keys of the scenario: what fills the way of a vehicle in an area, which can still stop before it.

    With the largest speed v, acceleration a, its least gain g and the longest dead time t, that takes

        t v + v²/(2 g a)                                                                                  (1)
    """
    begin, stays, beyond = (_number(random, *span) for span in (within.appears, within.stays, within.ahead))
    v, a = course.limits.speed, within.acceleration_gain[0] * course.limits.acceleration
    gap = within.dead_time[1] * v + 0.5 * v**2 / a + beyond
    fault = {"kind": "blocked", "from": begin, "to": round(begin + stays, DIGITS), "size": round(gap, DIGITS)}
    return {"faults": [fault]}


def _with_room(course: Scenario, changes: dict[str, Any]) -> Scenario:
    """The changed course, the planned goal drawn nearer to the true one until the body has room there."""
    measurement = changes["goal.measurement"]
    whole = measurement["initial_offset"]
    for halved in range(_HALVINGS):
        offset = [round(0.5**halved * value, DIGITS) for value in whole]
        try:
            found = changed(course, changes | {"goal.measurement": measurement | {"initial_offset": offset}})
        except ScenarioError:
            continue
        if _has_room(found):
            return found
    return changed(course, changes | {"goal.measurement": measurement | {"initial_offset": [0.0, 0.0, 0.0]}})


def _has_room(scenario: Scenario) -> bool:
    """Whether the body has room at the planned goal; along a path that has been checked by then."""
    goal = scenario.planned_goal() if scenario.in_area else None
    return goal is None or _room(scenario, goal) >= SLOT_CLEARANCE


def _room(scenario: Scenario, pose: Pose2) -> float:
    """Clearance of the body at a pose in its area [m]."""
    poses = np.array([[pose.x, pose.y, pose.phi]])
    return float(SolidThings.of(scenario.build_area()).clearance(poses, scenario.build_vehicle())[0])


def _number(random: np.random.Generator, low: float, high: float) -> float:
    """Rounding must not leave the range: 1 deg is no round number in radians."""
    return min(max(round(float(random.uniform(low, high)), DIGITS), low), high)
