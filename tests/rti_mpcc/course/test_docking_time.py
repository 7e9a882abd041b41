from __future__ import annotations

from itertools import product
from math import pi, sqrt

import pytest

from geometry import Pose2, ReferencePath
from rti_mpcc.config import ControllerConfig, Limits
from rti_mpcc.course.docking_time import config_for_docking_time, expected_docking_time
from rti_mpcc.errors import ConfigError
from tests.lists import in_fast_suite

REVERSE = [(-1, -0.2, 10.0), (-1, 0.2, 10.0), (-1, 0.0, 5.0), (-1, 0.2, 5.0)]
FULL = [(1, 0.0, 5.0), (1, 0.2, 5.0), (1, -0.2, 10.0), (1, 0.2, 5.0), (1, 0.0, 5.0), *REVERSE]
CONFIG = ControllerConfig(dead_time=0.18)


def route(segments: list[tuple[int, float, float]]) -> ReferencePath:
    return ReferencePath.from_segments(Pose2(0.0, 0.0, pi / 2), segments)


def test_over_a_straight_it_is_the_cubic_arrival_and_the_dead_time() -> None:
    path = route([(1, 0.0, 24.0)])
    a = CONFIG.arrival_acceleration
    expected = 0.18 + sqrt(6.0 * 24.0 / a) + 0.5 * a / CONFIG.comfort.jerk
    assert expected_docking_time(path, CONFIG) == pytest.approx(expected, abs=0.03)


def test_the_parts_of_a_route_follow_one_another() -> None:
    there, back = route(FULL[:5]), route(REVERSE)
    whole = expected_docking_time(route(FULL), CONFIG)
    assert whole == pytest.approx(
        expected_docking_time(there, CONFIG) + expected_docking_time(back, CONFIG), abs=1e-3
    )


def test_a_goal_behind_the_end_takes_longer_and_one_before_it_shorter() -> None:
    path = route([(1, 0.0, 20.0)])
    goals = [path.end.compose(Pose2(x, 0.0, 0.0)) for x in (-3.0, 0.0, 3.0)]
    times = [expected_docking_time(path, CONFIG, goal) for goal in goals]
    assert times[1] == pytest.approx(expected_docking_time(path, CONFIG))
    assert times == sorted(times)


def test_a_long_way_is_cruised() -> None:
    times = [expected_docking_time(route([(1, 0.0, length)]), CONFIG) for length in (200.0, 300.0, 400.0)]
    at_cruise = 100.0 / CONFIG.cruise_speed
    assert times[1] - times[0] == pytest.approx(at_cruise, rel=0.05)
    assert times[2] - times[1] == pytest.approx(at_cruise, rel=0.01)


@pytest.mark.parametrize(
    ("segments", "factor"),
    in_fast_suite([(FULL, 0.6), (REVERSE, 3.0)], product([REVERSE, FULL], [0.6, 1.0, 3.0, 1.7])),
)
def test_the_comfort_for_a_time_takes_that_time_and_keeps_its_proportions(
    segments: list[tuple[int, float, float]], factor: float
) -> None:
    path = route(segments)
    asked = factor * expected_docking_time(path, CONFIG)
    got = config_for_docking_time(asked, path, CONFIG)
    assert expected_docking_time(path, got) == pytest.approx(asked, rel=1e-3)
    shares = [ours / usual for ours, usual in zip(got.comfort, CONFIG.comfort, strict=True)]
    assert shares[0] == pytest.approx(shares[1])
    assert shares[0] == pytest.approx(shares[2] ** 2)
    assert shares[3] == pytest.approx(shares[2] ** 3)
    assert got.model_copy(update={name: getattr(CONFIG, name) for name in COMFORT}) == CONFIG


COMFORT = ("comfort_acceleration", "comfort_lateral_acceleration", "comfort_steering_rate", "comfort_jerk")


def test_a_time_beyond_the_limits_is_refused_with_what_is_possible() -> None:
    weak = ControllerConfig(limits=Limits(acceleration=0.5))
    with pytest.raises(ConfigError, match=r"docking_time = 5\.0 s: .* takes 1\d\.\d* to 2\d\d\.\d* s"):
        config_for_docking_time(5.0, route(REVERSE), weak)
    with pytest.raises(ConfigError, match="docking_time = 1000000"):
        config_for_docking_time(1e6, route(REVERSE), weak)


def test_without_planned_arrivals_no_time_is_known() -> None:
    with pytest.raises(ConfigError, match="only planned arrivals"):
        expected_docking_time(route(REVERSE), ControllerConfig.paper())
