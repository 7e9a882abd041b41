"""Odometers of pose, speed and commands on an arc, and the speed of the pose."""

from __future__ import annotations

from math import cos, sin, tan

import numpy as np
import pytest

from estimation.odometry import (
    ALONG,
    ASIDE,
    DELTA,
    DRIVEN,
    PHI,
    POSE_SPEED,
    REPORTED,
    TURNED,
    CommandedChange,
    Geometry,
    distances_at,
    moved_on,
    track_from,
)
from estimation.sensors import Sensors, compare_sensors
from estimation.vehicle_filter import Noise

H, WHEELBASE = 0.05, 2.5
BODY = Geometry(WHEELBASE, 0.6)
EXACT = Noise()


def arc(k: int, speed: float, delta: float) -> np.ndarray:
    """The state (6,) after k cycles at constant speed and steering."""
    curvature = tan(delta) / WHEELBASE
    phi = curvature * speed * H * k
    return np.array((sin(phi) / curvature, (1.0 - cos(phi)) / curvature, phi, speed, delta, 0.0))


@pytest.mark.parametrize("speed", [0.8, -0.8])
def test_on_an_arc_all_odometers_agree(speed: float) -> None:
    delta = 0.3
    track = track_from(0.0, arc(0, speed, delta), arc(0, speed, delta))
    for k in range(1, 21):
        track = moved_on(
            track, k * H, arc(k, speed, delta), CommandedChange(0.0, 0.0, delta, 0.0), EXACT, WHEELBASE
        )
    last, way = track[-1], speed * H * 20
    assert last[ALONG] == pytest.approx(way, rel=1e-4)
    assert last[REPORTED] == pytest.approx(way)
    assert last[DRIVEN] == pytest.approx(way)
    assert last[ASIDE] == pytest.approx(0.0, abs=1e-9)
    assert last[TURNED] == pytest.approx(last[PHI], rel=1e-4)
    assert last[POSE_SPEED] == pytest.approx(speed, abs=1e-3)


def test_a_distance_is_told_at_any_time_in_between() -> None:
    track = track_from(0.0, arc(0, 1.0, 0.1), arc(0, 1.0, 0.1))
    for k in range(1, 11):
        track = moved_on(
            track, k * H, arc(k, 1.0, 0.1), CommandedChange(0.0, 0.0, 0.1, 0.0), EXACT, WHEELBASE
        )
    assert distances_at(track, 0.33) == pytest.approx((0.33, 0.33))
    assert distances_at(track, -1.0)[0] == 0.0


@pytest.mark.parametrize(("share", "left_out"), [(1.0, False), (1.03, False), (0.8, True), (1.2, True)])
def test_a_speed_is_left_out_by_what_pose_and_commands_agree_on(share: float, left_out: bool) -> None:
    known, speed = Sensors(track=track_from(0.0, np.zeros(6), np.zeros(6))), 0.0
    x = 0.0
    for k in range(1, 41):
        asked = 0.4 * H
        x += H * (speed + 0.5 * asked)
        speed += asked
        state = np.array((x, 0.0, 0.0, share * speed, 0.0, 0.0))
        known = compare_sensors(known, k * H, state, CommandedChange(asked, 0.0, 0.0, asked), EXACT, BODY)
    assert bool(known.speed.problem) == left_out
    assert not known.pose
    assert known.usable(state, WHEELBASE)[3] == pytest.approx(speed if left_out else share * speed, abs=0.02)


@pytest.mark.parametrize(
    ("says", "stands", "left_out"),
    [(0.4, 0.3, False), (1.2, 1.1, False), (0.0, 1.1, True), (-1.1, 1.1, True)],
)
def test_far_out_a_small_offset_of_the_steering_is_no_disagreement(
    says: float, stands: float, left_out: bool
) -> None:
    """Its tangent is five times as steep there as straight ahead."""
    track = track_from(0.0, arc(0, 0.9, stands), arc(0, 0.9, stands))
    known, change = Sensors(track=track), CommandedChange(0.0, 0.0, stands, 0.0)
    track[0, DELTA] = says
    for k in range(1, 41):
        state = arc(k, 0.9, stands)
        state[4] = says
        known = compare_sensors(known, k * H, state, change, EXACT, BODY._replace(steering=1.2))
    assert bool(known.steering.problem) is left_out


def test_a_steering_sensor_that_stays_is_told_by_the_largest_change_commanded_meanwhile() -> None:
    """To -0.02 rad and then to +0.016: never 0.03 rad from where it stopped, but in between."""
    known = Sensors(track=track_from(0.0, np.zeros(6), np.zeros(6)))
    wheels, told = np.interp(np.arange(48) * H, (0.0, 1.0, 2.0), (0.0, -0.02, 0.016)), {}
    for k in range(1, len(wheels)):
        change = CommandedChange(0.0, float(wheels[k] - wheels[k - 1]), float(wheels[k - 1]), 0.0)
        known = compare_sensors(known, k * H, np.zeros(6), change, EXACT, BODY)
        told[k * H] = known.unmoved
    first = min(at for at, words in told.items() if words)
    assert first == pytest.approx(1.0 + 0.03 / 0.036 + 0.3, abs=2 * H)  # after the longest dead time
    assert "a change by +0.03 rad was commanded" in told[first]


@pytest.mark.parametrize("delta", [0.01, 0.05, -0.05])
def test_a_pose_that_is_corrected_by_a_map_is_not_that_of_another_point(delta: float) -> None:
    known = Sensors(track=track_from(0.0, arc(0, 1.0, delta), arc(0, 1.0, delta)))
    for k in range(1, 60):
        state = arc(k, 1.0, delta)
        state[:3] += (0.0, 0.06, 0.02) if k > 30 else 0.0
        known = compare_sensors(known, k * H, state, CommandedChange(0.0, 0.0, delta, 0.0), EXACT, BODY)
        assert not known.elsewhere
