"""Measured states are believed, doubted, and believed again."""

from __future__ import annotations

from collections.abc import Iterable
from math import inf, nan, pi
from typing import Any

import numpy as np
import pytest

from estimation import VehicleFilterConfig
from rti_mpcc.config import ControllerConfig
from rti_mpcc.model.delay import QueuedCommand
from rti_mpcc.planning.plausibility import CONFIRMATION, FROZEN_TRIES, StateMonitor, validate_measurement
from rti_mpcc.types import VehicleState

CONFIG = ControllerConfig(cycle=0.05)
CHECKS = CONFIG.plausibility


def cruising(now: float, **changes: Any) -> VehicleState:
    """Along x at 1 m/s."""
    usual = {"x": now, "y": 0.0, "phi": 0.0, "v": 1.0, "delta": 0.0}
    return VehicleState(**{**usual, **changes})


def standing(x: float = 0.0, **changes: Any) -> VehicleState:
    return VehicleState(**{"x": x, "y": 0.0, "phi": 0.0, "v": 0.0, "delta": 0.0, **changes})


def after(
    states: Iterable[VehicleState], monitor: StateMonitor | None = None, queue: tuple[QueuedCommand, ...] = ()
) -> StateMonitor:
    """After a cycle for each of these states, going on from where the trust ends."""
    monitor = monitor or StateMonitor(at=-CONFIG.cycle)
    for state in states:
        monitor = validate_measurement(monitor, state, queue, round(monitor.at + CONFIG.cycle, 9), CONFIG)
    return monitor


def driven(cycles: int = 10) -> StateMonitor:
    return after(cruising(k * CONFIG.cycle) for k in range(cycles))


def believed(monitor: StateMonitor) -> list[float]:
    assert monitor.state is not None
    return [float(value) for value in monitor.state[:5]]


def test_what_is_measured_is_believed() -> None:
    monitor = driven()
    assert monitor.why == ""
    assert believed(monitor) == [0.45, 0.0, 0.0, 1.0, 0.0]


@pytest.mark.parametrize("value", [nan, inf, -inf, 1e300, 1e11])
@pytest.mark.parametrize("field", ["x", "y", "phi", "v", "delta"])
def test_what_no_vehicle_can_be_is_not_believed_and_reckoned_from_the_commands(
    field: str, value: float
) -> None:
    monitor = after([cruising(0.5, **{field: value})], driven())
    assert ("not a finite state" if abs(value) > 1e301 or value != value else "not a state") in monitor.why
    assert believed(monitor)[:4] == pytest.approx([0.5, 0.0, 0.0, 1.0])
    again = after([cruising(0.55)], monitor)
    assert (again.why, again.found) == ("", False)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (None, "state is no VehicleState but None"),
        ((1.0, 2.0, 0.0, 0.0, 0.0), "state is no VehicleState but a tuple"),
        (standing(phi="east"), "state.phi is no number but 'east'"),
        (standing(v=None), "state.v is no number but None"),
        (standing(x=10**400), "state.x is no number but 1000000"),
    ],
)
def test_what_is_no_state_at_all_is_told_by_its_type(given: Any, said: str) -> None:
    for before in (None, driven()):
        monitor = after([given], before)
        assert monitor.why.startswith(said)
        assert len(monitor.why) < 80
    assert believed(monitor)[:4] == pytest.approx([0.5, 0.0, 0.0, 1.0])


def test_a_state_that_stays_infinite_is_not_reckoned_with() -> None:
    monitor = after([cruising(0.5, x=inf)] * 5, driven())
    assert believed(monitor)[0] == pytest.approx(0.7)
    assert after([cruising(0.75)], monitor).why == ""


def test_without_any_state_nothing_is_believed() -> None:
    monitor = after([cruising(0.0, x=nan), cruising(0.05, x=nan)])
    assert monitor.state is None
    assert monitor.since == 0.0
    assert after([cruising(0.1)], monitor).why == ""


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"y": 0.4}, "position by 0.40 m"),
        ({"phi": 0.5}, "heading by 0.50 rad"),
        ({"v": 2.5}, "speed by 1.50 m/s"),
        ({"delta": 0.5}, "steering by 0.50 rad"),
    ],
)
def test_a_jump_is_doubted_and_a_step_that_can_be_is_not(change: dict[str, float], word: str) -> None:
    jumped = after([cruising(0.5, **change)], driven())
    assert word in jumped.why
    assert believed(jumped)[:2] == pytest.approx([0.5, 0.0])
    (field, value), usual = next(iter(change.items())), cruising(0.5)
    small = getattr(usual, field) + 0.6 * (value - getattr(usual, field))
    if field != "delta":  # so much too fast a steering is obstinate
        assert after([cruising(0.5, **{field: small})], driven()).why == ""


@pytest.mark.parametrize("turn", [2.0 * pi, -2.0 * pi])
def test_another_branch_of_the_heading_is_no_jump(turn: float) -> None:
    assert after([cruising(0.5, phi=turn)], driven()).why == ""


def test_the_speed_of_a_vehicle_set_down_elsewhere_is_believed() -> None:
    """It has to brake by what it is measured to do."""
    monitor = after([cruising(0.5, y=3.0, v=0.8)], driven())
    assert believed(monitor)[3] == 0.8


def test_a_vehicle_that_moves_and_is_measured_in_one_place_is_reckoned_further() -> None:
    assert after([cruising(0.45)] * 3, driven()).why == ""  # a sensor may be slower than the controller
    monitor = after([cruising(0.45)] * 6, driven())
    assert "does not change" in monitor.why
    assert believed(monitor)[0] == pytest.approx(0.75)
    assert monitor.since == pytest.approx(0.7)  # 0.25 m further
    assert after([cruising(0.8)], monitor).why == ""


def test_a_vehicle_that_should_have_begun_to_move_is_not_measured() -> None:
    moving = (QueuedCommand(-1.0, 0.5, 0.0),)
    monitor = after([standing()] * 20, queue=moving)
    assert "does not change" in monitor.why
    assert after([standing()] * 200).why == ""


def test_steering_that_does_not_follow_is_found_out_and_given_its_time() -> None:
    turning = (QueuedCommand(-1.0, 0.0, 0.5),)
    states = [cruising(k * CONFIG.cycle) for k in range(12)]
    monitor = after(states, queue=turning)
    assert "the steering does not follow" in monitor.why
    assert believed(monitor)[3] == 1.0
    stopped = after([standing(0.6)] * 20, monitor)
    assert "steering" in stopped.why
    rested = after([standing(0.6)] * 100, monitor)
    assert (rested.why, rested.steering_gap) == ("", 0.0)


def test_a_steering_that_follows_with_noise_and_a_lag_is_not_obstinate() -> None:
    turning = (QueuedCommand(-1.0, 0.0, 0.2),)
    lag = [cruising(k * 0.05, delta=0.2 * max(k * 0.05 - 0.2, 0.0) + 0.01 * (-1) ** k) for k in range(60)]
    monitor = after(lag[:1], queue=turning)
    for state in lag[1:]:
        monitor = after([state], monitor, turning)
        assert monitor.why == ""


def test_a_vehicle_that_was_set_down_elsewhere_is_there_once_it_has_stood_there() -> None:
    jumped = after([cruising(0.5, y=3.0)], driven())
    rolling = after([cruising(0.5 + k * 0.05, y=3.0) for k in range(1, 100)], jumped)
    assert rolling.why != ""
    there = standing(5.5, y=3.0)
    cycles = round(CONFIRMATION / CONFIG.cycle)
    almost = after([there] * (cycles - 1), rolling)
    assert almost.why != ""
    found = after([there] * 3, almost)
    assert found.why == ""
    assert believed(found)[1] == 3.0


def test_measurements_that_disagree_with_one_another_are_never_believed() -> None:
    wild = [standing(0.0, y=3.0 + 2.0 * (k % 2)) for k in range(300)]
    monitor = after([standing()])
    for state in wild:
        monitor = after([state], monitor)
        assert monitor.why != ""


def test_after_a_gap_a_measurement_is_taken_as_it_is() -> None:
    monitor = validate_measurement(driven(), cruising(9.0, y=5.0), (), 3.0, CONFIG)
    assert (monitor.why, monitor.found) == ("", True)
    assert validate_measurement(driven(), cruising(9.0, y=nan), (), 3.0, CONFIG).why != ""


def test_another_problem_is_doubt_too_and_counts_from_its_begin() -> None:
    monitor = driven()
    first = after([cruising(0.5)], monitor).doubting("obstacles not readable", monitor)
    assert (first.why, first.since) == ("obstacles not readable", 0.5)
    assert believed(first)[0] == 0.5
    second = after([cruising(0.55)], first).doubting("obstacles not readable", first)
    assert second.since == 0.5
    assert after([cruising(0.6)], second).why == ""


def test_a_bad_measurement_after_a_gap_is_no_better_known_than_the_gap() -> None:
    spoiled = validate_measurement(driven(), cruising(3.0, y=nan), (), 3.0, CONFIG)
    assert spoiled.why != ""
    assert believed(spoiled)[0] == pytest.approx(0.45 + 1.0)  # rolled forward, but not for ever
    found = validate_measurement(spoiled, cruising(3.05, y=0.5), (), 3.05, CONFIG)
    assert (found.why, found.found, found.gap) == ("", True, False)
    assert believed(found)[:2] == [3.05, 0.5]


def test_a_vehicle_that_cannot_move_is_tried_again_each_time_after_twice_the_time() -> None:
    """Its state is told in round numbers; by its commands it begins to move and brakes again."""
    monitor, tried = after([standing()]), [0.0]
    for _ in range(2000):
        since = monitor.at - tried[-1]
        pushed = 1.0 if since < 1.0 else -1.0 if since < 2.0 else 0.0
        queue = (QueuedCommand(-1.0, pushed, 0.0),)
        monitor = after([standing()], monitor, queue)
        if monitor.found:
            tried.append(monitor.at)
    assert monitor.why != ""
    assert monitor.tries == FROZEN_TRIES
    waits = np.diff(tried)
    assert len(waits) == FROZEN_TRIES
    np.testing.assert_allclose(np.diff(waits), CONFIRMATION * np.array([1.0, 2.0]), atol=0.2)
    assert after([standing(x=0.001)] * 200, monitor, (QueuedCommand(-1.0, 0.0, 0.0),)).why == ""


def test_only_for_a_moment_may_measurements_that_contradict_one_another_hold_a_command_back() -> None:
    monitor = after([cruising(0.5, v=31.0)], driven())
    assert monitor.heeded(CONFIG) is monitor.measured
    lasting = after([cruising(0.5 + 0.05 * k, v=31.0) for k in range(1, 9)], monitor)
    assert lasting.why != ""
    heeded = lasting.heeded(CONFIG)
    assert heeded is not None
    assert lasting.measured is not None
    assert np.isnan(heeded[3])
    np.testing.assert_array_equal(np.delete(heeded, 3), np.delete(lasting.measured, 3))
    # One that drives as fast as it is measured may be right.
    fast = after([cruising(0.5 + 0.6 * k, v=12.0) for k in range(1, 9)], driven())
    assert fast.why != ""
    assert fast.heeded(CONFIG) is fast.measured
    # What stands has nothing to brake.
    stood = after([standing(v=31.0)] * 9, after([standing()]))
    assert stood.heeded(CONFIG) is stood.measured


def noisy(count: int, seed: int = 4) -> list[VehicleState]:
    """Cruising, as it is measured with noise of 1.5 cm."""
    random = np.random.default_rng(seed)
    return [
        cruising(
            k * CONFIG.cycle, x=k * CONFIG.cycle + random.normal(0.0, 0.015), y=random.normal(0.0, 0.015)
        )
        for k in range(count)
    ]


def test_of_noisy_measurements_the_noise_is_not_believed() -> None:
    monitor, off = StateMonitor(at=-CONFIG.cycle), []
    for k, state in enumerate(noisy(200)):
        monitor = after([state], monitor)
        x, y, *_ = believed(monitor)
        off.append((x - k * CONFIG.cycle, y))
    assert monitor.why == ""
    assert np.std(off[60:], axis=0) == pytest.approx((0.0, 0.0), abs=0.007)
    assert monitor.noise.stds[:2] == pytest.approx((0.015, 0.015), rel=0.4)


def test_without_the_filter_it_is_what_is_measured() -> None:
    plain = CONFIG.model_copy(update={"vehicle_filter": VehicleFilterConfig(enabled=False)})
    monitor = StateMonitor(at=-CONFIG.cycle)
    for state in noisy(20):
        monitor = validate_measurement(monitor, state, (), round(monitor.at + CONFIG.cycle, 9), plain)
        assert believed(monitor)[:2] == [state.x, state.y]


def test_a_measurement_told_once_more_is_believed_and_tells_nothing_of_the_noise() -> None:
    states = noisy(60)
    monitor = after(states)
    again = after([states[-1]], monitor)
    assert believed(again)[:2] == [states[-1].x, states[-1].y]
    assert again.noise.pairs == monitor.noise.pairs


def test_after_a_doubt_the_state_is_what_is_measured_and_the_noise_is_known_still() -> None:
    monitor = after(noisy(100))
    known = monitor.noise.variance
    monitor = after([cruising(5.0, x=nan)], monitor)
    assert monitor.why
    monitor = after([cruising(5.05)], monitor)
    assert monitor.why == ""
    assert believed(monitor)[0] == 5.05
    assert monitor.noise.variance is known
