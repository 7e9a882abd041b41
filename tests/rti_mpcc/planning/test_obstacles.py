"""Which obstacles are seen to move, and how fast: known positions, noise, gaps, other orders."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pytest

from geometry import Corridor, CorridorError, Pose2, ReferencePath
from rti_mpcc.config import ControllerConfig
from rti_mpcc.planning.obstacles import (
    CLEAR_TIME,
    JUMP,
    MOVED,
    OBSERVATION,
    Obstacle,
    changed,
    first_seen,
    observed,
)
from rti_mpcc.planning.surroundings import Surroundings
from rti_mpcc.planning.validation import surroundings_in
from rti_mpcc.types import Array
from tests.rti_mpcc.encounters import square

CYCLE = 0.05
CONFIG = ControllerConfig()
CAUTION = CONFIG.caution


def watched(places: Callable[[float], Sequence[Array]], seconds: float) -> tuple[Obstacle, ...]:
    """What is known after so long of being told the outlines in every cycle."""
    known: tuple[Obstacle, ...] = ()
    for k in range(round(seconds / CYCLE) + 1):
        known = observed(known, places(k * CYCLE), k * CYCLE, (k - 1) * CYCLE)
    return known


@pytest.mark.parametrize("speed", [0.3, 1.0, 3.0])
def test_the_velocity_is_what_the_middle_does(speed: float) -> None:
    (found,) = watched(lambda t: [square(1.0 + 0.6 * speed * t, 2.0 - 0.8 * speed * t, 0.5)], 1.0)
    assert found.moves
    assert found.velocity == pytest.approx([0.6 * speed, -0.8 * speed], abs=1e-9)
    assert found.speed == pytest.approx(speed)


def test_who_begins_to_walk_is_seen_to_within_the_time_that_his_first_steps_take() -> None:
    begun = 1.0
    for after in (0.05, 0.1, 0.2):
        (found,) = watched(lambda t: [square(0.8 * max(t - begun, 0.0), 0.0, 0.6)], begun + after)
        assert found.moves == (0.8 * after > MOVED)


def test_who_stops_stands_after_the_clear_time() -> None:
    def place(t: float) -> list[Array]:
        return [square(min(t, 1.0), 0.0, 0.6)]

    (soon,) = watched(place, 1.0 + OBSERVATION + 0.8 * CLEAR_TIME)
    assert soon.moves
    assert soon.speed < 0.2
    (later,) = watched(place, 1.0 + OBSERVATION + 1.2 * CLEAR_TIME)
    assert not later.moves
    assert later.speed == 0.0


def test_noise_of_a_centimetre_is_no_motion() -> None:
    rng = np.random.default_rng(3)
    (found,) = watched(lambda t: [square(5.0, 1.0, 0.6) + rng.normal(0.0, 0.01, 2)], 10.0)
    assert not found.moves


def test_they_are_told_apart_in_whatever_order_they_come() -> None:
    rng = np.random.default_rng(5)

    def places(t: float) -> list[Array]:
        outlines = [square(t, 0.0, 0.5), square(0.0, 8.0 - 2.0 * t, 0.5), square(9.0, 9.0, 0.5)]
        return [outlines[k] for k in rng.permutation(3)]

    found = sorted(watched(places, 1.0), key=lambda each: each.speed)
    assert [each.moves for each in found] == [False, True, True]
    assert found[1].velocity == pytest.approx([1.0, 0.0])
    assert found[2].velocity == pytest.approx([0.0, -2.0])
    assert sorted(each.index for each in found) == [0, 1, 2]


def test_what_appears_elsewhere_is_another_one() -> None:
    (found,) = watched(lambda t: [square(0.0 if t < 0.5 else 50.0, 0.0, 0.5)], 0.6)
    assert not found.moves
    assert JUMP < 50.0


def test_what_is_told_now_and_then_only_keeps_its_speed() -> None:
    known: tuple[Obstacle, ...] = ()
    for k in range(10):
        known = observed(known, [square(0.25 * k, 0.0, 0.5)], 0.25 * k, 0.25 * (k - 1))
    assert known[0].velocity == pytest.approx([1.0, 0.0])


def test_nothing_new_is_the_same_again() -> None:
    outlines = [square(0.0, 0.0, 1.0), square(5.0, 0.0, 1.0)]
    known = watched(lambda t: outlines, 0.5)
    assert observed(known, outlines, 0.6, 0.5) is known


def test_what_is_no_obstacle_is_refused_by_its_index() -> None:
    with pytest.raises(CorridorError, match=r"obstacles\[1\]"):
        observed((), [square(0.0, 0.0, 1.0), np.zeros((0, 2))], 0.0, 0.0)


def test_plans_go_round_what_stands_and_know_of_what_moves() -> None:
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 30.0)])
    corridor = Corridor.from_offsets(path, left=5.0, right=-5.0)
    around, still = Surroundings.of(corridor, path, CONFIG), square(10.0, 3.0, 1.0)
    for k in range(10):
        around = around.updated([still, square(20.0, -4.0 + 0.1 * k, 0.6)], 0.05 * k)
    assert [each.index for each in around.moving] == [1]
    assert len(around.corridor.obstacles) == 1
    assert len(around.known.obstacles) == 2
    changes = around.changes
    again = around.updated([still, square(20.0, -2.9, 0.6)], 0.5)
    assert again.changes == changes
    assert again.corridor is around.corridor
    assert surroundings_in(around, None, 0.6) is around


def test_obstacles_have_changed_where_one_has_come_gone_or_moved() -> None:
    boxes = [first_seen(k, square(10.0 * k, 0.0, 1.0), 0.0) for k in range(3)]
    moved = [first_seen(0, square(0.2, 0.0, 1.0), 0.0), *boxes[1:]]
    assert not changed((), (), 0.1)
    assert not changed(boxes, boxes[::-1], 0.1)
    assert not changed(boxes, moved, 0.25)
    shrunk = [first_seen(0, square(0.0, 0.0, 0.5), 0.0), *boxes[1:]]
    assert not changed(boxes, [*shrunk, boxes[0]], 0.1)
    for others in ((), boxes[1:], [*boxes, first_seen(3, square(5.0, 5.0, 1.0), 0.0)], moved, shrunk):
        assert changed(boxes, others, 0.1)
        assert changed(others, boxes, 0.1)
