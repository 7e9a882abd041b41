"""Noise goes out of the measured state, motion stays in it."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import cos, pi, sin, tan

import numpy as np
import pytest

from estimation import MeasurementNoise
from estimation.types import Array
from estimation.vehicle_filter import Elapsed, filtered
from geometry import wrap

CYCLE, WHEELBASE, CURVATURE = 0.05, 2.875, 0.24
NOISE: Array = np.array((0.015, 0.015, 0.003, 0.01, 0.0025))


def driven(state: Array, acceleration: float, steering_rate: float) -> Array:
    """The model: one cycle on."""
    x, y, phi, v, delta, other = state.tolist()
    middle = v + 0.5 * CYCLE * acceleration
    turn = CYCLE * middle * tan(delta + 0.5 * CYCLE * steering_rate) / WHEELBASE
    return np.array(
        (
            x + CYCLE * middle * cos(phi + 0.5 * turn),
            y + CYCLE * middle * sin(phi + 0.5 * turn),
            phi + turn,
            v + CYCLE * acceleration,
            delta + CYCLE * steering_rate,
            other,
        )
    )


@dataclass
class Watch:
    """A vehicle as it is measured, and as it is believed to be."""

    true: Array
    noise: Array = field(default_factory=lambda: np.zeros(5))
    seed: int = 1
    known: MeasurementNoise = field(default_factory=MeasurementNoise)
    off: Array = field(default_factory=lambda: np.zeros(6))

    def __post_init__(self) -> None:
        self.random = np.random.default_rng(self.seed)
        self.measured = self.state = self.seen()
        self.errors: list[Array] = []
        self.measured_errors: list[Array] = []

    def seen(self) -> Array:
        found: Array = self.true + np.append(self.noise * self.random.standard_normal(5), 0.0)
        return found

    def step(self, acceleration: float = 0.0, steering_rate: float = 0.0, jump: float = 0.0) -> None:
        """`off` (6,) is what the truth does in each cycle that the model does not know."""
        self.true = driven(self.true, acceleration, steering_rate) + self.off
        self.true[0] += jump
        follows = driven(self.measured, acceleration, steering_rate)
        expected = driven(self.state, acceleration, steering_rate)
        self.measured = self.seen()
        since = Elapsed(CYCLE, CYCLE * acceleration, CURVATURE)
        self.state, self.known = filtered(self.known, self.measured, follows, expected, since)
        self.errors.append((self.state - self.true)[:5])
        self.measured_errors.append((self.measured - self.true)[:5])

    def drive(self, cycles: int) -> None:
        for k in range(cycles):
            self.step(0.3 * cos(0.05 * k), 0.1 * sin(0.03 * k))


def start(heading: float = 0.4, v: float = 0.8) -> Array:
    return np.array((3.0, -2.0, heading, v, 0.1, 7.0))


def test_without_noise_the_state_is_what_is_measured() -> None:
    watch = Watch(start())
    watch.drive(200)
    assert np.abs(watch.errors).max() < 1e-9
    assert watch.state[5] == 7.0


@pytest.mark.parametrize("seed", range(3))
def test_noise_is_learnt_and_taken_out(seed: int) -> None:
    watch = Watch(start(), NOISE, seed)
    watch.drive(1500)
    assert watch.known.stds == pytest.approx(NOISE, rel=0.5)
    left = np.std(watch.errors[300:], axis=0) / np.std(watch.measured_errors[300:], axis=0)
    assert (left[:3] < [0.4, 0.4, 0.5]).all()
    assert (left[3:] < [0.7, 0.75]).all()
    assert (np.abs(np.mean(watch.errors[300:], axis=0)) < 0.15 * NOISE).all()


@pytest.mark.parametrize("turn", [0.7, pi, -2.5])
def test_a_turned_vehicle_is_filtered_alike(turn: float) -> None:
    one, other = Watch(start()), Watch(start())
    c, s = cos(turn), sin(turn)
    rotation = np.array([[c, -s], [s, c]])

    def turned(state: Array) -> Array:
        found = state.copy()
        found[:2] = rotation @ state[:2]
        found[2] = wrap(float(state[2]) + turn)
        return found

    random = np.random.default_rng(5)
    one.known = other.known = MeasurementNoise(variance=NOISE**2, pairs=100, run=100)
    follows, expected, measured = (start() + 0.01 * random.standard_normal(6) for _ in range(3))
    since = Elapsed(CYCLE, 0.01, CURVATURE)
    plain, known = filtered(one.known, measured, follows, expected, since)
    rotated, also = filtered(other.known, turned(measured), turned(follows), turned(expected), since)
    assert rotated[:2] == pytest.approx(rotation @ plain[:2], abs=1e-12)
    assert wrap(float(rotated[2] - plain[2]) - turn) == pytest.approx(0.0, abs=1e-12)
    assert also.residual == pytest.approx(known.residual, abs=1e-12)


def test_it_is_never_farther_from_a_measurement_than_noise_explains() -> None:
    watch = Watch(start(), NOISE)
    watch.drive(300)
    std = watch.known.stds[0]
    watch.step(jump=0.4)
    off = np.hypot(*(watch.state - watch.measured)[:2])
    assert off <= 3.0 * 1.5 * std
    for _ in range(20):
        watch.step()
        assert np.hypot(*(watch.state - watch.true)[:2]) < 0.1
