"""Missions drawn from a seed: a yard with two capsules, an expected place that is wrong, a camera that errs.

A mission is that of the paper: up to a capsule, lowered, connected, and out again. Its dock is not where it
is expected, its board may be seen late, be lost for a while, seen once in a wrong place, or be missing; the
other capsule has a board of its own.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, pi, sin, sqrt
from typing import Any

import numpy as np
import shapely

from benchmarks.problems.scenes import drawn_scene, row, scenario_of
from geometry import Area, Pose2
from geometry.outline import outline_at
from rti_mpcc.config import ControllerConfig, Vehicle
from rti_mpcc.errors import InputError
from rti_mpcc.model.footprint import body_polygons
from rti_mpcc.route_planner.planner import plan_manoeuvre
from rti_mpcc.simulation.scenario import Scenario, scenario_from_dict
from rti_mpcc.types import Array, MissionResult

DRAWS = 200
"""So many draws of one mission before it is given up."""
APPROACH, CONTACT, OUT = 2.0, 1.2, 6.0
"""Of the straight last piece of the way in, from there to the contact, and of the way out [m]."""
EXPECTED_OFF, EXPECTED_TURNED = 1.0, pi / 12.0
"""Of the place at which the dock is expected, at most [m], [rad]."""
FROM_DOCK, BESIDE_START = 8.0, 1.0
"""A start is so far from the dock at least, with so much room around the body [m]."""
KEPT_FREE = (6.0, 14.0)
"""No container stands so far beside the dock and before it [m]."""
OTHER_MARKER = 20
"""First marker of the other capsule's board."""
NEVER = 0.1
"""Range of a camera that never sees the board of the dock [m]."""
UNDOCKED, WAY_OUT = ("bay", "slot", "aisle"), 1.4
"""Scenes out of which a vehicle is to drive, and how far, in lengths of it."""
CAPSULE = (3.0, 2.2)
"""Length and width of a capsule [m]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DrawnMission:
    """A mission and what is to come of it.

    Attributes:
        scenario: see there; expected: what the mission is to come to.
    """

    scenario: Scenario
    expected: MissionResult


def drawn_mission(seed: int, number: int) -> DrawnMission:
    """The mission of this seed and number. Raises InputError where none can be drawn."""
    random = np.random.default_rng([seed, number, 24])
    for _ in range(DRAWS):
        found = _drawn(random, f"mission_{seed}_{number}")
        if found is not None:
            return found
    raise InputError(f"mission {number} of seed {seed}: {DRAWS} draws gave none")


def _drawn(random: np.random.Generator, name: str) -> DrawnMission | None:
    draw, vehicle = random.uniform, Vehicle()
    frame = Pose2(draw(-50.0, 50.0), draw(-50.0, 50.0), draw(-pi, pi))
    wide, high = draw(26.0, 40.0), draw(20.0, 28.0)
    goal = Pose2(draw(8.0, wide - 8.0), CAPSULE[0] + 1.0 + CONTACT + vehicle.rear, 0.5 * pi)
    side = float(random.choice((-1.0, 1.0)))
    other = Pose2(goal.x + side * (CAPSULE[1] + draw(1.0, 2.5)), goal.y, goal.phi)
    body = _capsule(vehicle)
    obstacles = [outline_at(body, other), *_containers(random, wide, high, goal)]
    start = Pose2(draw(3.0, wide - 3.0), draw(6.0, high - 3.0), draw(-pi, pi))
    boundary = np.array([(0.0, 0.0), (wide, 0.0), (wide, high), (0.0, high)])
    off = _off(random)
    if not _possible(start, goal, off, Area(boundary=boundary, obstacles=obstacles), body):
        return None
    camera, limits, expected = _seen(random, frame.compose(other))
    data = {
        "name": name,
        "description": "a drawn mission: a capsule is picked up where it is not expected",
        "start": {"pose": row(frame.compose(start))},
        "area": {
            "boundary": outline_at(boundary, frame).tolist(),
            "obstacles": [outline_at(each, frame).tolist() for each in obstacles],
        },
        "goal": {
            "pose": row(frame.compose(goal)),
            "tolerance": [0.05, 0.015, 0.007],
            "body": body.tolist(),
            "measurement": {
                "initial_offset": row(off),
                "visible_after_cusp": True,
                "rate": 5.0,
                "delay": 0.1,
            }
            | limits,
            "camera": camera,
        },
        "simulation": {"cycle": 0.05, "dead_time": 0.18, "duration": 300.0},
        "mission": steps(),
    }
    return DrawnMission(scenario=scenario_from_dict(data, source=name), expected=expected)


def drawn_undocking(seed: int, number: int) -> Scenario:
    """A vehicle that stands in a drawn bay, slot or aisle, and is to drive out of it.

    The scene is one of `scenes`, which has a proven way out; the way is 1.4 times as long as the vehicle, and
    out of a bay or aisle in the direction in which that way leads.
    """
    scene = drawn_scene(seed, number, UNDOCKED[number % len(UNDOCKED)])
    out = scene.witness.back().pieces[0].direction if scene.kind != "slot" else 1
    way = WAY_OUT * out * (scene.vehicle.front + scene.vehicle.rear)
    data = scenario_of(scene).model_dump(by_alias=True, exclude_unset=True)
    data |= {"name": f"undock_{scene.name}", "start": {"pose": row(scene.goal)}}
    data["mission"] = [{"kind": "undock", "distance": float(way)}]
    return scenario_from_dict(data, source=data["name"])


def steps() -> list[dict[str, Any]]:
    """The steps of a drawn mission, as in a scenario file."""
    return [
        {
            "kind": "dock",
            "approach": {"length": APPROACH, "direction": -1},
            "uncertainty": [EXPECTED_OFF, EXPECTED_TURNED],
            "retries": 1,
        },
        {"kind": "wait", "seconds": 3.0},
        {
            "kind": "straight",
            "distance": -CONTACT - 0.02,
            "tolerance": [0.02, 0.0087],
            "contact": True,
            "retries": 2,
            "retry_from": 0,
        },
        {"kind": "undock", "distance": OUT},
    ]


def _capsule(vehicle: Vehicle) -> Array:
    """The outline (4, 2) of a capsule in the frame of the vehicle that stands before it [m]."""
    near, half = -(CONTACT + vehicle.rear), 0.5 * CAPSULE[1]
    far = near - CAPSULE[0]
    return np.array([(far, -half), (near, -half), (near, half), (far, half)])


def _off(random: np.random.Generator) -> Pose2:
    """Where the dock is expected, in its own frame."""
    far, turned = EXPECTED_OFF * sqrt(random.uniform()), random.uniform(-pi, pi)
    turn = random.uniform(-EXPECTED_TURNED, EXPECTED_TURNED)
    return Pose2(far * cos(turned), far * sin(turned), turn)


def _containers(random: np.random.Generator, wide: float, high: float, goal: Pose2) -> list[Array]:
    """Boxes (4, 2) all over the yard, none before the dock [m]."""
    beside, before = KEPT_FREE
    free = shapely.box(goal.x - beside, 0.0, goal.x + beside, goal.y + before)
    found = []
    for _ in range(int(random.integers(2, 7))):
        size = random.uniform((1.0, 1.0), (6.0, 2.5))
        half = 0.5 * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) * size
        place = Pose2(random.uniform(0.0, wide), random.uniform(0.0, high), random.uniform(-pi, pi))
        outline = outline_at(half, place)
        if not free.intersects(shapely.Polygon(outline)):
            found.append(outline)
    return found


def _possible(start: Pose2, goal: Pose2, off: Pose2, area: Area, body: Array) -> bool:
    """Whether the vehicle has room where it starts, and a way to where the dock is and to where it is
    expected."""
    config = ControllerConfig()
    route = {"final_straight": APPROACH, "final_direction": -1}
    config = config.changed(route=route)
    around = shapely.Polygon(_body(start)).buffer(BESIDE_START)
    assert area.boundary is not None
    room = shapely.Polygon(area.boundary).contains(around)
    if not room or any(shapely.Polygon(each).intersects(around) for each in area.obstacles):
        return False
    if float(np.hypot(start.x - goal.x, start.y - goal.y)) < FROM_DOCK:
        return False
    for dock in (goal, goal.compose(off)):
        solid = area.with_obstacles([outline_at(body, dock)])
        if not plan_manoeuvre(start, dock, solid, config).found:
            return False
    return True


def _seen(random: np.random.Generator, other: Pose2) -> tuple[dict[str, Any], dict[str, Any], MissionResult]:
    """What the camera does wrong: [goal.camera], keys of [goal.measurement], and what is to come of it."""
    camera: dict[str, Any] = {"others": [{"pose": row(other), "first_marker": OTHER_MARKER}]}
    camera["board"] = {"x": -(CONTACT + Vehicle().rear)}
    late, lost, wrong, missing = random.uniform(size=4) < (0.4, 0.4, 0.4, 0.05)
    begin, after = random.uniform(0.3, 3.0, 2).tolist()
    if lost:
        camera["lost"] = [begin, begin + 3.0]
    if wrong:
        camera["wrong"] = {
            "after": after,
            "offset": random.uniform((-1.5, -1.5, -0.5), (1.5, 1.5, 0.5)).tolist(),
        }
    limits = {"visible_range": random.uniform(4.0, 7.0)} if late else {}
    if missing:
        return camera, {"visible_range": NEVER}, MissionResult.NOT_DETECTED
    return camera, limits, MissionResult.SUCCEEDED


def _body(pose: Pose2) -> Array:
    corners: Array = body_polygons(np.array([[pose.x, pose.y, pose.phi]]), Vehicle())[0]
    return corners
