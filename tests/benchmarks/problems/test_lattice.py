"""Short steps and the trees of them: what they obey by differences, and what a tree keeps."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.problems.lattice import LEVELS, STEP, Tree, beside, steps
from benchmarks.problems.passages import Room
from geometry import Pose2, ReferencePath
from rti_mpcc.types import Array
from tests.benchmarks.problems.witnesses import LARGEST, course


def room(direction: int = 1, slope: float = 1.0) -> Room:
    scenario = course(direction=direction)
    path = scenario.build_path()
    return Room(
        vehicle=scenario.build_vehicle(),
        corridor=scenario.build_corridor(path),
        index=0,
        part=path.parts[0],
        curvature=LARGEST,
        slope=slope,
    )


def nearest_first(cost: Array, where: Array) -> Array:
    return np.asarray(cost - where[:, 0])


@pytest.mark.parametrize("direction", [1, -1])
def test_steps_are_driven_without_slip_and_bend_evenly(direction: int) -> None:
    begins = np.array([[1.0, 2.0, 3.0, 0.0], [0.0, 0.0, -1.0, -LARGEST], [0.0, 0.0, 1.0, 0.3 * LARGEST]])
    motions, begin = steps(begins, direction, room())
    motion = np.concatenate((begins[begin][:, None], motions), axis=1)
    step = np.diff(motion[..., :2], axis=1)
    middle = 0.5 * (motion[:, 1:] + motion[:, :-1])
    way = step[..., 0] * np.cos(middle[..., 2]) + step[..., 1] * np.sin(middle[..., 2])
    aside = step[..., 1] * np.cos(middle[..., 2]) - step[..., 0] * np.sin(middle[..., 2])
    assert direction * way == pytest.approx(STEP / 5, rel=1e-4)
    assert np.abs(aside).max() < 1e-4
    assert np.diff(motion[..., 2], axis=1) / (direction * STEP / 5) == pytest.approx(middle[..., 3])
    assert np.abs(np.diff(motion[..., 3], n=2, axis=1)).max() < 1e-9


def test_steps_end_at_the_levels_that_the_slope_allows() -> None:
    begins = np.array([[0.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, LARGEST]])
    motions, begin = steps(begins, 1, room(slope=0.25))
    assert begin.tolist() == [0, 0, 0, 1, 1]
    assert motions[:, -1, 3] / LARGEST == pytest.approx([-0.5, 0.0, 0.5, 0.5, 1.0])
    assert len(steps(begins, 1, room(slope=1.0))[1]) == 2 * LEVELS.size


@pytest.mark.parametrize("direction", [1, -1])
def test_places_beside_a_route_are_those_that_were_chosen(direction: int) -> None:
    start = Pose2(3.0, -2.0, 2.8)
    part = ReferencePath.from_segments(start, [(direction, 0.1, 10.0), (direction, -0.15, 10.0)]).parts[0]
    theta, lateral, turned = (
        np.array([2.0, 8.0, 15.0]),
        np.array([0.5, -1.0, 1.5]),
        np.array([0.3, 0.0, -0.4]),
    )
    way = part.reference(theta)
    left = direction * lateral
    poses = np.column_stack(
        [way.x - left * np.sin(way.phi), way.y + left * np.cos(way.phi), way.phi + turned + 2.0 * np.pi]
    )
    found = beside(poses, theta + np.array([0.5, -0.5, 0.3]), part)
    assert found == pytest.approx(np.column_stack([theta, lateral, turned]), abs=1e-3)


@pytest.mark.parametrize("sense", [1, -1])
def test_a_tree_keeps_one_node_a_cell_where_the_body_is_free(sense: int) -> None:
    there = room()
    root = np.array([[10.0, 0.0, 0.0, 0.0]])
    tree = Tree(root, np.array([10.0]), room=there, sense=sense, rank=nearest_first)
    for _ in range(8):
        new = tree.grow(40)
        assert (tree.parent[new] < new.min(initial=len(tree))).all()
    assert len(tree) > 300
    assert there.free(tree.poses).all()
    assert (sense * (tree.poses[1:, 0] - 10.0) > 0.0).all()
    # Cells are counted from beside the route and not from its middle.
    place = np.column_stack([tree.beside, tree.poses[:, 3] / LARGEST])
    cells = (place + np.array([10.0, 6.0, 1.3, 1.0])) / [0.5, 0.15, 0.07, 0.25]
    assert len(np.unique(np.rint(cells), axis=0)) == len(tree)


def test_a_branch_leads_from_its_root_to_its_node() -> None:
    there = room(direction=-1)
    roots = np.array([[0.0, 0.0, 0.0, 0.0], [-1.0, 0.5, 0.1, 0.1]])
    tree = Tree(roots, np.array([0.0, 1.0]), room=there, sense=1, rank=nearest_first)
    for _ in range(5):
        tree.grow(20)
    for node in (1, 2, len(tree) - 1):
        root, branch = tree.branch(node)
        assert root in (0, 1)
        if node > 1:
            assert branch[-1] == pytest.approx(tree.poses[node])
        motion = np.concatenate((tree.poses[[root]], branch))
        way = np.hypot(*np.diff(motion[:, :2], axis=0).T)
        assert way == pytest.approx(STEP / 5, rel=1e-3)
        assert there.free(branch).all()


def test_a_tree_without_room_ends() -> None:
    tree = Tree(np.array([[10.0, 2.8, 0.5, 0.0]]), np.array([10.0]), room=room(), sense=1, rank=nearest_first)
    while not tree.exhausted:
        tree.grow(100)
    assert len(tree) < 50
    assert tree.grow(100).size == 0
