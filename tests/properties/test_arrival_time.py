"""The time of an arrival divides by an acceleration, a distance and a speed: what holds around 0."""

from __future__ import annotations

from math import inf, isfinite

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from rti_mpcc.config import ControllerConfig
from rti_mpcc.planning.arrival import (
    cubic_motion,
    paced_motion,
    time_to_go,
)
from rti_mpcc.types import Array
from tests.properties.magnitudes import examples, few_examples, from_zero, positive

LEAST = ControllerConfig().arrival_timing.least_time

distances = from_zero(1e-9, 1e3)
speeds = from_zero(1e-9, 30.0)
comforts = positive(1e-2, 10.0)
jerks = st.one_of(st.just(inf), positive(1e-2, 1e3))
brisk = st.booleans()


@given(st.one_of(distances, distances.map(lambda d: -d)), speeds, comforts, jerks, brisk)
@example(0.0, 0.0, 0.4, 1.0, False)
@example(0.0, 1.0, 0.4, 1.0, False)
@example(0.0, 1.0, 0.4, 1.0, True)
@example(0.01, 1.0, 0.4, 1.0, False)
@examples
def test_the_time_of_an_arrival_is_between_the_floor_and_the_time_from_rest(
    distance: float, speed: float, comfort: float, jerk: float, brisk: bool
) -> None:
    from_rest = time_to_go(distance, 0.0, comfort, LEAST, jerk=jerk, brisk=brisk)
    time = time_to_go(distance, speed, comfort, LEAST, jerk=jerk, brisk=brisk)
    assert isfinite(from_rest)
    assert LEAST <= time <= from_rest * (1.0 + 1e-9)


@given(distances, st.floats(1.0, 10.0), speeds, comforts, jerks, brisk)
@example(0.0, 2.0, 1.0, 0.4, 1.0, False)
@example(1e-3, 10.0, 1.0, 0.4, 1.0, False)
@examples
def test_the_time_of_an_arrival_never_falls_with_the_distance(
    distance: float, farther: float, speed: float, comfort: float, jerk: float, brisk: bool
) -> None:
    near, far = (
        time_to_go(each, speed, comfort, LEAST, jerk=jerk, brisk=brisk)
        for each in (distance, farther * distance + 1e-3 * (farther - 1.0))
    )
    assert near <= far * (1.0 + 1e-9)


@given(distances, speeds, st.floats(1.0, 10.0), comforts, jerks, brisk)
@example(0.0, 0.0, 2.0, 0.4, 1.0, False)
@example(0.01, 0.1, 10.0, 0.4, 1.0, False)
@example(0.01, 0.1, 10.0, 0.4, 1.0, True)
@examples
def test_the_time_of_an_arrival_never_rises_with_the_speed(
    distance: float, speed: float, faster: float, comfort: float, jerk: float, brisk: bool
) -> None:
    slow, fast = (
        time_to_go(distance, each, comfort, LEAST, jerk=jerk, brisk=brisk)
        for each in (speed, faster * speed + 1e-3 * (faster - 1.0))
    )
    assert fast <= slow * (1.0 + 1e-9)


def stages(duration: float) -> Array:
    """Times (31,) [s] whose first interval is one cycle."""
    return np.append(0.0, np.linspace(0.01 * duration, duration, 30))


@given(distances, speeds, positive(1e-2, 1e3))
@example(0.0, 0.0, 1.0)
@example(0.0, 1.0, 1.0)
@example(1e-9, 10.0, 1.0)
@examples
def test_the_motion_of_an_arrival_never_goes_back_and_ends_at_rest(
    distance: float, speed: float, duration: float
) -> None:
    driven, rate = cubic_motion(stages(duration), distance, speed)
    assert driven[0] == 0.0
    assert (np.diff(driven) >= 0.0).all()
    assert (rate >= 0.0).all()
    assert rate[0] == pytest.approx(speed)
    assert rate[-1] == pytest.approx(0.0, abs=1e-9 * (1.0 + speed + distance / duration))
    # A vehicle too fast for its way passes the target by 4/27 of what it would drive at that speed, at most.
    assert driven[-1] <= (distance + 4.0 / 27.0 * speed * duration) * (1.0 + 1e-9)
    if speed * duration <= 3.0 * distance:
        assert driven[-1] == pytest.approx(distance)


@given(distances, speeds, comforts, positive(1e-3, 10.0), brisk)
@example(0.0, 0.0, 0.4, 1.0, False)
@example(0.0, 1.0, 0.4, 1.0, False)
@example(0.0, 1.0, 0.4, 1.0, True)
@example(5.0, 0.0, 0.4, 1e-3, False)
@few_examples
def test_the_motion_under_a_speed_limit_covers_the_way_and_keeps_to_the_limit(
    distance: float, speed: float, comfort: float, bound: float, brisk: bool
) -> None:
    highest = np.full(64, bound)
    time = time_to_go(distance, speed, comfort, 1e-9, highest, brisk=brisk)
    driven, rate = paced_motion(stages(time), distance, speed, comfort, highest, brisk=brisk)
    way = max(distance, 1e-6)  # a way of 0 is taken for a micrometre
    assert (np.diff(driven) >= -1e-12 * way).all()
    assert driven[-1] == pytest.approx(way, rel=1e-6)
    assert (rate >= 0.0).all()
    assert rate[-1] == pytest.approx(0.0, abs=1e-6 * (1.0 + speed))
    assert rate.max() <= max(speed, bound) * 1.01
