"""Filters near what their formulas divide by: times, ranges and variances of 0, wheels across the vehicle."""

from __future__ import annotations

from math import inf, nextafter, pi, tan

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from estimation import (
    DisturbanceFilterConfig,
    Frame,
    GoalFilterConfig,
    GoalMeasurement,
    GoalPoseFilter,
    MeasurementNoise,
    PoseHistory,
)
from estimation.disturbance import Motion, first_estimate, updated
from estimation.vehicle_filter import QUANTITIES, Elapsed, filtered
from geometry import Pose2, wrap

FEW = settings(derandomize=True, deadline=None, max_examples=60)

SPANS = st.one_of(st.sampled_from([1e-16, 1e-12, 1e-9, 1e-6, 1e-3]), st.floats(0.01, 0.4))
"""Between two stamps [s]: two cycles may follow one another at once."""
VARIANCES = st.one_of(st.just(0.0), st.floats(-20.0, 4.0).map(lambda n: 10.0**n))
COORDINATES = st.floats(-10.0, 10.0)
POSES = st.builds(Pose2, COORDINATES, COORDINATES, st.floats(-pi, pi))


# -- poses by time -------------------------------------------------------------------------------------------


@FEW
@given(first=POSES, last=POSES, span=SPANS, share=st.floats(0.0, 1.0))
@example(first=Pose2(0.0, 0.0, 0.0), last=Pose2(1.0, 0.0, 0.0), span=1e-16, share=0.5)
def test_between_two_stamps_a_pose_is_between_their_poses(
    first: Pose2, last: Pose2, span: float, share: float
) -> None:
    history = PoseHistory().noted(0.0, first, length=1.0).noted(span, last, length=1.0)
    found = history.at(share * span)
    assert found is not None
    assert min(first.x, last.x) - 1e-9 <= found.x <= max(first.x, last.x) + 1e-9
    assert min(first.y, last.y) - 1e-9 <= found.y <= max(first.y, last.y) + 1e-9
    assert abs(wrap(found.phi - first.phi)) <= abs(wrap(last.phi - first.phi)) + 1e-9


@FEW
@given(
    spans=st.lists(SPANS, min_size=1, max_size=4),
    off=st.floats(-1e-3, 1e-3),
    ahead=st.floats(0.0, 0.05),
    speed=st.floats(-3.0, 3.0),
)
@example(spans=[0.05, 0.05], off=1e-3, ahead=0.05, speed=1.0)
@example(spans=[0.05, 1e-9], off=1e-3, ahead=0.05, speed=1.0)
@example(spans=[1e-9], off=1e-3, ahead=0.05, speed=0.0)
def test_ahead_of_the_latest_pose_a_pose_is_no_farther_than_the_vehicle_can_have_driven(
    spans: list[float], off: float, ahead: float, speed: float
) -> None:
    # The vehicle drives at a steady speed. The errors of its poses are `off` and -`off`, one after the other.
    history, at = PoseHistory().noted(1.0, Pose2(-off, 0.0, 0.0), length=2.0), 1.0
    for k, span in enumerate(spans):
        at = max(at + span, nextafter(at, inf))
        history = history.noted(at, Pose2(speed * (at - 1.0) + (-1) ** k * off, 0.0, 0.0), length=2.0)
    latest = history.poses[-1]
    found = history.at(at + ahead, ahead=ahead + 1e-9)
    if found is not None:
        assert abs(found.x - latest.x) <= abs(speed) * ahead + 20.0 * abs(off) + 1e-9


# -- detections ----------------------------------------------------------------------------------------------


@FEW
@given(
    stamps=st.lists(st.sampled_from([0.0, 1e-12, 0.1, 0.1, 0.2]), min_size=2, max_size=5),
    x=st.sampled_from([0.0, 1e-300, 1e-9, 5.0]),
    scale=st.sampled_from([None, 1e-18, 1e-9, 1.0, 1e12]),
    moving=st.booleans(),
)
@example(stamps=[0.0, 0.0, 0.0], x=0.0, scale=None, moving=False)
@example(stamps=[0.0, 0.0, 0.0], x=0.0, scale=1e-18, moving=True)
def test_an_estimate_is_finite_for_detections_at_a_range_of_0_and_at_one_time(
    stamps: list[float], x: float, scale: float | None, moving: bool
) -> None:
    config = GoalFilterConfig(moving=moving, vehicle_position_std=0.0, vehicle_heading_std=0.0)
    goals = GoalPoseFilter(config)
    for k, stamp in enumerate(stamps):
        covariance = None if scale is None else scale * np.eye(3)
        judgement = goals.update(
            GoalMeasurement(
                stamp=stamp,
                x=x,
                y=0.0,
                phi=1e-12 * k,
                covariance=covariance,
                frame=Frame.VEHICLE,
                vehicle=Pose2(1.0, 2.0, 0.3),
            )
        )
        assert judgement.nis is None or judgement.nis >= 0.0
    found = goals.estimate(max(stamps))
    if found.pose is not None:
        assert found.covariance is not None
        assert np.linalg.eigvalsh(found.covariance)[0] >= -1e-12 * float(np.trace(found.covariance))
        assert (found.pose.x, found.pose.y) == pytest.approx(
            (1.0 + x * np.cos(0.3), 2.0 + x * np.sin(0.3)), abs=1e-6
        )


# -- the vehicle's own state ---------------------------------------------------------------------------------


@FEW
@given(
    seconds=st.one_of(st.just(0.0), SPANS),
    variance=VARIANCES,
    off=st.lists(st.floats(-1.0, 1.0), min_size=5, max_size=5),
    run=st.integers(0, 100),
)
@example(seconds=0.0, variance=0.0, off=[0.1] * 5, run=0)
@example(seconds=0.0, variance=1e-4, off=[0.1] * 5, run=100)
@example(seconds=0.02, variance=1e-20, off=[0.1] * 5, run=100)
def test_a_state_is_between_what_is_measured_and_what_is_expected_and_near_what_is_measured(
    seconds: float, variance: float, off: list[float], run: int
) -> None:
    measured = np.array([1.0, 2.0, 0.0, 1.0, 0.1, 0.0])
    expected = measured + np.array([*off, 0.0])
    noise = MeasurementNoise(variance=np.full(QUANTITIES, variance), pairs=run, run=run)
    state, known = filtered(noise, measured, measured, expected, Elapsed(seconds, 0.0, 0.2))
    change = (state - measured)[:5]
    assert (change * np.array(off) >= -1e-15).all()
    assert (np.abs(change) <= np.abs(off) + 1e-12).all()
    assert (np.abs(change) <= 3.0 * np.array(known.stds) + 1e-12).all()


# -- what acts beside the commands ---------------------------------------------------------------------------

WHEELBASES = st.floats(0.05, 20.0)


@settings(FEW, max_examples=40)
@given(
    wheelbase=WHEELBASES,
    delta=st.floats(-1.4, 1.4),
    speed=st.sampled_from([0.0, 1e-12, 0.02, 1.0, -2.0]),
    spans=st.lists(st.one_of(st.just(0.0), SPANS), min_size=1, max_size=12),
    std=st.sampled_from([1e-9, 1e-4, 0.015]),
)
@example(wheelbase=2.875, delta=0.0, speed=0.0, spans=[0.0, 0.0], std=0.015)
@example(wheelbase=0.05, delta=1.4, speed=1.0, spans=[0.05] * 10, std=1e-9)
def test_estimated_offsets_are_finite_within_their_limits_and_no_less_sure_than_at_first(
    wheelbase: float, delta: float, speed: float, spans: list[float], std: float
) -> None:
    config = DisturbanceFilterConfig(speed_std=std, heading_std=std)
    found, now, phi = first_estimate(config), 0.0, 0.0
    first = found.stds
    for k, span in enumerate(spans):
        moved = Motion(speed + 1e-3 * (k % 2), phi, delta)
        found = updated(found, moved, now, 0.0, wheelbase, config)
        now, phi = now + span, phi + span * speed * tan(delta) / wheelbase
    assert np.isfinite(found.mean).all()
    assert np.isfinite(found.covariance).all()
    assert abs(found.acceleration) <= 3.0
    assert abs(found.steering) <= 0.1
    assert all(isinstance(now, float) for now in found.stds)
    assert found.stds[0] <= first[0] * (1.0 + 1e-9)
    assert found.stds[1] <= first[1] * (1.0 + 1e-9)
