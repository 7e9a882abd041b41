"""Slopes and steering offsets are found from what was commanded and measured, on an own little vehicle."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import radians, tan

import numpy as np
import pytest

from estimation import DisturbanceEstimate, DisturbanceFilterConfig
from estimation.disturbance import Motion, first_estimate, unseated, updated

CONFIG = DisturbanceFilterConfig()
WHEELBASE = 2.875
CYCLE = 0.05
NOISE = (0.015, 0.002, 0.002)
"""Of v [m/s], phi [rad], delta [rad]."""
FINE = 50

Signal = Callable[[float], float]


@dataclass(frozen=True, kw_only=True)
class Truth:
    d: float = 0.0
    o: float = 0.0
    gain: float = 1.0
    wheelbase: float = WHEELBASE
    held_for: float = 0.0
    """So long after the first command to drive off a brake still holds [s]."""


def estimates(
    truth: Truth,
    seconds: float,
    *,
    a: Signal = lambda _: 0.0,
    delta: Signal = lambda _: 0.0,
    v: float = 0.0,
    noise: np.random.Generator | None = None,
    cycle: float = CYCLE,
    config: DisturbanceFilterConfig = CONFIG,
) -> list[DisturbanceEstimate]:
    """One estimate a cycle; commands and steering are held over a cycle."""
    estimate, found = first_estimate(config), []
    phi, held, now, last = 3.0, 0.0, 0.0, 0.0
    for k in range(round(seconds / cycle) + 1):
        now, angle = k * cycle, delta(k * cycle)
        off = np.zeros(3) if noise is None else noise.standard_normal(3) * NOISE
        motion = Motion(
            v=v + off[0], phi=float((phi + off[1] + np.pi) % (2 * np.pi) - np.pi), delta=angle + off[2]
        )
        estimate = updated(estimate, motion, now, last, WHEELBASE, config)
        found.append(estimate)
        last, following = a(now), delta(now + cycle)
        for i in range(FINE):
            h = cycle / FINE
            if v == 0.0 and truth.held_for > held:
                held += h if last != 0.0 else 0.0
                continue
            middle = v + 0.5 * h * (truth.gain * last + truth.d)
            wheels = angle + (i + 0.5) / FINE * (following - angle) + truth.o
            phi += h * middle * tan(wheels) / truth.wheelbase
            v += h * (truth.gain * last + truth.d)
    return found


@pytest.mark.parametrize("d", [0.3, -0.3, 0.5, -0.5])
def test_a_slope_is_found_within_a_second_from_rest(d: float) -> None:
    found = estimates(Truth(d=d), 1.0)
    assert found[-1].acceleration == pytest.approx(d, abs=0.05 * abs(d))
    assert found[10].acceleration == pytest.approx(d, abs=0.25 * abs(d))


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("d", [0.3, -0.5])
def test_a_slope_is_found_while_driving_either_way(sign: float, d: float) -> None:
    found = estimates(Truth(d=d), 10.0, v=sign * 1.5, a=lambda t: sign * 0.4 * np.cos(0.6 * t) - d)
    assert found[-1].acceleration == pytest.approx(d, abs=0.01)
    assert found[20].acceleration == pytest.approx(d, abs=0.25 * abs(d))


@pytest.mark.parametrize("gain", [0.9, 1.1])
def test_a_wrong_gain_is_hardly_taken_for_a_slope(gain: float) -> None:
    found = estimates(Truth(gain=gain), 15.0, a=lambda t: 0.36 * (1.0 - t / 7.5))
    assert max(abs(one.acceleration) for one in found) < 0.036
    assert abs(found[-1].acceleration) < 0.01


def test_a_brake_that_opens_late_is_not_taken_for_a_slope() -> None:
    found = estimates(Truth(held_for=0.6), 4.0, a=lambda _: 0.3)
    assert max(abs(one.acceleration) for one in found) < 0.03


@pytest.mark.parametrize("gain", [0.9, 1.1])
def test_at_rest_on_a_slope_what_holds_is_known_whatever_the_gain(gain: float) -> None:
    estimate, v, a = first_estimate(CONFIG), 0.0, 0.0
    for k in range(600):
        estimate = updated(estimate, Motion(v=v, phi=0.0, delta=0.0), k * CYCLE, a, WHEELBASE, CONFIG)
        a = (-2.0 * v - estimate.acceleration) / estimate.gain
        v += CYCLE * (gain * a - 0.5)
    assert abs(v) < 2e-4


@pytest.mark.parametrize("o", [radians(2.0), -radians(2.0)])
@pytest.mark.parametrize("v", [1.0, -1.0])
def test_an_offset_is_found_within_some_metres_on_a_straight(o: float, v: float) -> None:
    found = estimates(Truth(o=o), 10.0, v=v)
    assert found[60].steering == pytest.approx(o, abs=0.1 * abs(o))  # after 3 m
    assert found[-1].steering == pytest.approx(o, abs=0.02 * abs(o))


@pytest.mark.parametrize("share", [0.95, 1.05])
def test_a_wrong_wheelbase_is_hardly_taken_for_an_offset(share: float) -> None:
    found = estimates(Truth(wheelbase=share * WHEELBASE), 25.0, v=1.0, delta=lambda t: 0.5 * np.sin(0.4 * t))
    assert max(abs(one.steering) for one in found[200:]) < radians(0.5)


@pytest.mark.parametrize(("d", "o"), [(0.0, 0.0), (0.3, -0.02), (-0.25, 0.03)])
def test_errors_are_as_large_as_the_filter_says(d: float, o: float) -> None:
    squares = []
    for seed in range(30):
        noise = np.random.default_rng(seed)
        one = estimates(
            Truth(d=d, o=o),
            8.0,
            a=lambda t: np.cos(t) - d,
            delta=lambda t: 0.3 * np.sin(t),
            v=1.0,
            noise=noise,
        )[-1]
        stds = one.stds
        squares.append([((one.acceleration - d) / stds[0]) ** 2, ((one.steering - o) / stds[1]) ** 2])
    # Of 30 squares each with mean 1 the mean is within these in all but one of a thousand cases.
    assert (np.mean(squares, axis=0) < 2.0).all()
    assert (np.mean(squares, axis=0) > 0.1).all()


def test_nothing_is_learnt_over_a_gap_or_a_doubt() -> None:
    before = estimates(Truth(d=0.3, o=0.02), 6.0, v=1.0, a=lambda _: -0.3)[-1]
    elsewhere = Motion(v=-4.0, phi=1.0, delta=0.2)
    late = updated(before, elsewhere, 6.0 + 2.0, 0.0, WHEELBASE, CONFIG)
    doubted = updated(unseated(before), elsewhere, 6.0 + CYCLE, 0.0, WHEELBASE, CONFIG)
    back = updated(before, elsewhere, 5.0, 0.0, WHEELBASE, CONFIG)
    for after in (late, doubted, back):
        assert (after.acceleration, after.steering) == (before.acceleration, before.steering)
        assert after.mean[0] == -4.0


@pytest.mark.parametrize("asked", [-0.04, -0.3])
def test_what_a_standing_measurement_has_taught_is_forgotten_with_a_doubt(asked: float) -> None:
    """Its sensors may have stood, not the vehicle: a slope of theirs would drive it off."""
    before = estimates(Truth(d=0.3), 6.0, v=1.0, a=lambda _: -0.3)[-1]
    estimate = updated(before, Motion(0.0, 0.0, 0.0), 8.0, 0.0, WHEELBASE, CONFIG)
    known = estimate.acceleration
    for k in range(1, 40):
        estimate = updated(estimate, Motion(0.0, 0.0, 0.0), 8.0 + k * CYCLE, asked, WHEELBASE, CONFIG)
    assert abs(estimate.acceleration - known) > 0.01
    assert unseated(estimate).acceleration == known
    moved = updated(estimate, Motion(0.01, 0.0, 0.0), 10.0, asked, WHEELBASE, CONFIG)
    assert unseated(moved).acceleration == moved.acceleration


def test_nothing_is_learnt_while_somebody_else_brakes() -> None:
    noise = np.random.default_rng(1)
    before = estimates(Truth(d=0.3), 6.0, v=2.0, a=lambda _: -0.3, noise=noise)[-1]
    assert before.motion is not None
    estimate, v = before, before.motion.v
    for k in range(1, 7):
        v = max(v - 5.0 * CYCLE, 0.0)
        estimate = updated(
            estimate, Motion(v=v, phi=before.motion.phi, delta=0.0), 6.0 + k * CYCLE, -0.3, WHEELBASE, CONFIG
        )
    assert estimate.acceleration == before.acceleration
    assert estimate.mean[0] == pytest.approx(v, abs=0.01)


@pytest.mark.parametrize("turning", [0.0, -0.3])
def test_a_speed_that_obeys_at_once_is_not_taken_for_an_offset(turning: float) -> None:
    """By set-points speed and steering change just after a reading, and stay so until the next one."""
    estimate, phi, cycle, wheelbase = first_estimate(CONFIG), 0.0, 0.1, 1.4
    for k in range(30):
        v, delta = 0.03 * k, 1.06 + turning * k * cycle
        phi += cycle * v * tan(delta) / wheelbase
        estimate = updated(estimate, Motion(v, phi, delta), k * cycle, 0.3, wheelbase, CONFIG)
        assert abs(estimate.steering) < 0.03


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(("first", "a"), [(-0.05, -0.42), (0.25, -0.42), (-0.3, 0.42)])
def test_a_slope_that_starts_is_found_although_it_looks_like_a_weak_drive(
    sign: float, first: float, a: float
) -> None:
    """After seconds of the same command drive and slope are hardly told apart, and the drive has a bound."""
    estimate, v = updated(first_estimate(CONFIG), Motion(0.0, 0.0, 0.0), 0.0, 0.0, WHEELBASE, CONFIG), 0.0
    for k in range(1, 150):
        asked, d = sign * (a if k > 120 else -0.35), sign * (0.6 if k > 120 else first)
        v += CYCLE * (asked + d)
        estimate = updated(estimate, Motion(v, 0.0, 0.0), k * CYCLE, asked, WHEELBASE, CONFIG)
    assert estimate.gain * asked + estimate.acceleration == pytest.approx(asked + d, abs=0.15)
