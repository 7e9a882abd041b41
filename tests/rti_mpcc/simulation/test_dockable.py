"""The proof: what it finds is feasible by an independent look, and what cannot be docked in is refused."""

from __future__ import annotations

from math import tan
from typing import Any

import numpy as np
import pytest
import shapely

from geometry import Pose2
from rti_mpcc.simulation import (
    CAMPAIGN,
    Scenario,
    Witness,
    changed,
    dockable,
    drawn_course,
    find_witness,
    load_scenario,
    scenario_from_dict,
)
from rti_mpcc.simulation.passages import CLEARANCE, CURVATURE_SHARE, CURVATURE_SLOPE, SPACING
from rti_mpcc.types import Array

LARGEST = CURVATURE_SHARE * tan(0.6) / 2.875
ROUNDING = 1e-6


def course(changes: dict[str, Any] | None = None, *, direction: int = 1, length: float = 20.0) -> Scenario:
    """Straight along x, 4 m to both sides, a goal 2 m to the left of its end."""
    tables = {
        "name": "straight",
        "path": {
            "start": [0.0, 0.0, 0.0],
            "segments": [{"direction": direction, "curvature": 0.0, "length": length}],
        },
        "corridor": {"left": 4.0, "right": -4.0},
        "goal": {"offset": [0.0, 2.0, 0.0]},
    }
    return changed(scenario_from_dict(tables), changes or {})


def proven(scenario: Scenario) -> Witness:
    witness = find_witness(scenario)
    assert witness is not None
    return witness


def outlines(poses: Array) -> list[shapely.Polygon]:
    """Of the default body, by hand."""
    body = shapely.box(-0.8027, -1.0345, 3.6775, 1.0345)
    turn = np.stack([np.cos(poses[:, 2]), np.sin(poses[:, 2])], axis=1)
    return [
        shapely.affinity.affine_transform(body, [c, -s, s, c, x, y])
        for (c, s), (x, y) in zip(turn, poses[:, :2], strict=True)
    ]


def check(scenario: Scenario) -> None:
    """All that a witness promises, from its poses alone."""
    witness, path = proven(scenario), scenario.build_path()
    first, last = Pose2(*witness.poses[0]), Pose2(*witness.poses[-1])
    for pose, wanted in ((first, path.start), (last, scenario.goal_pose(path))):
        error = pose.relative_to(wanted)
        assert max(abs(error.x), abs(error.y), abs(error.phi)) < ROUNDING
    assert witness.curvature[0] == 0.0
    assert sorted(set(witness.part.tolist())) == list(range(len(path.parts)))
    corridor = scenario.build_corridor(path)
    for index, part in enumerate(path.parts):
        rows = np.flatnonzero(witness.part == index)
        _check_driving(witness.poses[rows], witness.curvature[rows], part.direction)
        lines = [line for side in corridor.lines(index) for line in side]
        things = shapely.unary_union(
            [*map(shapely.LineString, lines), *map(shapely.Polygon, corridor.obstacles)]
        )
        assert shapely.distance(outlines(witness.poses[rows]), things).min() >= CLEARANCE - ROUNDING
    for part, cusp in zip(path.parts, np.flatnonzero(np.diff(witness.part)), strict=False):
        error = Pose2(*witness.poses[cusp]).relative_to(part.last)
        assert np.abs([error.x, error.y, error.phi]).max() <= 0.1
        assert witness.poses[cusp + 1] == pytest.approx(witness.poses[cusp])
        assert witness.curvature[cusp + 1] == pytest.approx(witness.curvature[cusp])


def _check_driving(poses: Array, curvature: Array, direction: int) -> None:
    """One direction, no slip, curvature and its slope within (1)."""
    step = np.diff(poses, axis=0)
    way = np.hypot(step[:, 0], step[:, 1])
    heading = poses[:-1, 2] + 0.5 * step[:, 2]
    ahead = direction * (step[:, 0] * np.cos(heading) + step[:, 1] * np.sin(heading))
    aside = step[:, 1] * np.cos(heading) - step[:, 0] * np.sin(heading)
    assert way.max() <= SPACING + ROUNDING
    assert (ahead > 0.0).all()
    assert np.abs(aside).max() < 1e-4
    bent = direction * step[:, 2] / way
    assert np.abs(bent).max() <= LARGEST + ROUNDING
    assert np.abs(bent - 0.5 * (curvature[1:] + curvature[:-1])).max() < 2e-4
    between = 0.5 * (way[1:] + way[:-1])
    assert np.abs(np.diff(bent) / between).max() <= CURVATURE_SLOPE + 1e-3


@pytest.mark.parametrize("index", range(4))
def test_witnesses_of_courses_are_feasible(index: int) -> None:
    check(drawn_course(1, index))


@pytest.mark.parametrize("index", range(8))
def test_witnesses_of_wider_courses_are_feasible(index: int) -> None:
    check(drawn_course(1, index, CAMPAIGN))


@pytest.mark.parametrize("name", ["docking_inside", "long_approach", "path_following"])
def test_witnesses_of_built_in_scenarios_are_feasible(name: str) -> None:
    check(load_scenario(name))


@pytest.mark.parametrize("direction", [1, -1])
def test_a_goal_beside_a_long_way_is_reached_and_beside_a_short_one_not(direction: int) -> None:
    check(course(direction=direction))
    assert find_witness(course(direction=direction, length=1.0)) is None


def narrow(until: float) -> Scenario:
    """A wall to the left up to so far along the 20 m."""
    wall = {"from": 0.0, "to": until, "left": 1.3}
    return course({"corridor.narrowings": [wall]})


def test_a_wall_up_to_shortly_before_the_goal_leaves_no_way() -> None:
    check(narrow(6.0))
    assert find_witness(narrow(19.0)) is None


def test_a_goal_without_room_for_the_body_is_refused() -> None:
    assert find_witness(course({"corridor.left": 3.1})) is None
    check(course({"corridor.left": 3.2}))


def test_something_across_the_way_is_refused() -> None:
    beside = [[9.0, -2.0], [10.0, -2.0], [10.0, -3.0], [9.0, -3.0]]
    across = [[9.0, -2.5], [10.0, -2.5], [10.0, 2.5], [9.0, 2.5]]
    check(course({"corridor.obstacles": [beside]}))
    assert find_witness(course({"corridor.obstacles": [across]})) is None


def test_a_goal_turned_too_far_is_refused() -> None:
    assert find_witness(course({"goal.offset": [0.0, 0.0, 1.2]}, length=5.0)) is None


def test_a_bend_that_the_vehicle_cannot_steer_is_refused() -> None:
    def bend(curvature: float) -> Scenario:
        segments = [{"direction": 1, "curvature": curvature, "length": 0.6 * np.pi / curvature}]
        return course({"path.segments": segments, "goal.offset": [0.0, 0.0, 0.0]})

    check(bend(0.15))
    assert find_witness(changed(bend(0.4), {"corridor.left": 1.4, "corridor.right": -1.4})) is None


def test_a_first_part_without_room_is_refused() -> None:
    segments = [
        {"direction": 1, "curvature": 0.0, "length": 10.0},
        {"direction": -1, "curvature": 0.0, "length": 15.0},
    ]
    there_and_back = course({"path.segments": segments})
    check(there_and_back)
    gate = {"from": 4.0, "to": 6.0, "left": 1.05, "right": -1.05}
    assert find_witness(changed(there_and_back, {"corridor.narrowings": [gate]})) is None


def test_a_cusp_right_behind_a_bend_that_the_vehicle_cannot_steer_is_refused() -> None:
    def cusp(curvature: float) -> Scenario:
        segments = [
            {"direction": 1, "curvature": curvature, "length": 5.0},
            {"direction": -1, "curvature": 0.0, "length": 20.0},
        ]
        return course({"path.segments": segments, "goal.offset": [0.0, 0.0, 0.0]})

    check(cusp(0.1))
    assert find_witness(cusp(0.3)) is None


def test_a_swing_round_an_obstacle_takes_two_curves(monkeypatch: pytest.MonkeyPatch) -> None:
    def standing_in(left: float) -> Scenario:
        box = [[12.0, left], [13.0, left], [13.0, 3.5], [12.0, 3.5]]
        return course({"corridor.obstacles": [box], "goal.offset": [5.0, 1.0, 0.0]}, length=25.0)

    check(standing_in(-0.2))
    assert find_witness(standing_in(-2.0)) is None
    monkeypatch.setattr(dockable, "_TRIED", 0)
    assert find_witness(standing_in(-0.2)) is None
