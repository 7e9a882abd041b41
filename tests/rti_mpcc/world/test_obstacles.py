"""Which obstacles are seen to move, and how fast: known positions, noise, gaps, other orders."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest

from benchmarks.encounters import square
from geometry import Corridor, Pose2, ReferencePath
from rti_mpcc import DockingController, InputError, Obstacle, VehicleState
from rti_mpcc.config import ControllerConfig
from rti_mpcc.types import Array
from rti_mpcc.world.obstacles import TrackedObstacle, observed, obstacles_changed
from tests.rti_mpcc.yards import block

CYCLE = 0.05
CONFIG = ControllerConfig()
AT_START = VehicleState(x=0.0, y=0.0, phi=0.0, v=0.0, delta=0.0)


def watched(
    places: Callable[[float], Sequence[Array | Obstacle]], seconds: float
) -> tuple[TrackedObstacle, ...]:
    """What is known after so long of being told the outlines in every cycle."""
    known: tuple[TrackedObstacle, ...] = ()
    for k in range(round(seconds / CYCLE) + 1):
        known = observed(known, places(k * CYCLE), k * CYCLE, (k - 1) * CYCLE)
    return known


@pytest.mark.parametrize("speed", [0.3, 1.0, 3.0])
def test_the_velocity_is_what_the_middle_does(speed: float) -> None:
    (found,) = watched(lambda t: [square(1.0 + 0.6 * speed * t, 2.0 - 0.8 * speed * t, 0.5)], 1.0)
    assert found.moves
    assert found.velocity == pytest.approx([0.6 * speed, -0.8 * speed], abs=1e-9)
    assert found.speed == pytest.approx(speed)


def test_one_that_was_moved_stands_again_although_it_trembles_in_a_slow_map() -> None:
    """It is given at 50 Hz and seen anew at 5 Hz."""
    noise = np.random.default_rng(3).normal(0.0, 0.03, (60, 2))
    known: tuple[TrackedObstacle, ...] = ()
    for k in range(500):
        place = square(5.0 if k < 100 else 5.3, 1.0, 0.6) + noise[k // 10]
        known = observed(known, [place], 0.02 * k, 0.02 * (k - 1))
        assert known[0].moves is (100 <= k < 165)


def test_the_velocity_is_that_between_the_readings_of_a_slow_map() -> None:
    """It walks at 1 m/s, seen anew at 5 Hz and given at 20 Hz."""
    for k in range(20, 40):
        (found,) = watched(lambda t: [square(0.2 * int(5.0 * t + 1e-6), 2.0, 0.5)], k * CYCLE)
        assert found.velocity == pytest.approx([1.0, 0.0])


def test_the_first_step_that_a_slow_map_shows_is_no_leap() -> None:
    """It walks at 1 m/s from the second 1 on, and is given every 0.3 s, in all cycles of 0.1 s."""
    known: tuple[TrackedObstacle, ...] = ()
    for k in range(20):
        there = max(0.3 * (k // 3) - 0.95, 0.0)
        others = [square(9.0, 9.0, 0.5)] if k % 2 else []
        known = observed(known, [square(there, 2.0, 0.5), *others], 0.1 * k, 0.1 * (k - 1))
        assert known[0].speed < 1.05


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


WIDER = square(5.0, 1.0, 0.6) + np.array([(0.0, 0.0), (0.1, 0.0), (0.1, 0.0), (0.0, 0.0)])


@pytest.mark.parametrize(("lasts", "counts"), [(0.2, False), (0.45, False), (0.55, True)])
def test_an_edge_that_shows_for_a_moment_elsewhere_does_not_count(lasts: float, counts: bool) -> None:
    def places(t: float) -> list[Array]:
        return [WIDER if 1.0 <= t < 1.0 + lasts else square(5.0, 1.0, 0.6)]

    for seconds in np.arange(0.9, 1.0 + lasts, CYCLE):
        (found,) = watched(places, seconds)
        assert not found.moves
    assert (found.checked.corners.tolist() == WIDER.tolist()) is counts


def test_an_edge_that_creeps_counts_as_soon_as_it_has_moved() -> None:
    """At 0.1 m/s: no motion, but 5 cm in half a second, and seen in each cycle."""

    def places(t: float) -> list[Array]:
        return [square(5.0, 1.0, 0.6) + np.array([(0.0, 0.0), (0.1 * t, 0.0), (0.1 * t, 0.0), (0.0, 0.0)])]

    for seconds in np.arange(0.1, 3.0, 0.1):
        (found,) = watched(places, seconds)
        assert places(seconds)[0][1, 0] - found.checked.corners[:, 0].max() < 0.06


@pytest.mark.parametrize("seed", [33, 84, 151, 228])
def test_edges_of_a_cell_that_flicker_do_not_move(seed: int) -> None:
    """At 5 Hz, by 10 cm; in these the first that are off are off alike."""
    rng = np.random.default_rng(seed)
    flicker = [0.1 * rng.integers(-1, 2, 4) * (rng.uniform(size=4) < 0.07) for _ in range(40)]

    def places(t: float) -> list[Array]:
        left, low, right, high = np.array([5.0, 1.0, 6.0, 2.0]) + flicker[int(5.0 * t + 1e-6)]
        return [np.array([(left, low), (right, low), (right, high), (left, high)])]

    known: tuple[TrackedObstacle, ...] = ()
    for k in range(160):
        known = observed(known, places(k * CYCLE), k * CYCLE, (k - 1) * CYCLE)
        assert not known[0].moves


@pytest.mark.parametrize(
    ("edges", "changed"),
    [
        ([(5.0, 5.9), (6.1, 7.0)], False),  # a slit where they touched
        ([(5.1, 6.1), (6.1, 7.1)], False),
        ([(5.3, 6.0), (6.0, 7.0)], True),
        ([(5.0, 6.0), (6.2, 7.0)], False),  # nowhere in the gap are 0.12 m free
        ([(5.0, 6.0), (6.3, 7.0)], True),
        ([(5.0, 6.0)], True),
        ([(6.0, 7.0), (5.0, 6.0)], False),  # in another order
    ],
)
def test_what_boxes_cover_has_changed_where_some_of_it_is_elsewhere(
    edges: list[tuple[float, float]], changed: bool
) -> None:
    def boxes(edges: list[tuple[float, float]]) -> tuple[TrackedObstacle, ...]:
        return observed((), [block(left, 0.0, right, 1.0) for left, right in edges], 0.0, -CYCLE)

    before, now = boxes([(5.0, 6.0), (6.0, 7.0)]), boxes(edges)
    assert obstacles_changed(before, now, 0.12) is changed
    assert obstacles_changed(now, before, 0.12) is changed


# -- obstacles given to a controller again -------------------------------------------------------------------


def test_an_outline_that_is_changed_in_place_is_another_one() -> None:
    bend = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 10.0), (1, 0.1, 10.0)])
    controller = DockingController(bend, Corridor.from_offsets(bend, left=5.0, right=-5.0), CONFIG)
    outlines = [square(30.0, 30.0, 0.6), square(40.0, 30.0, 0.6)]
    for now in (0.0, CYCLE):
        controller.step(AT_START, now=now, obstacles=outlines)
    before = controller.corridor
    controller.step(AT_START, now=2 * CYCLE, obstacles=[outline.tolist() for outline in outlines])
    assert controller.corridor is before  # the same ones, as lists
    outlines[1] += 20.0
    controller.step(AT_START, now=3 * CYCLE, obstacles=outlines)
    np.testing.assert_array_equal(controller.corridor.obstacles[1], outlines[1])
    controller.step(AT_START, now=4 * CYCLE, obstacles=outlines[:1])
    assert len(controller.corridor.obstacles) == 1


# -- obstacles that say how they move ------------------------------------------------------------------------


@pytest.mark.parametrize(("velocity", "turn_rate"), [((1.0, -0.5), 0.0), ((0.0, 0.0), 0.3)])
def test_what_says_how_it_moves_moves_from_the_first_cycle_on(
    velocity: tuple[float, float], turn_rate: float
) -> None:
    cart = Obstacle(square(5.0, 1.0, 0.6), velocity, turn_rate, "cart")
    (found,) = observed((), [cart], 0.0, -CYCLE)
    assert found.moves
    assert (found.velocity.tolist(), found.turn_rate, found.name) == (list(velocity), turn_rate, "cart")
    assert found.turning == pytest.approx(turn_rate * np.hypot(0.3, 0.3))


def test_what_says_that_it_stands_is_static_and_keeps_its_outline_within_noise() -> None:
    rng = np.random.default_rng(3)
    first = square(5.0, 1.0, 0.6)
    known = observed((), [Obstacle(first, (0.0, 0.0))], 0.0, -CYCLE)
    for k in range(1, 40):
        noisy = Obstacle(first + rng.normal(0.0, 0.005, 2), (0.0, 0.0))
        known = observed(known, [noisy], k * CYCLE, (k - 1) * CYCLE)
        assert not known[0].moves
        assert known[0].checked.corners.tolist() == first.tolist()
    (found,) = observed(known, [Obstacle(square(5.3, 1.0, 0.6), (0.0, 0.0))], 2.0, 1.95)
    assert not found.moves
    assert found.checked.corners.tolist() == square(5.3, 1.0, 0.6).tolist()


def test_without_a_velocity_it_is_found_as_of_a_bare_polygon() -> None:
    (bare,) = watched(lambda t: [square(1.0 + t, 2.0, 0.5)], 1.0)
    (named,) = watched(lambda t: [Obstacle(square(1.0 + t, 2.0, 0.5), name="cart")], 1.0)
    assert named.velocity.tolist() == bare.velocity.tolist()
    assert named.name == "cart"


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"polygon": [(0.0, 0.0), (1.0, np.nan)]}, "Obstacle.polygon[1]"),
        ({"polygon": [0.0, 1.0]}, "Obstacle.polygon has shape (2,)"),
        ({"velocity": (np.nan, 0.0)}, "Obstacle.velocity"),
        ({"velocity": 1.0}, "Obstacle.velocity"),
        ({"velocity": (0.0, 200.0)}, "at most 100"),
        ({"turn_rate": np.inf}, "Obstacle.turn_rate"),
    ],
)
def test_a_wrong_obstacle_is_refused(given: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError) as caught:
        Obstacle(**{"polygon": square(0.0, 0.0, 1.0), **given})
    assert said in str(caught.value)
