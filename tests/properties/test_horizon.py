"""Stages: lengths that grow divide by a growth, resampled plans by the length of a stage."""

from __future__ import annotations

import numpy as np
from hypothesis import example, given
from hypothesis import strategies as st

from rti_mpcc.model.layout import CONTROLS, STATES, THETA, THETA_DOT, A, V, X
from rti_mpcc.ocp.horizon import FINE_STAGE, resample, stage_lengths, stage_times, states_at
from rti_mpcc.types import Array, Trajectory
from tests.properties.magnitudes import examples, positive, signed

WHEELBASE = 2.875
cycles = positive(5e-3, 0.2)
counts = st.integers(10, 1000)
LATEST = 1e10
"""The latest time that a clock may show [s]."""


@given(positive(1e-6, 1e5), cycles, counts)
@example(0.0, 0.05, 70)
@example(1e-6, 0.2, 1000)
@example(300.0, 5e-3, 10)
@example(0.05 + 69 * 0.1, 0.05, 70)  # exactly as long as equal stages are
@example((0.05 + 69 * 0.1) * (1.0 + 1e-9), 0.05, 70)
@example((0.05 + 999 * 0.1) * (1.0 + 2e-6), 0.05, 1000)
@examples
def test_stages_are_positive_add_up_to_the_duration_and_never_get_shorter(
    duration: float, cycle: float, count: int
) -> None:
    lengths = stage_lengths(duration, cycle, count)
    assert lengths.shape == (count,)
    assert lengths[0] == cycle
    assert (lengths > 0.0).all()
    np.testing.assert_allclose(lengths.sum(), max(duration, 3.0 * cycle), rtol=1e-9)
    assert (np.diff(lengths[1:]) >= -1e-12 * lengths[1:-1]).all()
    np.testing.assert_allclose(lengths[2:] / lengths[1:-1], lengths[2] / lengths[1], rtol=1e-9)
    assert lengths[1] <= FINE_STAGE * (1.0 + 1e-5)


@given(st.floats(0.0, LATEST), positive(1e-6, 300.0), cycles, counts)
@example(LATEST, 1e-6, 5e-3, 1000)
@examples
def test_the_times_of_a_plan_rise_at_any_time_that_a_clock_may_show(
    begin: float, duration: float, cycle: float, count: int
) -> None:
    times = stage_times(begin, stage_lengths(duration, cycle, count))
    assert (np.diff(times) > 0.0).all()


def plan_of(lengths: Array, speed: float, acceleration: float) -> Trajectory:
    """Straight on at a constant acceleration [m/s²], its progress that of its way."""
    times = np.append(0.0, np.cumsum(lengths))
    states, controls = np.zeros((len(times), STATES)), np.zeros((len(lengths), CONTROLS))
    states[:, V] = speed + acceleration * times
    states[:, X] = states[:, THETA] = speed * times + 0.5 * acceleration * times**2
    controls[:, A] = acceleration
    controls[:, THETA_DOT] = np.diff(states[:, THETA]) / lengths
    return Trajectory(times=times, states=states, controls=controls)


lengths_of_stages = st.lists(positive(1e-5, 10.0), min_size=2, max_size=12).map(np.array)


@given(lengths_of_stages, lengths_of_stages, signed(1e-6, 10.0), signed(1e-6, 5.0), st.floats(-5.0, 30.0))
@example(np.array([1e-5, 1e-5]), np.array([10.0, 10.0]), 1.0, 0.0, 0.0)
@example(np.array([10.0, 1e-5]), np.array([1e-5, 1e-5]), 0.0, 0.0, -5.0)
@examples
def test_a_plan_on_another_grid_is_the_same_motion(
    own: Array, other: Array, speed: float, acceleration: float, begin: float
) -> None:
    plan = plan_of(own, speed, acceleration)
    times = np.append(begin, begin + np.cumsum(other))
    found = resample(plan, times, WHEELBASE)
    inside = (times >= 0.0) & (times <= plan.times[-1])
    at = times[inside]
    scale = 1.0 + abs(speed) * 200.0 + abs(acceleration) * 2e4
    np.testing.assert_allclose(found.states[inside, V], speed + acceleration * at, atol=1e-9 * scale)
    np.testing.assert_allclose(
        found.states[inside, X], speed * at + 0.5 * acceleration * at**2, atol=1e-9 * scale
    )
    assert np.isfinite(found.states).all()
    # Means of the controls are never above what they are means of.
    assert np.abs(found.controls[:, A]).max() <= abs(acceleration) * (1.0 + 1e-4) + 1e-9
    gained = found.controls[:, THETA_DOT] @ np.diff(times)
    passed = states_at(plan, times[[0, -1]], WHEELBASE)[:, THETA]
    assert abs(gained - (passed[1] - passed[0])) <= 1e-6 * scale
