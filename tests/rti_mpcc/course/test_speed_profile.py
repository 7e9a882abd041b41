from __future__ import annotations

from math import sqrt

import numpy as np
import pytest

from geometry import PathPart, Pose2, ReferencePath
from rti_mpcc.config import ControllerConfig, Limits
from rti_mpcc.course.speed_profile import STEERING_DISTANCE, speed_profile_of

CONFIG = ControllerConfig(comfort_lateral_acceleration=0.8, comfort_steering_rate=0.4)
L = CONFIG.vehicle.wheelbase


def part(*pieces: tuple[int, float, float]) -> PathPart:
    return ReferencePath.from_segments(Pose2(1.0, 2.0, 0.7), list(pieces)).parts[0]


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("curvature", [0.2, -0.2, 0.05])
def test_in_an_arc_the_lateral_acceleration_is_the_comfortable_one(direction: int, curvature: float) -> None:
    profile = speed_profile_of(part((direction, curvature, 30.0)), CONFIG)
    np.testing.assert_allclose(profile.speed**2 * abs(curvature), 0.8, rtol=1e-9)


def test_a_straight_is_driven_at_the_speed_limit() -> None:
    config = ControllerConfig(limits=Limits(speed=3.0))
    np.testing.assert_array_equal(speed_profile_of(part((1, 0.0, 30.0)), config).speed, 3.0)


def test_a_step_of_curvature_is_steered_at_the_comfortable_rate() -> None:
    """Over the transition the steering turns evenly: v d delta / d theta = delta_dot."""
    gentle = ControllerConfig(comfort_lateral_acceleration=100.0, comfort_steering_rate=0.1)
    turned = 2.0 * np.arctan(L * 0.2)
    profile = speed_profile_of(part((-1, 0.2, 15.0), (-1, -0.2, 15.0)), gentle)
    middle = profile.at(np.array([15.0]))[0]
    assert middle == pytest.approx(0.1 * STEERING_DISTANCE / turned, rel=0.1)
    assert profile.at(np.array([5.0]))[0] == gentle.limits.speed


def test_the_way_ahead_is_looked_at_in_equal_pieces_and_goes_on_behind_the_end() -> None:
    profile = speed_profile_of(part((1, 0.0, 20.0), (1, 0.2, 20.0)), CONFIG)
    ahead = profile.ahead(10.0, 40.0)
    assert len(ahead) == 160
    np.testing.assert_allclose(ahead[:30], CONFIG.limits.speed)
    np.testing.assert_allclose(ahead[60:], sqrt(0.8 / 0.2))
    assert len(profile.ahead(0.0, 0.1)) == 64
    assert len(profile.ahead(0.0, 1e4)) == 400


def test_more_comfort_is_never_faster() -> None:
    path = part((1, 0.15, 8.0), (1, -0.1, 7.0), (1, 0.0, 4.0), (1, 0.2, 9.0))
    softer = ControllerConfig(comfort_lateral_acceleration=0.4, comfort_steering_rate=0.2)
    assert (speed_profile_of(path, softer).speed <= speed_profile_of(path, CONFIG).speed).all()
