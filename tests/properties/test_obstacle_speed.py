"""The speed of an obstacle divides by the time between two sights of it; contacts divide by a step's way."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from rti_mpcc.config import Caution, ControllerConfig
from rti_mpcc.planning.obstacles import observed
from rti_mpcc.types import Array
from tests.properties.magnitudes import examples, few_examples, from_zero, positive, signed

CONFIG = ControllerConfig(caution=Caution(check_spacing=0.01))


def box(x: float, y: float = 0.0) -> Array:
    """A square of a metre, its near side at `x` [m]."""
    return np.array([[x, y - 0.5], [x + 1.0, y - 0.5], [x + 1.0, y + 0.5], [x, y + 0.5]])


@given(st.lists(st.tuples(positive(1e-9, 2.0), signed(1e-6, 5.0)), min_size=1, max_size=8))
@example([(1e-9, 0.19)])
@example([(5e-3, 0.19)])
@example([(1e-9, 0.0)])
@examples
def test_no_obstacle_is_taken_to_move_faster_than_one_can(sights: list[tuple[float, float]]) -> None:
    """However soon it was seen again: what seems faster is noise, or another obstacle."""
    now = place = 0.0
    known = observed((), [box(place)], now, now, CONFIG)
    for seconds, moved in sights:
        last, now, place = now, now + seconds, place + moved
        known = observed(known, [box(place)], now, last, CONFIG)
        (obstacle,) = known
        assert np.isfinite(obstacle.velocity).all()
        assert obstacle.speed <= CONFIG.obstacle_tracking.fastest * (1.0 + 1e-9)
        assert obstacle.moves or obstacle.speed == 0.0


@given(from_zero(1e-9, 20.0), positive(1e-3, 5.0))
@example(0.0, 0.05)
@few_examples
def test_a_steady_obstacle_has_its_own_speed(speed: float, cycle: float) -> None:
    speed = min(speed, CONFIG.obstacle_tracking.fastest)
    cycle = min(cycle, CONFIG.obstacle_tracking.forgotten)
    known = observed((), [box(0.0)], 0.0, 0.0, CONFIG)
    for k in range(1, 12):
        known = observed(known, [box(k * cycle * speed)], k * cycle, (k - 1) * cycle, CONFIG)
    if known[0].moves:
        assert known[0].speed == pytest.approx(speed, rel=1e-6)
