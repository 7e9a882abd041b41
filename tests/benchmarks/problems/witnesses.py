"""Witnesses looked at from their poses alone: all that benchmarks.problems.dockable promises."""

from __future__ import annotations

from math import tan
from typing import Any

import numpy as np
import pytest
import shapely

from benchmarks.problems.dockable import Witness, find_witness
from benchmarks.problems.passages import CLEARANCE, CURVATURE_SHARE, CURVATURE_SLOPE, SPACING
from benchmarks.problems.reaching import BACK, SLOPE
from geometry import Pose2
from rti_mpcc.simulation import Scenario, changed
from rti_mpcc.types import Array
from tests.rti_mpcc.docking_runs import straight

LARGEST = CURVATURE_SHARE * tan(0.6) / 2.875
ROUNDING = 1e-6


def course(changes: dict[str, Any] | None = None, *, direction: int = 1, length: float = 20.0) -> Scenario:
    """Straight along x, 4 m to both sides, a goal 2 m to the left of its end."""
    beside = {"corridor.left": 4.0, "corridor.right": -4.0, "goal.offset": [0.0, 2.0, 0.0]}
    return changed(straight(direction, length), beside | (changes or {}))


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


def check(scenario: Scenario) -> Witness:
    """All that a witness promises, from its poses alone."""
    witness, path = proven(scenario), scenario.build_path()
    first, last = Pose2(*witness.poses[0]), Pose2(*witness.poses[-1])
    for pose, wanted in ((first, path.start), (last, scenario.goal_pose())):
        error = pose.relative_to(wanted)
        assert max(abs(error.x), abs(error.y), abs(error.phi)) < ROUNDING
    assert sorted(set(witness.part.tolist())) == list(range(len(path.parts)))
    corridor = scenario.build_corridor(path)
    for index in range(len(path.parts)):
        lines = [line for side in corridor.lines(index) for line in side]
        things = shapely.unary_union(
            [*map(shapely.LineString, lines), *map(shapely.Polygon, corridor.obstacles)]
        )
        bodies = outlines(witness.poses[witness.part == index])
        assert shapely.distance(bodies, things).min() >= CLEARANCE - ROUNDING
    for part, cusp in zip(path.parts, np.flatnonzero(np.diff(witness.part)), strict=False):
        error = Pose2(*witness.poses[cusp]).relative_to(part.last)
        assert np.abs([error.x, error.y, error.phi]).max() <= 0.1
    _check_pieces(witness, [part.direction for part in path.parts])
    return witness


def _check_pieces(witness: Witness, directions: list[int]) -> None:
    """Each part in its direction, but for backing up into the goal; poses go on from one to the next."""
    turns = np.flatnonzero((np.diff(witness.part) != 0) | (np.diff(witness.direction) != 0))
    pieces = np.split(np.arange(len(witness.poses)), turns + 1)
    slope = SLOPE if witness.searched else CURVATURE_SLOPE
    for rows in pieces:
        _check_driving(witness.poses[rows], witness.curvature[rows], witness.direction[rows[0]], slope)
    driven = [int(witness.direction[rows[0]]) for rows in pieces]
    assert driven[: len(directions)] == directions
    if len(pieces) > len(directions):
        assert witness.searched
        assert driven[len(directions) :] == [-directions[-1]]
        back = np.diff(witness.poses[pieces[-1], :2], axis=0)
        assert np.hypot(back[:, 0], back[:, 1]).sum() <= BACK + ROUNDING
    for turn in turns:
        assert witness.poses[turn + 1] == pytest.approx(witness.poses[turn])
    if not witness.searched:
        assert witness.curvature[0] == 0.0
        assert witness.curvature[turns + 1] == pytest.approx(witness.curvature[turns])


def _check_driving(poses: Array, curvature: Array, direction: int, slope: float) -> None:
    """One direction, no slip, curvature and its slope within (1)."""
    step = np.diff(poses, axis=0)
    way = np.hypot(step[:, 0], step[:, 1])
    heading = poses[:-1, 2] + 0.5 * step[:, 2]
    ahead = direction * (step[:, 0] * np.cos(heading) + step[:, 1] * np.sin(heading))
    aside = step[:, 1] * np.cos(heading) - step[:, 0] * np.sin(heading)
    assert way.max() <= SPACING + ROUNDING
    assert (ahead > 0.0).all()
    assert np.abs(aside).max() < 1e-4
    # Along the arc and not along its chord.
    bent = direction * step[:, 2] / way * np.sinc(0.5 * step[:, 2] / np.pi)
    assert np.abs(bent).max() <= LARGEST + ROUNDING
    assert np.abs(bent - 0.5 * (curvature[1:] + curvature[:-1])).max() < 1e-3 * slope
    between = 0.5 * (way[1:] + way[:-1])
    assert np.abs(np.diff(bent) / between).max() <= slope + 4e-3 * slope
