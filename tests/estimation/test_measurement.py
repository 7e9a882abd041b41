"""Detections put into the world: Eq. (E1), (E2), the noise law by range, and what is refused."""

from __future__ import annotations

from math import pi
from typing import Any

import numpy as np
import pytest

from estimation import DetectionNoise, Frame, GoalFilterConfig, GoalMeasurement
from estimation.measurement import Detection, in_world
from geometry import InputError, Pose2
from tests.estimation.detections import Array

CONFIG = GoalFilterConfig(vehicle_position_std=0.03, vehicle_heading_std=0.02)
VEHICLE = Pose2(2.0, -7.0, 2.4)
SEEN: dict[str, Any] = {"stamp": 1.5, "x": -6.0, "y": 1.2, "phi": 0.9}
SPREAD = np.array([[4e-3, -1e-3, 2e-4], [-1e-3, 1e-3, 1e-4], [2e-4, 1e-4, 2e-3]])
STEP = 1e-6


def detected(config: GoalFilterConfig = CONFIG, **given: Any) -> Detection:
    found = in_world(GoalMeasurement(**(SEEN | given)), config)
    assert isinstance(found, Detection)
    return found


def goal(vehicle: Array, seen: Array) -> Array:
    """Eq. (E1) by `Pose2`, as a function of numbers."""
    at = Pose2(*vehicle).compose(Pose2(*seen))
    return np.array([at.x, at.y, at.phi])


def differences(vehicle: Array, seen: Array) -> tuple[Array, Array]:
    """Central differences (3, 3) of the goal by the vehicle pose and by the detection."""
    columns = np.eye(3) * STEP
    by_vehicle = [(goal(vehicle + d, seen) - goal(vehicle - d, seen)) / (2.0 * STEP) for d in columns]
    by_seen = [(goal(vehicle, seen + d) - goal(vehicle, seen - d)) / (2.0 * STEP) for d in columns]
    return np.transpose(by_vehicle), np.transpose(by_seen)


def test_a_detection_in_the_world_stays_as_it_is() -> None:
    found = detected(covariance=SPREAD, vehicle=VEHICLE)
    assert found.stamp == 1.5
    assert found.value == pytest.approx(np.array([-6.0, 1.2, 0.9]))
    assert np.array_equal(found.covariance, SPREAD)
    assert found.pose == Pose2(-6.0, 1.2, 0.9)


@pytest.mark.parametrize("heading", [-3.1, -0.4, 0.0, 1.0, pi])
@pytest.mark.parametrize("distance", [0.0, 1.0, 40.0])
def test_the_covariance_is_that_of_the_linearised_chain(heading: float, distance: float) -> None:
    """Eq. (E2) against finite differences of Eq. (E1)."""
    vehicle, seen = np.array([2.0, -7.0, heading]), np.array([0.8 * distance, -0.6 * distance, 0.9])
    found = detected(
        x=seen[0], y=seen[1], phi=seen[2], frame=Frame.VEHICLE, vehicle=Pose2(*vehicle), covariance=SPREAD
    )
    by_vehicle, by_seen = differences(vehicle, seen)
    own = np.diag(np.square([0.03, 0.03, 0.02]))
    expected = by_seen @ SPREAD @ by_seen.T + by_vehicle @ own @ by_vehicle.T
    assert found.covariance == pytest.approx(expected, rel=1e-7, abs=1e-10)
    assert np.array_equal(found.covariance, found.covariance.T)


@pytest.mark.parametrize(
    ("given", "distance"),
    [
        ({"frame": Frame.VEHICLE, "vehicle": VEHICLE, "x": 3.0, "y": -4.0}, 5.0),
        ({"vehicle": VEHICLE, "x": 2.0 + 3.0, "y": -7.0 + 4.0}, 5.0),
        ({}, 10.0),
        ({"vehicle": VEHICLE, "x": 2.0, "y": -7.0}, 0.0),
    ],
)
def test_without_a_covariance_the_noise_follows_from_the_range(
    given: dict[str, Any], distance: float
) -> None:
    """As far as it is known: else it is that of the reference range."""
    exact = GoalFilterConfig(vehicle_position_std=0.0, vehicle_heading_std=0.0)
    found = detected(exact, **given)
    assert found.covariance == pytest.approx(DetectionNoise().covariance(distance))


def test_a_detection_from_a_vehicle_that_was_somewhere_unknown_is_refused() -> None:
    reason = in_world(GoalMeasurement(**SEEN, frame=Frame.VEHICLE), CONFIG)
    assert reason == "where the vehicle was at stamp 1.500 s is not known"


@pytest.mark.parametrize("vehicle", [Pose2(1e7, 0.0, 0.0), Pose2(0.0, -1e300, 0.0), Pose2(0.0, 0.0, 1e300)])
@pytest.mark.parametrize("frame", Frame)
def test_a_vehicle_beyond_all_bounds_is_refused(vehicle: Pose2, frame: Frame) -> None:
    reason = in_world(GoalMeasurement(**SEEN, frame=frame, vehicle=vehicle), CONFIG)
    assert isinstance(reason, str)
    assert reason.startswith("beyond 1e+06: Pose2")


@pytest.mark.parametrize("covariance", [np.eye(2), 5.0, "abc", [[1.0, 2.0], [3.0]], [[1j] * 3] * 3])
def test_a_covariance_that_is_not_three_by_three_numbers_raises(covariance: Any) -> None:
    with pytest.raises(InputError, match=r"covariance .*must be \(3, 3\)"):
        GoalMeasurement(**SEEN, covariance=covariance)
