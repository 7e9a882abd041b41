"""The model divides by the wheelbase and takes tangents; its inverse divides by a gain and by a time."""

from __future__ import annotations

from math import pi, tan

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from rti_mpcc.config import ControllerConfig
from rti_mpcc.model.actuators import Disturbance, QueuedCommand, roll_forward
from rti_mpcc.model.bicycle import linearised_step
from rti_mpcc.model.layout import DELTA, THETA, V, X, Y
from tests.properties.magnitudes import examples, from_zero, positive, signed

VEHICLE = ControllerConfig()
WHEELBASE, STEERING = VEHICLE.vehicle.wheelbase, VEHICLE.limits.steering
speeds = signed(1e-12, 30.0)
steerings = signed(1e-12, 1.4)


@given(speeds, steerings, signed(1e-9, 5.0), positive(1e-9, 10.0), positive(1e-2, 20.0))
@example(0.0, 0.0, 0.0, 1e-9, 2.875)
@example(30.0, 1.4, 0.0, 10.0, 1e-2)
@examples
def test_a_step_moves_the_vehicle_no_farther_than_its_speed_and_turns_it_with_its_wheels(
    speed: float, steering: float, acceleration: float, seconds: float, wheelbase: float
) -> None:
    start = np.array([[0.0, 0.0, 0.0, speed, steering, 0.0]])
    step = linearised_step(start, np.array([[acceleration, 0.0, 0.0]]), np.array([seconds]), wheelbase)
    assert np.isfinite(step.pose_by).all()
    (reached,) = step.state
    fastest = max(abs(speed), abs(speed + seconds * acceleration))
    assert np.hypot(reached[X], reached[Y]) <= seconds * fastest * (1.0 + 1e-9)
    turn = seconds * (speed + 0.5 * seconds * acceleration) * tan(steering) / wheelbase
    assert reached[2] == pytest.approx(turn, rel=1e-9, abs=1e-12)


queues = st.lists(
    st.tuples(st.floats(-1.0, 2.0), st.floats(-5.0, 5.0), st.floats(-1.0, 1.0)), max_size=5
).map(lambda rows: [QueuedCommand(*row) for row in sorted(rows)])


@given(queues, st.floats(0.0, 1.0), from_zero(1e-15, 2.0), speeds, st.floats(-0.7, 0.7), st.floats(0.8, 1.2))
@example([], 0.0, 0.0, 1.0, 0.1, 1.2)
@example([QueuedCommand(0.0, 1.0, 0.5), QueuedCommand(1e-15, -1.0, -0.5)], 0.0, 1e-14, 1.0, 0.1, 1.2)
@example([QueuedCommand(0.5, 1.0, 1.0), QueuedCommand(0.5, -1.0, 1.0)], 0.5, 1.0, 1.0, 0.7, 0.8)
@examples
def test_a_state_rolled_forward_over_any_time_stays_within_what_the_commands_can_do(
    queue: list[QueuedCommand], now: float, seconds: float, speed: float, delta: float, turn: float
) -> None:
    state = np.array([0.0, 0.0, 0.0, speed, delta, 0.0])
    known = Disturbance(acceleration=0.2, steering=0.02, gain=1.1, turn=turn)
    reached = roll_forward(state, queue, now, now + seconds, VEHICLE, known)
    assert np.isfinite(reached).all()
    seconds = (now + seconds) - now
    assert abs(reached[V] - speed) <= (1.1 * 5.0 + 0.2) * seconds * (1.0 + 1e-9) + 1e-12
    assert abs(reached[DELTA] - delta) <= seconds * (1.0 + 1e-9) + 1e-12
    assert abs(reached[DELTA]) <= max(STEERING, abs(delta)) + 1e-12
    way = (abs(speed) + (1.1 * 5.0 + 0.2) * seconds) * seconds
    assert np.hypot(reached[X], reached[Y]) <= way * (1.0 + 1e-9)
    assert reached[THETA] == 0.0


gains = st.floats(0.1, 1.9)
offsets = st.floats(-0.1, 0.1)


@given(signed(1e-9, 10.0), st.floats(-3.0, 3.0), gains)
@example(0.0, 0.0, 0.1)
@examples
def test_what_is_commanded_acts_as_it_was_wanted(acceleration: float, d: float, gain: float) -> None:
    known = Disturbance(acceleration=d, gain=gain)
    assert known.acting(known.commanded(acceleration)) == pytest.approx(acceleration, abs=1e-9)


@given(st.floats(-1.4, 1.4), offsets, gains)
@example(0.0, 0.0, 1.0)
@example(1.4, 0.1, 0.1)
@example(STEERING, 0.0, 0.95)
@examples
def test_the_steering_that_acts_and_the_one_that_is_measured_are_the_same_angle(
    measured: float, o: float, turn: float
) -> None:
    known = Disturbance(steering=o, turn=turn)
    acting = known.acting_steering(measured)
    assert abs(acting) <= 0.5 * pi
    assert tan(acting) == pytest.approx(turn * tan(measured + o), abs=1e-12)
    assert known.effective(np.array([1.0, 2.0, 3.0, 4.0, measured, 5.0]))[DELTA] == acting
    assert known.measured_steering(acting) == pytest.approx(measured, abs=1e-9)
