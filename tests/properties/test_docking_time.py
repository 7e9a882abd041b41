"""The expected docking time divides by the speed of a cruise and by comfort: what holds around 0."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from math import inf
from typing import Any, Literal

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from geometry import Pose2, ReferencePath
from rti_mpcc.config import ControllerConfig, Weights
from rti_mpcc.errors import ConfigError
from rti_mpcc.planning.arrival import LEAST_TIME
from rti_mpcc.planning.timing import CRUISE_STEP, expected_docking_time
from tests.properties.magnitudes import few_examples, positive

Ride = Literal["smooth", "brisk"]
rides = st.sampled_from(("smooth", "brisk"))
STEP = CRUISE_STEP


def straight(length: float) -> ReferencePath:
    return ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, length)])


@contextmanager
def within(seconds: float) -> Iterator[None]:
    """Fails if the block takes longer [s]."""

    def stop(*_: Any) -> None:
        pytest.fail(f"not finished after {seconds:g} s")

    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


@given(rides, positive(1e-9, 500.0), st.floats(1.0, 3.0))
@example("smooth", 1e-9, 1.0)
@few_examples
def test_a_longer_path_never_takes_less_time(ride: Ride, length: float, longer: float) -> None:
    config = ControllerConfig(ride=ride)
    near, far = (expected_docking_time(straight(each), config) for each in (length, longer * length))
    assert near >= LEAST_TIME
    # A cruise is known to one of its steps.
    assert near <= far + STEP


@given(rides, positive(1e-3, 10.0))
@example("smooth", 1e-3)
@example("smooth", 1.0)
@few_examples
def test_a_goal_behind_the_start_takes_no_less_than_one_as_far_ahead(ride: Ride, back: float) -> None:
    config, path = ControllerConfig(ride=ride), straight(20.0)
    ahead = expected_docking_time(straight(back), config)
    behind = expected_docking_time(path, config, Pose2(-back, 0.0, 0.0))
    assert behind >= ahead * (1.0 - 1e-9)


@pytest.mark.parametrize("reward", [1e-6, 1e-3, 1e2, 1e7, 1e10])
def test_whatever_the_progress_is_worth_the_time_is_found_or_there_is_none(reward: float) -> None:
    config = ControllerConfig(weights=Weights(progress_reward=reward))
    with within(2.0):
        try:
            time = expected_docking_time(straight(1000.0), config)
        except ConfigError:
            return
    assert time < inf or reward < 1.0  # of no use: it hardly drives
    assert time >= 1000.0 / config.limits.speed
