from __future__ import annotations

from math import cos, sin

import numpy as np
import pytest

from rti_mpcc.model.layout import DELTA, DELTA_DOT, PHI, THETA, THETA_DOT, A, V, X, Y
from rti_mpcc.ocp.horizon import distances, resample, stage_lengths, stage_times, states_at
from rti_mpcc.types import Array, Trajectory
from tests.rti_mpcc.model_steps import step

WHEELBASE = 2.875


def test_short_horizons_are_uniform_and_long_ones_grow() -> None:
    short, long = stage_lengths(6.0, 0.05, 70), stage_lengths(25.0, 0.05, 70)
    np.testing.assert_allclose(short[1:], short[1])
    assert long[1] < 0.11
    assert long[-1] > 5.0 * long[1]


@pytest.mark.parametrize("beyond", [0.0, 1e-15, 1e-12, 1e-9, 1e-7, 1e-6, 7e-6, 1e-5, 1e-3])
def test_durations_just_beyond_the_uniform_ones_have_lengths_too(beyond: float) -> None:
    """The growth is then lost in rounding: an arrival whose time falls in round steps comes past here."""
    lengths = stage_lengths(6.95 + beyond, 0.05, 70)
    assert lengths.sum() == pytest.approx(6.95 + beyond, rel=1e-12)
    np.testing.assert_allclose(lengths[1:], 0.1, rtol=1e-3)


def driven(lengths: Array, controls: Array, state: Array, begin: float = 2.0) -> Trajectory:
    states = [state]
    for control, length in zip(controls, lengths, strict=True):
        states.append(step(states[-1][None], control[None], np.array([length]), WHEELBASE)[0])
    return Trajectory(times=stage_times(begin, lengths), states=np.array(states), controls=controls)


@pytest.fixture
def winding() -> Trajectory:
    lengths = stage_lengths(8.0, 0.05, 40)
    t = np.cumsum(lengths)
    controls = np.column_stack([0.5 * np.cos(t), 0.2 * np.sin(2.0 * t), 1.0 + 0.3 * np.sin(t)])
    return driven(lengths, controls, np.array([3.0, 4.0, 1.0, 1.5, 0.1, 7.0]))


def test_integrals_of_controls_are_kept(winding: Trajectory) -> None:
    times = np.linspace(winding.times[0], winding.times[-1], 24)
    again = resample(winding, times, WHEELBASE)
    whole = (winding.controls * np.diff(winding.times)[:, None]).sum(axis=0)
    np.testing.assert_allclose((again.controls * np.diff(times)[:, None]).sum(axis=0), whole, atol=1e-12)
    # So speed, steering and progress go with the states at every stage's end.
    rise = np.diff(again.states[:, [V, DELTA, THETA]], axis=0)
    np.testing.assert_allclose(again.controls * np.diff(times)[:, None], rise, atol=1e-12)


def test_between_stages_the_pose_follows_the_curve(winding: Trajectory) -> None:
    """Against a fine roll-out of the same controls."""
    k, share = 12, 0.4
    h = share * (winding.times[k + 1] - winding.times[k])
    fine = winding.states[k : k + 1]
    for _ in range(50):
        fine = step(fine, winding.controls[k : k + 1], np.array([h / 50.0]), WHEELBASE)
    got = states_at(winding, np.array([winding.times[k] + h]), WHEELBASE)
    np.testing.assert_allclose(got, fine, atol=1e-4)


def test_outside_the_plan_the_motion_goes_on_straight_or_is_held(winding: Trajectory) -> None:
    last = winding.states[-1]
    beyond = states_at(winding, winding.times[-1:] + 2.0, WHEELBASE)[0]
    assert beyond[X] == pytest.approx(last[X] + 2.0 * last[V] * cos(last[PHI]))
    assert beyond[Y] == pytest.approx(last[Y] + 2.0 * last[V] * sin(last[PHI]))
    np.testing.assert_allclose(beyond[[PHI, V, DELTA]], last[[PHI, V, DELTA]])
    assert beyond[THETA] == pytest.approx(last[THETA] + 2.0 * winding.controls[-1, THETA_DOT])
    held = states_at(winding, winding.times[:1] - 1.0, WHEELBASE)[0]
    np.testing.assert_allclose(held, winding.states[0])
    outside = resample(winding, winding.times[-1] + np.array([1.0, 2.0]), WHEELBASE).controls[0]
    assert outside[A] == 0.0
    assert outside[DELTA_DOT] == 0.0
    assert outside[THETA_DOT] == pytest.approx(winding.controls[-1, THETA_DOT])


def test_distances_are_those_of_the_chords(winding: Trajectory) -> None:
    steps = np.diff(winding.states[:, [X, Y]], axis=0)
    np.testing.assert_allclose(distances(winding.states)[1:], np.cumsum(np.hypot(*steps.T)), rtol=1e-12)
