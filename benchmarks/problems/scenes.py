"""Scenes without a path, drawn from a seed: a start, a goal, what stands, and a drive that leads there.

Every scene carries its proof: a drive made together with what stands (`Scene.witness`), of which `proven`
says how far its body keeps from everything, without anything of what it was made with. Its pieces are of
constant curvature, and every one of them may begin with a stop at which the wheels are turned.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import hypot, pi, tan
from typing import Any

import numpy as np
import shapely

from benchmarks.problems.scene_areas import aisle, clutter, yard
from benchmarks.problems.scene_parking import bay, slot
from benchmarks.problems.scene_parts import Draw, Layout
from benchmarks.problems.witness import Drive
from geometry import Pose2, wrap
from geometry.outline import outline_at
from rti_mpcc.config import Limits, Vehicle
from rti_mpcc.errors import InputError
from rti_mpcc.model.footprint import body_polygons
from rti_mpcc.simulation.scenario import Scenario, scenario_from_dict
from rti_mpcc.types import Array

DRAWS = 100
"""So many draws of one scene before it is given up."""
CLEARANCE = 0.15
"""Of the body of a witness to all that stands, at least [m];"""
SLOT_CLEARANCE = 0.1
"""and in slots [m]."""
CURVATURE_SHARE = 0.9
"""Of the vehicle's largest curvature, at most."""
PROOF_SPACING = 0.01
"""Between the bodies of a proof [m]."""
KINDS: dict[str, Callable[[Draw], Layout | None]] = {
    "bay": bay,
    "slot": slot,
    "yard": yard,
    "clutter": clutter,
    "aisle": aisle,
}
VEHICLES: dict[str, tuple[Vehicle, float, float]] = {
    "car": (Vehicle(wheelbase=2.8, width=1.942, front=3.76, rear=0.929), 0.75, 2.5),
    "default": (Vehicle(), 0.6, 2.5),
    "robot": (Vehicle(wheelbase=0.8, width=0.7, front=1.0, rear=0.2), 0.7, 1.5),
    "van": (Vehicle(wheelbase=3.6, width=2.02, front=4.75, rear=1.15), 0.7, 2.5),
}
"""Bodies, largest steering [rad] and speed [m/s]."""
_NEAR, _FAR = 50.0, 1e6  # [m] from the origin of the world; one in ten is in coordinates of a map
DEAD_TIME = 0.18
"""Of the plant, known to the controller [s]."""
DURATION = 240.0
"""More than any of the ways takes that have been driven [s]."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Scene:
    """A problem for a route planner, with a proof that it can be solved.

    Attributes:
        name: <kind>_<seed>_<number>; kind: one of `KINDS`.
        start, goal: poses of the middle of the rear axle.
        boundary: outline (m, 2) [m] of what may be driven on, or None.
        obstacles: corners (m, 2) [m] of simple polygons; they may overlap.
        vehicle, limits: see there; comfort_acceleration: [m/s²].
        witness: a drive from the start to the goal.
    """

    name: str
    kind: str
    start: Pose2
    goal: Pose2
    boundary: Array | None
    obstacles: tuple[Array, ...]
    vehicle: Vehicle
    limits: Limits
    comfort_acceleration: float
    witness: Drive

    @property
    def clearance(self) -> float:
        """Distance of the body to all that stands that every scene of its kind has been proven for [m]."""
        return SLOT_CLEARANCE if self.kind == "slot" else CLEARANCE

    @property
    def curvature(self) -> float:
        """The largest that a witness has, at most [1/m]."""
        return _largest_curvature(self.vehicle, self.limits.steering)


def drawn_scene(seed: int, number: int, kind: str | None = None) -> Scene:
    """Scene number `number` of a seed, always the same: drawn until there is one that is proven.

    Args:
        kind: one of `KINDS`; without it they take turns.

    Raises:
        InputError: a negative seed or number, a kind that there is none of, or nothing within DRAWS draws.
    """
    for name, value in (("seed", seed), ("number", number)):
        if value < 0:
            raise InputError(f"{name} = {value}: must be >= 0")
    kind = kind_of_number(number) if kind is None else kind
    if kind not in KINDS:
        raise InputError(f"kind = {kind!r}: must be one of {', '.join(KINDS)}")
    random = np.random.default_rng([seed, number])
    for _ in range(DRAWS):
        scene = _drawn(random, f"{kind}_{seed}_{number}", kind)
        if scene is not None:
            return scene
    raise InputError(f"scene {number} of seed {seed}: none of {DRAWS} draws has a way that is clear")


def kind_of_number(number: int) -> str:
    """Of a scene that is drawn without asking for a kind: they take turns."""
    return list(KINDS)[number % len(KINDS)]


def proven(scene: Scene) -> float:
    """The least clearance of a scene's witness [m], negative where it leaves the boundary or misses the goal.

    With d_i the distance of the body at pose i to all that stands, and l_i the way of its corners from there
    to the next pose, no point of the body comes nearer on the way than

        min_i (d_i + d_(i+1) - l_i)/2                                                                     (1)

    The poses are those of `geometry` and the distances those of shapely.
    """
    path = scene.witness.path
    missed = path.end.relative_to(scene.goal)
    if path.start != scene.start or not missed.within((1e-6, 1e-6, 1e-9)):
        return -np.inf
    least = np.inf
    for part in path.sample(PROOF_SPACING):
        corners = body_polygons(np.column_stack([part.x, part.y, part.phi]), scene.vehicle)
        ways = np.linalg.norm(np.diff(corners, axis=0), axis=2).max(axis=1)
        apart = _distances(shapely.polygons(corners), scene)
        least = min(least, float((apart[:-1] + apart[1:] - ways).min()) / 2.0)
    return least


def _distances(bodies: Array, scene: Scene) -> Array:
    """Distances (n,) [m] of bodies (shapely) to all that stands, negative beyond the boundary."""
    shapes = [shapely.Polygon(corners) for corners in scene.obstacles]
    inside = np.ones(len(bodies), dtype=np.bool_)
    if scene.boundary is not None:
        area = shapely.Polygon(scene.boundary)
        shapely.prepare(area)
        inside = shapely.contains_properly(area, bodies)
        shapes.append(area.exterior)
    (which, _), apart = shapely.STRtree(shapes).query_nearest(bodies, all_matches=False, return_distance=True)
    distances = np.empty(len(bodies))
    distances[which] = apart
    return np.where(inside, distances, -1.0 - distances)


def _drawn(random: np.random.Generator, name: str, kind: str) -> Scene | None:
    """One draw of a scene, None where it has no drive that is clear."""
    vehicle, steering, speed = list(VEHICLES.values())[int(random.integers(len(VEHICLES)))]
    limits = Limits(
        speed=speed,
        acceleration=round(random.uniform(1.0, 5.0), 2),
        steering=steering,
        steering_rate=round(random.uniform(0.5, 1.0), 2),
    )
    clearance = SLOT_CLEARANCE if kind == "slot" else CLEARANCE
    curvature = _largest_curvature(vehicle, steering)
    layout = KINDS[kind](Draw(random=random, vehicle=vehicle, curvature=curvature, clearance=clearance))
    if layout is None:
        return None
    frame, mirrored = _frame(random), random.uniform() < 0.5
    drive = layout.drive.mirrored() if mirrored else layout.drive
    begin = frame.compose(drive.begin)
    witness = Drive.at(Pose2(begin.x, begin.y, wrap(begin.phi)), drive.pieces)
    goal = witness.path.end
    scene = Scene(
        name=name,
        kind=kind,
        start=witness.begin,
        goal=Pose2(goal.x, goal.y, wrap(goal.phi)),
        boundary=None if layout.boundary is None else _in_world(layout.boundary, frame, mirrored),
        obstacles=tuple(_in_world(corners, frame, mirrored) for corners in layout.obstacles),
        vehicle=vehicle,
        limits=limits,
        comfort_acceleration=round(random.uniform(0.4, 1.0), 2),
        witness=witness,
    )
    return scene if proven(scene) >= clearance else None


def _largest_curvature(vehicle: Vehicle, steering: float) -> float:
    """Of a witness [1/m], by the largest steering [rad]."""
    return CURVATURE_SHARE * tan(steering) / vehicle.wheelbase


def _frame(random: np.random.Generator) -> Pose2:
    """Where in the world a scene is, and how it is turned."""
    reach = _NEAR if random.uniform() < 0.9 else _FAR
    x, y = random.uniform(-reach, reach, 2).tolist()
    return Pose2(x, y, float(random.uniform(-pi, pi)))


def _in_world(corners: Array, frame: Pose2, mirrored: bool) -> Array:
    """Corners (m, 2) of a layout, mirrored at its x axis or not, in the world: counter-clockwise."""
    there = outline_at(corners * np.array([1.0, -1.0 if mirrored else 1.0]), frame)
    moved: Array = np.ascontiguousarray(there if shapely.LinearRing(there).is_ccw else there[::-1])
    moved.flags.writeable = False
    return moved


def scenario_of(scene: Scene) -> Scenario:
    """The scenario of a scene: start, area and goal; nothing of its witness."""
    area: dict[str, Any] = {"obstacles": [each.tolist() for each in scene.obstacles]}
    if scene.boundary is not None:
        area["boundary"] = scene.boundary.tolist()
    return scenario_from_dict(
        {
            "name": scene.name,
            "description": _described(scene),
            "start": {"pose": row(scene.start)},
            "area": area,
            "goal": {"pose": row(scene.goal)},
            "vehicle": scene.vehicle.model_dump(exclude={"outline"}),
            "limits": scene.limits.model_dump(),
            "controller": {"comfort_acceleration": scene.comfort_acceleration},
            "simulation": {"cycle": 0.05, "dead_time": DEAD_TIME, "duration": DURATION},
        }
    )


def kind_of(scenario: Scenario) -> str:
    """Of the scene that a scenario was made from."""
    return scenario.name.partition("_")[0]


def row(pose: Pose2) -> list[float]:
    """As a scenario file has it."""
    return [pose.x, pose.y, pose.phi]


def _described(scene: Scene) -> str:
    vehicle: Vehicle = scene.vehicle
    apart = hypot(scene.goal.x - scene.start.x, scene.goal.y - scene.start.y)
    around = "within a boundary" if scene.boundary is not None else "without a boundary"
    return (
        f"{scene.kind}, {apart:.1f} m from start to goal, {len(scene.obstacles)} obstacles, {around}, "
        f"a body of {vehicle.front + vehicle.rear:.2f} m"
    )
