"""Which obstacles are seen to move, and how fast: known positions, noise, gaps, other orders."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pytest

from rti_mpcc.config import ControllerConfig
from rti_mpcc.planning.surroundings import Obstacle, observed
from rti_mpcc.types import Array
from tests.rti_mpcc.encounters import square

CYCLE = 0.05
CONFIG = ControllerConfig()


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
