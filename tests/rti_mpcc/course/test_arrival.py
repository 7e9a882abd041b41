from __future__ import annotations

from math import sqrt

import numpy as np
import pytest

from rti_mpcc.course.arrival import WAITING_REACH, cubic_motion, peak_speed, profiled_motion, time_to_go
from rti_mpcc.ocp.stage_cost import LEAST_TIME
from rti_mpcc.types import Array

CASES = [(20.0, 0.0), (20.0, 2.0), (8.0, 1.5), (3.0, 0.4), (100.0, 5.0)]
"""Way [m] and speed [m/s] from which the comfort acceleration is enough."""
COMFORT = 0.4
LEAST, REACH = LEAST_TIME, WAITING_REACH


def cubic(distance: float, speed: float, duration: float, t: float) -> tuple[float, float, float]:
    """Way driven, speed and acceleration at `t` on the cubic arrival, straight from its four conditions."""
    # s = v t + b t² + c t³ with s(T) = D, s'(T) = 0
    matrix = [[duration**2, duration**3], [2.0 * duration, 3.0 * duration**2]]
    b, c = np.linalg.solve(matrix, [distance - speed * duration, -speed])
    return speed * t + b * t**2 + c * t**3, speed + 2.0 * b * t + 3.0 * c * t**2, 2.0 * b + 6.0 * c * t


@pytest.mark.parametrize(("distance", "speed"), CASES)
def test_the_last_deceleration_is_the_comfort_one(distance: float, speed: float) -> None:
    duration = time_to_go(distance, speed, COMFORT)
    assert cubic(distance, speed, duration, duration)[2] == pytest.approx(-COMFORT)


@pytest.mark.parametrize("share", [0.1, 0.5, 0.8])
@pytest.mark.parametrize(("distance", "speed"), CASES)
def test_along_its_own_cubic_the_time_to_go_falls_by_the_time_passed(
    distance: float, speed: float, share: float
) -> None:
    duration = time_to_go(distance, speed, COMFORT)
    driven, now, _ = cubic(distance, speed, duration, share * duration)
    left = time_to_go(distance - driven, now, COMFORT)
    assert left == pytest.approx(max((1.0 - share) * duration, LEAST))


def test_from_rest_it_is_the_square_root_of_six_ways() -> None:
    assert time_to_go(24.0, 0.0, 0.4) == pytest.approx(sqrt(6.0 * 24.0 / 0.4))


def test_too_fast_for_the_comfort_acceleration_it_is_the_constant_deceleration() -> None:
    distance, speed = 5.0, 4.0
    duration = time_to_go(distance, speed, COMFORT)
    assert duration == pytest.approx(2.0 * distance / speed)
    accelerations = [cubic(distance, speed, duration, t)[2] for t in (0.0, 0.5 * duration, duration)]
    np.testing.assert_allclose(accelerations, -(speed**2) / (2.0 * distance))


@pytest.mark.parametrize(("distance", "speed"), [*CASES, (5.0, 4.0), (6.7, 2.0)])
def test_the_peak_speed_is_the_highest_on_the_cubic(distance: float, speed: float) -> None:
    duration = time_to_go(distance, speed, COMFORT)
    speeds = [cubic(distance, speed, duration, t)[1] for t in np.linspace(0.0, duration, 20_001)]
    assert peak_speed(distance, speed, duration) == pytest.approx(max(speeds), abs=1e-6)


def test_under_a_bound_it_is_a_cubic_up_to_it_and_one_down_from_it() -> None:
    """From rest: the cubics take 2 c / a each, over 2/3 of what c would drive in that time."""
    distance, bound = 40.0, 2.0
    ramp = 2.0 * bound / COMFORT
    expected = distance / bound + 2.0 / 3.0 * ramp
    got = time_to_go(distance, 0.0, COMFORT, np.full(400, bound))
    assert got == pytest.approx(expected, rel=2e-3)
    assert got > time_to_go(distance, 0.0, COMFORT)


def narrow(distance: float) -> Array:
    """Speeds allowed in 0.1 m of the way each, lower in its third quarter [m/s]."""
    allowed = np.full(round(10.0 * distance), 2.5)
    allowed[len(allowed) // 2 : 3 * len(allowed) // 4] = 1.0
    return allowed


@pytest.mark.parametrize("later", [1.0, 1.5])
@pytest.mark.parametrize("speed", [0.0, 0.8])
def test_the_motion_of_an_arrival_is_nowhere_faster_than_allowed(speed: float, later: float) -> None:
    distance, allowed = 40.0, narrow(40.0)
    duration = later * time_to_go(distance, speed, COMFORT, allowed)
    elapsed = np.linspace(0.0, duration, 2001)
    s, rate = profiled_motion(elapsed, distance, speed, COMFORT, allowed)
    assert s[0] == 0.0
    assert s[-1] == pytest.approx(distance)
    assert rate[-1] == pytest.approx(0.0, abs=1e-9)
    np.testing.assert_allclose(np.gradient(s, elapsed)[1:-1], rate[1:-1], atol=0.02)
    assert (rate <= np.interp(s, np.arange(len(allowed)) * 0.1, allowed) + 0.05).all()
    if later == 1.0:
        assert cubic(distance, speed, duration, 0.5 * duration)[1] > 1.2
        assert rate[0] == pytest.approx(speed)
        assert np.abs(np.diff(rate) / np.diff(elapsed)).max() <= COMFORT + 0.01


@pytest.mark.parametrize(("distance", "speed"), CASES)
def test_where_any_speed_is_allowed_both_motions_are_the_one_of_least_energy(
    distance: float, speed: float
) -> None:
    duration = time_to_go(distance, speed, COMFORT)
    elapsed = np.linspace(0.0, duration, 20)
    expected = [cubic(distance, speed, duration, t)[:2] for t in elapsed]
    np.testing.assert_allclose(np.transpose(cubic_motion(elapsed, distance, speed)), expected, atol=1e-9)
    paced = profiled_motion(elapsed, distance, speed, COMFORT, np.full(800, 50.0))
    np.testing.assert_allclose(np.transpose(paced), expected, atol=0.02 * distance)
