from __future__ import annotations

from math import sqrt

import numpy as np
import pytest

from geometry import Pose2, ReferencePath
from rti_mpcc.config import ControllerConfig, Limits
from rti_mpcc.planning.arrival import (
    LEAST_TIME,
    WAITING_REACH,
    arrival_time,
    cubic_motion,
    paced_motion,
    peak_speed,
    time_along,
    time_to_go,
    within_reach,
)
from rti_mpcc.planning.pace import pace_of
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
    duration = time_to_go(distance, speed, COMFORT, LEAST)
    assert cubic(distance, speed, duration, duration)[2] == pytest.approx(-COMFORT)


@pytest.mark.parametrize("share", [0.1, 0.5, 0.8])
@pytest.mark.parametrize(("distance", "speed"), CASES)
def test_along_its_own_cubic_the_time_to_go_falls_by_the_time_passed(
    distance: float, speed: float, share: float
) -> None:
    duration = time_to_go(distance, speed, COMFORT, LEAST)
    driven, now, _ = cubic(distance, speed, duration, share * duration)
    left = time_to_go(distance - driven, now, COMFORT, LEAST)
    assert left == pytest.approx(max((1.0 - share) * duration, LEAST))


def test_from_rest_it_is_the_square_root_of_six_ways() -> None:
    assert time_to_go(24.0, 0.0, 0.4, LEAST) == pytest.approx(sqrt(6.0 * 24.0 / 0.4))


def test_to_end_evenly_takes_half_the_ramp_more() -> None:
    free = time_to_go(24.0, 1.0, 0.4, LEAST)
    assert time_to_go(24.0, 1.0, 0.4, LEAST, jerk=2.0) == pytest.approx(free + 0.1)


def test_out_of_a_cruise_it_begins_without_a_step_in_acceleration() -> None:
    speed = 3.0
    distance = 4.0 * speed**2 / (3.0 * COMFORT)
    assert cubic(distance, speed, time_to_go(distance, speed, COMFORT, LEAST), 0.0)[2] == pytest.approx(
        0.0, abs=1e-12
    )


def test_too_fast_for_the_comfort_acceleration_it_is_the_constant_deceleration() -> None:
    distance, speed = 5.0, 4.0
    duration = time_to_go(distance, speed, COMFORT, LEAST)
    assert duration == pytest.approx(2.0 * distance / speed)
    accelerations = [cubic(distance, speed, duration, t)[2] for t in (0.0, 0.5 * duration, duration)]
    np.testing.assert_allclose(accelerations, -(speed**2) / (2.0 * distance))


@pytest.mark.parametrize(("distance", "speed"), [(0.0, 0.0), (-1.0, 0.0), (1e-9, 0.01), (0.01, 0.0)])
def test_it_is_never_shorter_than_the_floor(distance: float, speed: float) -> None:
    assert time_to_go(distance, speed, COMFORT, LEAST) == LEAST


@pytest.mark.parametrize(("distance", "speed"), [*CASES, (5.0, 4.0), (6.7, 2.0)])
def test_the_peak_speed_is_the_highest_on_the_cubic(distance: float, speed: float) -> None:
    duration = time_to_go(distance, speed, COMFORT, LEAST)
    speeds = [cubic(distance, speed, duration, t)[1] for t in np.linspace(0.0, duration, 20_001)]
    assert peak_speed(distance, speed, duration) == pytest.approx(max(speeds), abs=1e-6)


def test_no_bound_above_the_peak_changes_the_time() -> None:
    for distance, speed in CASES:
        free = time_to_go(distance, speed, COMFORT, LEAST)
        peak = peak_speed(distance, speed, free)
        assert time_to_go(distance, speed, COMFORT, LEAST, np.full(200, 1.2 * max(peak, 2.5 * speed))) == free


def test_under_a_bound_it_is_a_cubic_up_to_it_and_one_down_from_it() -> None:
    """From rest: the cubics take 2 c / a each, over 2/3 of what c would drive in that time."""
    distance, bound = 40.0, 2.0
    ramp = 2.0 * bound / COMFORT
    expected = distance / bound + 2.0 / 3.0 * ramp
    got = time_to_go(distance, 0.0, COMFORT, LEAST, np.full(400, bound))
    assert got == pytest.approx(expected, rel=2e-3)
    assert got > time_to_go(distance, 0.0, COMFORT, LEAST)


@pytest.mark.parametrize(("distance", "speed"), [(10.0, 0.0), (10.0, 1.0), (30.0, 2.0), (2.0, 0.6)])
def test_where_the_bound_is_the_peak_itself_it_is_the_one_cubic(distance: float, speed: float) -> None:
    free = time_to_go(distance, speed, COMFORT, LEAST)
    peak = peak_speed(distance, speed, free)
    if peak > speed:
        got = time_to_go(distance, speed, COMFORT, LEAST, np.full(400, 0.9999 * peak))
        assert got == pytest.approx(free, rel=2e-3)


def test_a_bend_on_the_way_costs_time_and_the_later_it_is_the_same() -> None:
    """From rest to rest the motion may be turned round."""
    bounds = np.full(400, 10.0)
    bounds[100:140] = 1.0
    first, last = (time_to_go(60.0, 0.0, COMFORT, LEAST, values) for values in (bounds, bounds[::-1]))
    assert first == pytest.approx(last, rel=1e-6)
    assert first > time_to_go(60.0, 0.0, COMFORT, LEAST, np.full(400, 10.0)) + 3.0


def test_along_its_own_motion_under_a_bound_the_time_falls_by_the_time_passed() -> None:
    distance, bound = 40.0, 2.0
    ramp = 2.0 * bound / COMFORT
    left = distance - 2.0 / 3.0 * ramp * bound  # the first cubic is driven
    whole, rest = (
        time_to_go(d, v, COMFORT, LEAST, np.full(800, bound))
        for d, v in ((distance, 0.0), (left, 0.9999 * bound))
    )
    assert rest == pytest.approx(whole - ramp, rel=5e-3)


def test_a_vehicle_above_its_bound_is_slowed_not_refused() -> None:
    got = time_to_go(30.0, 3.0, COMFORT, LEAST, np.full(200, 1.0))
    assert 30.0 / 3.0 < got < 30.0 / 1.0 + 2.0 / 3.0 * 2.0 / COMFORT


def narrow(distance: float) -> Array:
    """Speeds allowed in 0.1 m of the way each, lower in its third quarter [m/s]."""
    allowed = np.full(round(10.0 * distance), 2.5)
    allowed[len(allowed) // 2 : 3 * len(allowed) // 4] = 1.0
    return allowed


@pytest.mark.parametrize("later", [1.0, 1.5])
@pytest.mark.parametrize("speed", [0.0, 0.8])
def test_the_motion_of_an_arrival_is_nowhere_faster_than_allowed(speed: float, later: float) -> None:
    distance, allowed = 40.0, narrow(40.0)
    duration = later * time_to_go(distance, speed, COMFORT, LEAST, allowed)
    elapsed = np.linspace(0.0, duration, 2001)
    s, rate = paced_motion(elapsed, distance, speed, COMFORT, allowed)
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
    duration = time_to_go(distance, speed, COMFORT, LEAST)
    elapsed = np.linspace(0.0, duration, 20)
    expected = [cubic(distance, speed, duration, t)[:2] for t in elapsed]
    np.testing.assert_allclose(np.transpose(cubic_motion(elapsed, distance, speed)), expected, atol=1e-9)
    paced = paced_motion(elapsed, distance, speed, COMFORT, np.full(800, 50.0))
    np.testing.assert_allclose(np.transpose(paced), expected, atol=0.02 * distance)


def test_a_vehicle_faster_than_allowed_brakes_in_its_motion() -> None:
    allowed = np.full(200, 1.0)
    duration = time_to_go(30.0, 2.0, COMFORT, LEAST, allowed)
    elapsed = np.linspace(0.0, duration, 500)
    rate = paced_motion(elapsed, 30.0, 2.0, COMFORT, allowed)[1]
    braking = 2.0 - COMFORT * elapsed
    assert (rate <= np.maximum(braking, 1.0) + 0.02).all()


def reaches(distance: float, speed: float, config: ControllerConfig) -> bool:
    """On a straight part."""
    part = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 300.0)]).parts[0]
    return within_reach(distance, speed, config, pace_of(part, config), 0.0)


def test_an_arrival_begins_when_it_is_short_and_slow_enough() -> None:
    config = ControllerConfig(limits=Limits(speed=2.1))
    # From rest the peak of the cubic is 1.5 D / T.
    a, jerk = config.arrival_acceleration, config.comfort.jerk
    root = np.roots([1.5, -2.1 * sqrt(6.0 / a), -2.1 * 0.5 * a / jerk]).max()
    fastest = float(root) ** 2
    assert REACH < fastest < config.arrival_reach
    assert reaches(fastest - 0.1, 0.0, config)
    assert not reaches(fastest + 0.1, 0.0, config)


def test_an_arrival_that_would_be_too_fast_begins_when_it_is_due() -> None:
    config = ControllerConfig(limits=Limits(speed=3.0))
    due = 4.0 * 3.1**2 / (3.0 * config.arrival_acceleration)
    assert REACH < due < config.arrival_reach
    assert reaches(due - 0.1, 3.1, config)
    assert not reaches(due + 1.0, 3.1, config)


@pytest.mark.parametrize("speed", [0.0, 0.5])
def test_a_slow_vehicle_has_room_to_get_across_to_its_goal(speed: float) -> None:
    config = ControllerConfig(limits=Limits(speed=0.5))
    assert reaches(REACH, speed, config)
    assert not reaches(REACH + 0.1, speed, config)


def test_an_arrival_longer_than_the_horizon_waits() -> None:
    config = ControllerConfig(limits=Limits(speed=50.0))
    longest = config.arrival_horizon**2 * config.comfort_acceleration / 6.0
    assert reaches(longest - 0.1, 0.0, config)
    assert not reaches(longest + 0.1, 0.0, config)


def test_a_gentle_arrival_may_take_longer_than_the_horizon_over_the_same_way() -> None:
    usual = ControllerConfig(limits=Limits(speed=50.0))
    gentle = ControllerConfig(limits=Limits(speed=50.0), comfort_acceleration=0.1)
    assert time_to_go(41.0, 0.0, gentle.arrival_acceleration, LEAST) > gentle.arrival_horizon
    for config in (usual, gentle):
        assert reaches(41.0, 0.0, config)
        assert not reaches(42.0, 0.0, config)


def test_a_bend_ahead_delays_the_arrival_until_it_is_short_enough() -> None:
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 40.0), (1, 0.2, 10.0), (1, 0.0, 30.0)])
    config = ControllerConfig(comfort_acceleration=0.8)
    pace = pace_of(path.parts[0], config)
    slow = pace_of(
        path.parts[0], ControllerConfig(comfort_acceleration=0.8, comfort_lateral_acceleration=0.05)
    )
    distance = 60.0
    assert within_reach(distance, 3.0, config, pace, 5.0)
    assert not within_reach(distance, 3.0, config, slow, 5.0)


# -- brisk rides ---------------------------------------------------------------------------------------------


def test_a_brisk_ride_is_full_acceleration_and_full_braking_with_ramps_between() -> None:
    assert time_to_go(25.0, 0.0, 0.4, LEAST, jerk=1.0, brisk=True) == pytest.approx(
        2.0 * sqrt(25.0 / 0.4) + 0.4
    )
    # From 2 m/s: up to V, down to rest.
    top = sqrt(0.4 * 25.0 + 0.5 * 2.0**2)
    assert time_to_go(25.0, 2.0, 0.4, LEAST, jerk=1.0, brisk=True) == pytest.approx(
        (2.0 * top - 2.0) / 0.4 + 0.4
    )
    # One that can only just brake does that.
    assert time_to_go(5.0, 2.0, 0.4, LEAST, jerk=1.0, brisk=True) == pytest.approx(2.0 / 0.4 + 0.4)


def test_it_is_a_fifth_shorter_than_a_smooth_one() -> None:
    brisk, smooth = (ControllerConfig(ride=ride) for ride in ("brisk", "smooth"))
    ratio = arrival_time(30.0, 0.0, brisk) / arrival_time(30.0, 0.0, smooth)
    assert 0.75 < ratio < 0.85


def test_a_brisk_ride_keeps_to_what_is_allowed_on_the_way() -> None:
    """Up to 1 m/s, along, and down: 1/0.4 s and 1.25 m each."""
    got = time_to_go(20.0, 0.0, 0.4, LEAST, np.full(2000, 1.0), jerk=1.0, brisk=True)
    assert got == pytest.approx(2.5 + (20.0 - 2.5) + 2.5 + 0.4, rel=1e-3)
    pieces = np.full(2000, 0.01)
    assert time_along(pieces, 0.0, 0.4, np.full(2000, 1.0)) == pytest.approx(got - 0.4, rel=1e-3)
    s, rate = paced_motion(np.linspace(0.0, got, 200), 20.0, 0.0, 0.4, np.full(2000, 1.0), brisk=True)
    assert (s[-1], rate[-1]) == (pytest.approx(20.0), pytest.approx(0.0, abs=1e-9))
    assert rate.max() <= 1.0 + 1e-9


def test_unequal_pieces_take_the_time_of_their_way() -> None:
    ways = np.random.default_rng(3).uniform(0.001, 0.05, 2000)
    even = 2.0 * sqrt(ways.sum() / 0.4)
    assert time_along(ways, 0.0, 0.4, np.full(2000, 50.0)) == pytest.approx(even, rel=1e-3)


def test_out_of_a_cruise_a_brisk_arrival_begins_when_it_has_to_brake(monkeypatch: pytest.MonkeyPatch) -> None:
    config = ControllerConfig(limits=Limits(speed=3.0), ride="brisk", arrival_horizon=60.0)
    a, speed = config.arrival_acceleration, 3.0
    braking = 0.5 * speed**2 / a + speed * a / config.comfort.jerk
    monkeypatch.setattr("rti_mpcc.planning.arrival.WAITING_REACH", 0.0)
    assert reaches(braking - 0.1, speed, config)
    assert not reaches(braking + 0.5, speed, config)
