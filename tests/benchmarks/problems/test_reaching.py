"""The search: it gives way, backs up where it has to, is the same every time, and refuses what has no way."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.problems.courses import CAMPAIGN, drawn_course
from rti_mpcc.simulation import Scenario
from tests.benchmarks.problems.witnesses import check, course

LEFT, RIGHT = (-0.5, 3.9), (-3.9, 0.5)


def between(*boxes: tuple[float, tuple[float, float]], direction: int = 1) -> Scenario:
    """35 m straight on, with things of 1 m so far along it that reach from y to y."""
    outlines = [
        [
            [direction * x, low],
            [direction * (x + 1.0), low],
            [direction * (x + 1.0), high],
            [direction * x, high],
        ]
        for x, (low, high) in boxes
    ]
    changes = {"corridor.obstacles": outlines, "goal.offset": [0.0, 0.0, 0.0]}
    return course(changes, direction=direction, length=35.0)


@pytest.mark.parametrize("direction", [1, -1])
def test_it_swings_round_one_thing_and_the_next(direction: int) -> None:
    witness = check(between((10.0, LEFT), (19.0, RIGHT), direction=direction))
    assert witness.searched
    assert (witness.direction == direction).all()
    beside = np.interp([10.5, 19.5], direction * witness.poses[:, 0], witness.poses[:, 1])
    assert beside[0] < -1.0
    assert beside[1] > 1.0


@pytest.mark.acceptance
def test_into_a_goal_with_too_little_way_before_it_it_backs_up() -> None:
    witness = check(course({"goal.offset": [-2.0, 1.5, 0.0]}, length=6.0))
    assert witness.searched
    assert witness.direction[-1] == -1


@pytest.mark.acceptance
@pytest.mark.parametrize("index", [14, 38])
def test_motions_of_drawn_courses_are_feasible(index: int) -> None:
    assert check(drawn_course(1, index, CAMPAIGN)).searched
