"""The pace divides by a curvature and by a turn of the wheels per metre: what holds at 0 and around it."""

from __future__ import annotations

from math import atan, sqrt

import numpy as np
from hypothesis import example, given
from hypothesis import strategies as st

from geometry import Corridor, Pose2, ReferencePath
from rti_mpcc.config import ArrivalTiming, ControllerConfig, Limits
from rti_mpcc.ocp.room import NARROW_SPEED, REACTION_TIME, room_along
from rti_mpcc.planning.pace import pace_of
from tests.properties.magnitudes import examples, few_examples, from_zero, positive, signed

CONFIG = ControllerConfig()
L = CONFIG.vehicle.wheelbase
MOST = CONFIG.limits.speed
HALF_WIDTH = 0.5 * CONFIG.vehicle.width


def path_of(*pieces: tuple[float, float]) -> ReferencePath:
    """Pieces of a curvature [1/m] and a length [m], driven forwards."""
    return ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, *piece) for piece in pieces])


@given(signed(1e-12, 1e3), positive(1e-9, 100.0))
@example(0.0, 1e-9)
@example(0.0, 30.0)
@example(1e3, 1e-9)
@examples
def test_on_an_arc_the_pace_is_that_of_the_lateral_acceleration_and_never_above_the_limit(
    curvature: float, length: float
) -> None:
    pace = pace_of(path_of((curvature, length)).parts[0], CONFIG)
    expected = min(MOST, sqrt(CONFIG.comfort_lateral_acceleration / max(abs(curvature), 1e-12)))
    np.testing.assert_allclose(pace.speed, expected, rtol=1e-6)


@given(st.floats(0.0, 0.23), st.floats(1.0, 2.0), positive(0.1, 100.0))
@example(0.0, 2.0, 30.0)
@examples
def test_a_sharper_bend_is_never_driven_faster(curvature: float, sharper: float, length: float) -> None:
    gentle, sharp = (
        pace_of(path_of((0.0, length), (each, length)).parts[0], CONFIG).speed
        for each in (curvature, sharper * curvature)
    )
    assert (sharp <= gentle * (1.0 + 1e-9)).all()


@given(st.lists(st.tuples(st.floats(-0.23, 0.23), positive(1e-9, 10.0)), min_size=1, max_size=6))
@example([(0.23, 1e-9), (-0.23, 1e-9)])
@example([(0.23, 5e-4), (-0.23, 5e-4)])
@example([(0.23, 0.05), (-0.23, 0.05)])
@example([(0.23, 20.0), (-0.23, 20.0)])
@examples
def test_wheels_are_never_turned_over_less_way_than_the_steering_distance(
    pieces: list[tuple[float, float]],
) -> None:
    """However short the part is: the pace is at least the one that turns them all the way over that."""
    pace = pace_of(path_of(*pieces).parts[0], CONFIG)
    turns = [atan(L * curvature) for curvature, _ in pieces]
    turned, sharpest = max(turns) - min(turns), max(abs(curvature) for curvature, _ in pieces)
    slowest = min(MOST, sqrt(CONFIG.comfort_lateral_acceleration / max(sharpest, 1e-12)))
    if turned > 0.0:
        slowest = min(
            slowest, CONFIG.comfort_steering_rate * CONFIG.arrival_timing.steering_distance / turned
        )
    # The bends are smoothed with the steering: the tangent of a mean is no more than the largest one. Three
    # samples or more are at least two thirds of their usual distance apart.
    assert pace.speed.min() >= slowest * 2.0 / 3.0 * (1.0 - 1e-6)


@given(positive(1e-3, 100.0), positive(1e-3, 100.0), positive(1e-3, 100.0), from_zero(1e-3, 100.0))
@example(1.0, 0.5, 10.0, 0.0)
@few_examples
def test_whatever_the_comfort_a_pace_is_positive_and_within_the_limit(
    lateral: float, rate: float, most: float, steering_distance: float
) -> None:
    config = ControllerConfig(
        comfort_lateral_acceleration=lateral,
        comfort_steering_rate=rate,
        limits=Limits(speed=most, steering_rate=100.0),
        arrival_timing=ArrivalTiming(steering_distance=steering_distance),
    )
    pace = pace_of(path_of((0.0, 5.0), (0.2, 5.0), (-0.2, 1e-9), (0.0, 5.0)).parts[0], config)
    assert (pace.speed > 0.0).all()
    assert (pace.speed <= most).all()


@given(from_zero(1e-12, 1e4), st.floats(-50.0, 50.0))
@example(0.0, 0.0)
@example(0.0, 50.0)
@examples
def test_the_way_ahead_is_known_in_pieces_however_short_it_is(distance: float, theta: float) -> None:
    pace = pace_of(path_of((0.0, 10.0), (0.2, 10.0)).parts[0], CONFIG)
    ahead, timing = pace.ahead(theta, distance, CONFIG), CONFIG.arrival_timing
    assert timing.least_pieces <= len(ahead) <= timing.most_pieces
    assert (ahead >= pace.speed.min()).all()
    assert (ahead <= pace.speed.max()).all()


LANE = path_of((0.0, 10.0))
"""Between walls whose distance is drawn."""


def speed_between(half_width: float, config: ControllerConfig = CONFIG) -> float:
    """Highest speed [m/s] in a lane with walls so far [m] to either side of the path."""
    corridor = Corridor.from_offsets(LANE, left=half_width, right=-half_width)
    return float(room_along(LANE.parts[0], corridor, 0, config).speed.min())


@given(st.floats(0.5 * HALF_WIDTH, HALF_WIDTH + 2.0), from_zero(1e-9, 1.0))
@example(HALF_WIDTH - 0.01, 0.05)
@example(HALF_WIDTH, 0.0)
@example(HALF_WIDTH + CONFIG.clearance.least - 1e-6, 2e-6)
@few_examples
def test_a_narrower_lane_is_never_driven_faster(half_width: float, wider: float) -> None:
    narrow, wide = speed_between(half_width), speed_between(half_width + wider)
    assert NARROW_SPEED * (1.0 - 1e-9) <= narrow <= wide * (1.0 + 1e-9)


@given(from_zero(1e-3, 2.0), positive(1e-3, 100.0))
@example(0.05, 100.0)
@few_examples
def test_the_speed_in_a_lane_is_that_of_its_room_whatever_the_settings(
    room: float, acceleration: float
) -> None:
    config = ControllerConfig(comfort_acceleration=acceleration, limits=Limits(acceleration=100.0))
    expected = NARROW_SPEED + max(room - config.clearance.least, 0.0) / REACTION_TIME
    most = MOST / config.arrival_timing.planned_share
    found = speed_between(HALF_WIDTH + room, config)
    np.testing.assert_allclose(found, min(expected, most), rtol=1e-6)
