"""Levels of difficulty: the same random course or scene, with what disturbs a real vehicle on top.

All that disturbs a case stands in its scenario, so a saved case is driven again as it was. Every value is
drawn at every level, evenly between its two bounds or up to one to either side, from a stream of the case's
own, and only those of the level are put into the scenario: a case of `hard` has the noise of the same case of
`noisy` and the model errors of the same case of `mismatched`, on the course of all four.
"""

from __future__ import annotations

from enum import Enum
from math import radians
from typing import Any

import numpy as np

from benchmarks.problems.scenes import SLOT_CLEARANCE
from rti_mpcc.errors import ScenarioError
from rti_mpcc.model.footprint import body_of
from rti_mpcc.simulation.scenario import Scenario, changed

DETECTION = {
    "position_std": (0.02, 0.08),
    "heading_std": (0.015, 0.05),
    "position_floor": (0.001, 0.003),
    "heading_floor": (0.0005, 0.002),
    "visible_range": (10.0, 20.0),
    "delay": (0.0, 0.1),
    "dropout": (0.0, 0.2),
    "outlier": (0.0, 0.04),
    "outlier_size": (0.5, 1.5),
}
"""Of [goal.measurement], in its units: the noise of a detection from 10 m away, and near the goal."""
INITIAL_OFFSET = (0.4, 0.3, 0.1)
"""The planned goal is up to so far beside the true one along, across [m] and turned [rad], in the true goal's
frame; halved until the body has room there."""
STATE_NOISE = (0.015, 0.003, 0.015, 0.003)
"""Largest standard deviations of the measured position [m], heading [rad], speed [m/s], steering [rad]."""
WHEELBASE_ERROR, STEERING_OFFSET = 0.05, radians(1.0)
"""Of the plant, relative and [rad]."""
GAIN, DEAD_TIME, ASSUMED_DEAD_TIME = (0.8, 1.2), (0.1, 0.25), 0.18
"""Of the plant's acceleration; of the plant, and what the controller takes it for [s]."""
APPEARS, STAYS, AHEAD = (3.0, 15.0), (3.0, 10.0), (1.0, 4.0)
"""When something blocks the way of a vehicle in an area, for how long [s], and how far beyond the way in
which the vehicle can stop at its largest speed [m]."""
STREAM = 7
"""Given to the generator behind seed and index, so that courses don't change with what is drawn here."""
DIGITS = 5
"""Of all that is drawn, so that a saved case is readable."""
_HALVINGS = 8


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


def at_level(course: Scenario, level: Level, seed: int, index: int) -> Scenario:
    """The course number `index` of a seed at a level, always the same; its name has the level."""
    random = np.random.default_rng([seed, index, STREAM])
    noise, mismatch, appearing = _noise(random), _mismatch(random), _appearing(random, course)
    changes: dict[str, Any] = {"name": f"{course.name}_{level.value}"}
    if level.noisy:
        changes |= noise
    if level.mismatched:
        changes |= mismatch
    if level is Level.HARD and course.in_area:
        changes |= appearing
    return _with_room(course, changes) if level.noisy else changed(course, changes)


def _noise(random: np.random.Generator) -> dict[str, Any]:
    """Keys of the scenario: how goal and state are measured."""
    measurement: dict[str, Any] = {name: _number(random, *span) for name, span in DETECTION.items()}
    offset = [_number(random, -most, most) for most in INITIAL_OFFSET]
    position, *others = (_number(random, 0.0, most) for most in STATE_NOISE)
    return {
        "goal.measurement": {**measurement, "reference_range": 10.0, "initial_offset": offset},
        "simulation.state_noise": [position, position, *others],
    }


def _mismatch(random: np.random.Generator) -> dict[str, Any]:
    """Keys of the scenario: what the plant is, and what the controller takes it for."""
    return {
        "simulation.wheelbase_error": _number(random, -WHEELBASE_ERROR, WHEELBASE_ERROR),
        "simulation.steering_offset": _number(random, -STEERING_OFFSET, STEERING_OFFSET),
        "simulation.acceleration_gain": _number(random, *GAIN),
        "simulation.dead_time": _number(random, *DEAD_TIME),
        "controller.dead_time": ASSUMED_DEAD_TIME,
    }


def _appearing(random: np.random.Generator, course: Scenario) -> dict[str, Any]:
    """Keys of the scenario: what fills the way of a vehicle in an area, which can still stop before it.

    With the largest speed v, acceleration a, its least gain g and the longest dead time t, that takes

        t v + v²/(2 g a)                                                                                  (1)
    """
    begin, stays, beyond = (_number(random, *span) for span in (APPEARS, STAYS, AHEAD))
    v, a = course.limits.speed, GAIN[0] * course.limits.acceleration
    gap = DEAD_TIME[1] * v + 0.5 * v**2 / a + beyond
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
    if goal is None:
        return True
    pose = np.array([[goal.x, goal.y, goal.phi]])
    (room,) = scenario.build_area().signed_distances(body_of(scenario.vehicle), pose)
    return bool(room >= SLOT_CLEARANCE)


def _number(random: np.random.Generator, low: float, high: float) -> float:
    """Rounding must not leave the range: 1 deg is no round number in radians."""
    return min(max(round(float(random.uniform(low, high)), DIGITS), low), high)
