"""Drawn scenes: every one proven, and none of them open ground."""

from __future__ import annotations

from dataclasses import replace
from math import tan

import numpy as np
import pytest
import shapely

from benchmarks.problems.scenes import KINDS, VEHICLES, Scene, drawn_scene, proven
from geometry import Pose2, wrap
from geometry.outline import checked_polygon
from rti_mpcc.errors import InputError
from rti_mpcc.model.footprint import body_polygons
from rti_mpcc.types import Array

SEEDS = (1, 2, 3, 4)
EACH = 8
"""Scenes of a kind."""


@pytest.fixture(scope="module", params=list(KINDS))
def drawn(request: pytest.FixtureRequest) -> list[Scene]:
    return [drawn_scene(SEEDS[i % len(SEEDS)], i, request.param) for i in range(EACH)]


def body(scene: Scene, pose: Pose2, *, ahead: float = 0.0, behind: float = 0.0) -> shapely.Polygon:
    """The body at a pose, longer at its ends by so much [m]."""
    vehicle = scene.vehicle
    x, half = np.array([-vehicle.rear - behind, vehicle.front + ahead]), 0.5 * vehicle.width
    corners = [(x[0], -half), (x[1], -half), (x[1], half), (x[0], half)]
    placed = [pose.compose(Pose2(*corner, 0.0)) for corner in corners]
    return shapely.Polygon([(corner.x, corner.y) for corner in placed])


def things(scene: Scene) -> shapely.MultiPolygon:
    return shapely.union_all([shapely.Polygon(corners) for corners in scene.obstacles])


def integrated(scene: Scene) -> Array:
    """Poses (n, 3) of a witness, by the midpoint rule and nothing else, 1 cm apart."""
    poses = [(scene.start.x, scene.start.y, scene.start.phi)]
    for direction, curvature, length in scene.witness.pieces:
        count = int(np.ceil(length / 0.01))
        step = direction * length / count
        for _ in range(count):
            x, y, phi = poses[-1]
            middle = phi + 0.5 * curvature * step
            poses.append((x + step * np.cos(middle), y + step * np.sin(middle), phi + curvature * step))
    return np.array(poses)


def check(scene: Scene) -> None:
    """All that holds for every scene."""
    assert proven(scene) >= scene.clearance
    assert scene.clearance == (0.1 if scene.kind == "slot" else 0.15)
    largest = 0.9 * tan(scene.limits.steering) / scene.vehicle.wheelbase
    for direction, curvature, length in scene.witness.pieces:
        assert direction in (-1, 1)
        assert abs(curvature) <= largest * (1.0 + 1e-12)
        assert length > 0.0
    assert scene.witness.begin == scene.start
    missed = scene.witness.end.relative_to(scene.goal)
    assert missed.within((1e-6, 1e-6, 1e-9))
    assert scene.comfort_acceleration <= scene.limits.acceleration
    for corners in (*scene.obstacles, *(() if scene.boundary is None else (scene.boundary,))):
        shape = checked_polygon(corners, scene.name)
        assert shape.exterior.is_ccw
        assert not corners.flags.writeable


def test_all_are_proven(drawn: list[Scene]) -> None:
    for scene in drawn:
        check(scene)


def test_what_is_proven_holds_for_a_drive_that_is_integrated(drawn: list[Scene]) -> None:
    for scene in drawn[:3]:
        poses, standing = integrated(scene), things(scene)
        bodies = shapely.polygons(body_polygons(poses, scene.vehicle))
        least = shapely.distance(bodies, standing).min() if scene.obstacles else np.inf
        if scene.boundary is not None:
            area = shapely.Polygon(scene.boundary)
            assert shapely.contains(area, bodies).all()
            least = min(least, shapely.distance(bodies, area.exterior).min())
        assert proven(scene) - 1e-6 <= least <= proven(scene) + 0.02
        assert poses[-1, :2] == pytest.approx([scene.goal.x, scene.goal.y], abs=1e-3)
        assert wrap(poses[-1, 2] - scene.goal.phi) == pytest.approx(0.0, abs=1e-6)


def test_start_and_goal_are_free_and_apart(drawn: list[Scene]) -> None:
    for scene in drawn:
        for pose in (scene.start, scene.goal):
            room = shapely.buffer(body(scene, pose), 0.99 * scene.clearance)
            assert not things(scene).intersects(room)
            if scene.boundary is not None:
                assert shapely.Polygon(scene.boundary).contains(body(scene, pose))
        offset = scene.start.relative_to(scene.goal)
        assert max(abs(offset.x), abs(offset.y), abs(offset.phi)) > 0.5 * scene.vehicle.front


def test_the_same_number_draws_the_same_scene(drawn: list[Scene]) -> None:
    first = drawn[0]
    again = drawn_scene(SEEDS[0], 0, first.kind)
    assert (first.name, first.start, first.witness) == (again.name, again.start, again.witness)
    assert all(map(np.array_equal, first.obstacles, again.obstacles))
    assert first.name == f"{first.kind}_{SEEDS[0]}_0"
    assert len({scene.witness.pieces for scene in drawn}) == EACH


def test_kinds_take_turns_and_vehicles_are_drawn() -> None:
    found = [drawn_scene(6, number) for number in range(20)]
    assert [scene.kind for scene in found] == list(KINDS) * 4
    assert {scene.vehicle.wheelbase for scene in found} == {
        vehicle.wheelbase for vehicle, _, _ in VEHICLES.values()
    }
    assert {scene.limits.speed for scene in found} == {1.5, 2.5}
    for scene in found:
        assert 1.0 <= scene.limits.acceleration <= 5.0
        assert 0.5 <= scene.limits.steering_rate <= 1.0
        assert 0.4 <= scene.comfort_acceleration <= 1.0


def test_proofs_see_what_is_put_in_the_way() -> None:
    scene = drawn_scene(7, 0, "clutter")
    before = proven(scene)
    middle = scene.witness.poses(0.1)[len(scene.witness.pieces) * 3]
    post = middle[:2] + np.array([(0.0, 0.0), (0.1, 0.0), (0.0, 0.1)])
    assert proven(replace(scene, obstacles=(*scene.obstacles, post))) <= 0.0 < before
    corners = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
    start = np.array([scene.start.x, scene.start.y])
    assert proven(replace(scene, boundary=start + 3.0 * corners)) < 0.0
    assert proven(replace(scene, boundary=start + 300.0 * corners)) == before
    aside = scene.goal.compose(Pose2(0.0, 1e-3, 0.0))
    assert proven(replace(scene, goal=aside)) == -np.inf
    assert proven(replace(scene, start=aside)) == -np.inf


@pytest.mark.parametrize(
    ("seed", "number", "kind", "message"),
    [
        (-1, 0, None, "seed = -1: must be >= 0"),
        (0, -1, None, "number = -1: must be >= 0"),
        (0, 0, "garage", "kind = 'garage': must be one of bay, slot, yard, clutter, aisle"),
    ],
)
def test_what_makes_no_sense_is_refused(seed: int, number: int, kind: str | None, message: str) -> None:
    with pytest.raises(InputError) as error:
        drawn_scene(seed, number, kind)
    assert message in str(error.value)


@pytest.mark.acceptance
@pytest.mark.parametrize("seed", range(100, 110))
def test_five_hundred_are_proven(seed: int) -> None:
    for number in range(50):
        check(drawn_scene(seed, number))
