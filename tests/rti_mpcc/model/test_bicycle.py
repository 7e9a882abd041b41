from __future__ import annotations

from math import atan, cos, pi, sin

import numpy as np
import pytest

from rti_mpcc.model.bicycle import linearised_step, step_one
from rti_mpcc.model.layout import CONTROLS, PHI, STATES, X, Y
from rti_mpcc.types import Array
from tests.rti_mpcc.differences import slopes
from tests.rti_mpcc.model_steps import by_control, by_state, rates, step

WHEELBASE = 2.875


def drawn(n: int, seed: int = 1) -> tuple[Array, Array, Array]:
    random = np.random.default_rng(seed)
    states = random.uniform(-1.0, 1.0, (n, STATES)) * [50.0, 50.0, 4.0, 8.0, 0.6, 100.0]
    controls = random.uniform(-1.0, 1.0, (n, CONTROLS)) * [5.0, 1.0, 10.0]
    return states, controls, random.uniform(0.005, 0.8, n)


def textbook(state: Array, control: Array, h: float) -> Array:
    """The classical Runge-Kutta step of one state."""

    def f(z: Array) -> Array:
        return rates(z, control, WHEELBASE)

    k_1 = f(state)
    k_2 = f(state + 0.5 * h * k_1)
    k_3 = f(state + 0.5 * h * k_2)
    k_4 = f(state + h * k_3)
    return np.asarray(state + h / 6.0 * (k_1 + 2.0 * k_2 + 2.0 * k_3 + k_4))


def test_rates_are_those_of_the_kinematic_bicycle() -> None:
    state, control = np.array([[1.0, 2.0, 0.3, -2.0, 0.4, 5.0]]), np.array([[0.5, -0.2, 1.5]])
    turn = -2.0 * np.tan(0.4) / WHEELBASE
    expected = [-2.0 * cos(0.3), -2.0 * sin(0.3), turn, 0.5, -0.2, 1.5]
    moved = step(state, control, np.array([1e-7]), WHEELBASE) - state
    np.testing.assert_allclose(moved / 1e-7, [expected], rtol=1e-5)


def test_the_step_is_the_classical_runge_kutta_step() -> None:
    states, controls, lengths = drawn(40)
    reached = step(states, controls, lengths, WHEELBASE)
    for k in range(len(states)):
        np.testing.assert_allclose(reached[k], textbook(states[k], controls[k], lengths[k]), rtol=1e-12)


def test_the_step_is_the_linearised_one_and_that_of_one_state() -> None:
    states, controls, lengths = drawn(40, seed=5)
    reached = step(states, controls, lengths, WHEELBASE)
    linearised = linearised_step(states, controls, lengths, WHEELBASE).state
    np.testing.assert_allclose(reached, linearised, rtol=1e-13, atol=1e-13)
    for k in range(len(states)):
        one = step_one(tuple(states[k]), tuple(controls[k]), float(lengths[k]), WHEELBASE)
        np.testing.assert_allclose(one, reached[k], rtol=1e-13, atol=1e-13)


def test_sensitivities_for_differing_stage_lengths() -> None:
    states, controls, lengths = drawn(25, seed=2)
    got = linearised_step(states, controls, lengths, WHEELBASE)
    for k in range(len(states)):
        h = lengths[k : k + 1]

        def after_state(z: Array, k: int = k, h: Array = h) -> Array:
            return np.asarray(step(z[None], controls[k : k + 1], h, WHEELBASE)[0])

        def after_control(u: Array, k: int = k, h: Array = h) -> Array:
            return np.asarray(step(states[k : k + 1], u[None], h, WHEELBASE)[0])

        np.testing.assert_allclose(by_state(got)[k], slopes(after_state, states[k]), atol=2e-7)
        np.testing.assert_allclose(by_control(got, lengths)[k], slopes(after_control, controls[k]), atol=2e-7)


@pytest.mark.parametrize("speed", [2.0, -2.0])
def test_constant_steering_drives_a_circle(speed: float) -> None:
    delta = atan(0.2 * WHEELBASE)  # radius 5 m
    states = np.array([[0.0, 0.0, 0.0, speed, delta, 0.0]])
    steps, duration = 400, 2.0 * pi * 5.0 / abs(speed) * 0.75
    for _ in range(steps):
        states = step(states, np.zeros((1, CONTROLS)), np.array([duration / steps]), WHEELBASE)
    turned = np.sign(speed) * 1.5 * pi
    expected = [5.0 * sin(turned), 5.0 * (1.0 - cos(turned)), turned]
    np.testing.assert_allclose(states[0, [X, Y, PHI]], expected, atol=1e-8)


def test_the_step_turns_and_moves_with_the_world() -> None:
    states, controls, lengths = drawn(10, seed=4)
    turned = states.copy()
    c, s = cos(2.0), sin(2.0)
    turned[:, X], turned[:, Y] = (
        5.0 + c * states[:, X] - s * states[:, Y],
        s * states[:, X] + c * states[:, Y],
    )
    turned[:, PHI] += 2.0
    plain, moved = (step(z, controls, lengths, WHEELBASE) for z in (states, turned))
    np.testing.assert_allclose(moved[:, X], 5.0 + c * plain[:, X] - s * plain[:, Y], atol=1e-12)
    np.testing.assert_allclose(moved[:, Y], s * plain[:, X] + c * plain[:, Y], atol=1e-12)
    np.testing.assert_allclose(moved[:, PHI], plain[:, PHI] + 2.0, atol=1e-12)
