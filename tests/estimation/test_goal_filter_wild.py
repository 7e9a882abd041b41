"""Whatever the filter is told, it raises nothing and its estimate stays an estimate."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from estimation import Frame, GoalFilterConfig, GoalMeasurement, GoalPoseFilter, GoalStatus
from geometry import Pose2
from tests.estimation.detections import age, covariance, numbers

ANY = st.floats(allow_nan=True, allow_infinity=True)
FINITE = st.floats(allow_nan=False, allow_infinity=False)
TIMES = st.one_of(st.floats(0.0, 4.0), st.floats(0.0, 4.0), st.floats(-1e10, 1e10), ANY)
NUMBERS = st.one_of(st.floats(-10.0, 10.0), st.floats(-10.0, 10.0), st.floats(-1e6, 1e6), ANY)


def squared(entries: list[float]) -> list[list[float]]:
    factor = np.array(entries).reshape(3, 3)
    return (factor @ factor.T).tolist()  # type: ignore[no-any-return]


COVARIANCES = st.one_of(
    st.none(),
    st.lists(st.floats(-4.0, 1.0), min_size=3, max_size=3).map(
        lambda e: np.diag(10.0 ** np.array(e)).tolist()
    ),
    st.lists(st.floats(-11.0, 7.0), min_size=3, max_size=3).map(
        lambda e: np.diag(10.0 ** (2.0 * np.array(e))).tolist()
    ),
    st.lists(st.floats(-1e3, 1e3), min_size=9, max_size=9).map(squared),
    st.lists(ANY, min_size=9, max_size=9).map(lambda entries: [entries[:3], entries[3:6], entries[6:]]),
)
VEHICLES = st.one_of(
    st.none(),
    st.builds(Pose2, *[st.floats(-10.0, 10.0)] * 3),
    st.builds(Pose2, FINITE, FINITE, FINITE),
)
MEASUREMENTS = st.builds(
    GoalMeasurement,
    stamp=TIMES,
    x=NUMBERS,
    y=NUMBERS,
    phi=NUMBERS,
    covariance=COVARIANCES,
    frame=st.sampled_from(Frame),
    vehicle=VEHICLES,
)
Event = Callable[[GoalPoseFilter], object]
EVENTS = st.one_of(
    TIMES.map(lambda now: lambda goal_filter: goal_filter.predict(now)),
    MEASUREMENTS.map(lambda measurement: lambda goal_filter: goal_filter.update(measurement)),
    MEASUREMENTS.map(lambda measurement: lambda goal_filter: goal_filter.update(measurement)),
)


@settings(deadline=None, max_examples=200, derandomize=True)
@given(events=st.lists(EVENTS, max_size=12), now=TIMES, moving=st.booleans(), confirmations=st.integers(1, 2))
def test_no_input_raises_or_spoils_the_estimate(
    events: list[Event], now: float, moving: bool, confirmations: int
) -> None:
    goal_filter = GoalPoseFilter(GoalFilterConfig(moving=moving, confirmations=confirmations))
    for event in events:
        event(goal_filter)
        estimate = goal_filter.estimate(now)
        if estimate.pose is None:
            assert estimate.status is GoalStatus.SEARCHING
            continue
        assert age(estimate) >= 0.0
        assert np.isfinite(numbers(estimate)).all()
        found = covariance(estimate)
        assert np.array_equal(found, found.T)
        spread = np.sqrt(np.diagonal(found))
        assert np.linalg.eigvalsh(found / np.outer(spread, spread)).min() > 0.0
