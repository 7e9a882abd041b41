"""The plant against motions known in closed form."""

from __future__ import annotations

from dataclasses import replace
from math import cos, exp, inf, nan, sin, tan

import pytest
from scipy.integrate import solve_ivp

from rti_mpcc.config import Limits, Vehicle
from rti_mpcc.errors import InputError
from rti_mpcc.simulation.plant import PlantFault, PlantParameters, PlantState, advance, issue
from rti_mpcc.types import Array

PARAMETERS = PlantParameters.of(Vehicle(), Limits())
REST = PlantState(x=0.0, y=0.0, phi=0.0)


def driven(plant: PlantState, parameters: PlantParameters, until: float, step: float) -> PlantState:
    for k in range(1, round(until / step) + 1):
        plant = advance(plant, parameters, k * step)
    return plant


def commanded(plant: PlantState, acceleration: float, steering_rate: float) -> PlantState:
    return issue(plant, PARAMETERS, acceleration=acceleration, steering_rate=steering_rate)


@pytest.mark.parametrize("acceleration", [2.0, -0.5])
@pytest.mark.parametrize("heading", [0.0, 1.2, -3.0])
def test_constant_acceleration_goes_straight(acceleration: float, heading: float) -> None:
    start = PlantState(x=1.0, y=-2.0, phi=heading, v=0.5)
    end = driven(commanded(start, acceleration, 0.0), PARAMETERS, 3.0, 0.01)
    way = 0.5 * 3.0 + 0.5 * acceleration * 9.0
    assert (end.x, end.y) == pytest.approx((1.0 + way * cos(heading), -2.0 + way * sin(heading)), abs=1e-9)
    assert (end.phi, end.v) == pytest.approx((heading, 0.5 + 3.0 * acceleration), abs=1e-12)


@pytest.mark.parametrize("steering", [0.5, -0.3])
@pytest.mark.parametrize("speed", [3.0, -2.0])
def test_constant_steering_goes_in_a_circle(steering: float, speed: float) -> None:
    start = PlantState(x=0.0, y=0.0, phi=0.3, v=speed, delta=steering)
    end = driven(start, PARAMETERS, 4.0, 0.01)
    radius = Vehicle().wheelbase / tan(steering)
    heading = 0.3 + speed * 4.0 / radius
    assert end.phi == pytest.approx(heading, abs=1e-10)
    assert end.x == pytest.approx(radius * (sin(heading) - sin(0.3)), abs=1e-9)
    assert end.y == pytest.approx(-radius * (cos(heading) - cos(0.3)), abs=1e-9)


def test_changing_speed_and_steering_agree_with_a_reference_integrator() -> None:
    plant = commanded(PlantState(x=0.0, y=0.0, phi=0.2, v=1.0, delta=-0.5), 1.5, 0.4)

    def slope(t: float, z: Array) -> list[float]:
        v, delta = 1.0 + 1.5 * t, -0.5 + 0.4 * t
        return [v * cos(z[2]), v * sin(z[2]), v * tan(delta) / Vehicle().wheelbase]

    reference = solve_ivp(slope, (0.0, 2.5), [0.0, 0.0, 0.2], method="DOP853", rtol=1e-12, atol=1e-12).y[
        :, -1
    ]
    for step in (0.01, 0.05):
        end = driven(plant, PARAMETERS, 2.5, step)
        assert (end.x, end.y, end.phi) == pytest.approx(tuple(reference), abs=1e-9)


@pytest.mark.parametrize("dead_time", [0.0, 0.004, 0.183, 0.5])
def test_command_acts_after_the_dead_time_whatever_the_plant_step(dead_time: float) -> None:
    parameters = replace(PARAMETERS, dead_time=dead_time)
    plant = issue(REST, parameters, acceleration=2.0, steering_rate=0.5)
    for step in (0.01, 0.05):
        end = driven(plant, parameters, 1.0, step)
        acting = 1.0 - dead_time
        assert (end.v, end.delta) == pytest.approx((2.0 * acting, 0.5 * acting), abs=1e-12)
        assert advance(end, parameters, 1.0) == end


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_steering_stops_at_its_limit_and_comes_back(side: float) -> None:
    plant = issue(PlantState(x=0.0, y=0.0, phi=0.0, v=1.0), PARAMETERS, acceleration=0.0, steering_rate=side)
    plant = driven(plant, PARAMETERS, 0.593, 0.001)
    assert plant.delta == pytest.approx(0.593 * side, abs=1e-12)
    plant = advance(plant, PARAMETERS, 1.0)
    assert plant.delta == 0.6 * side
    plant = issue(plant, PARAMETERS, acceleration=0.0, steering_rate=-side)
    assert advance(plant, PARAMETERS, 1.1).delta == pytest.approx(0.5 * side, abs=1e-12)


def test_actuators_saturate_before_the_gain() -> None:
    parameters = PlantParameters.of(Vehicle(), Limits(), acceleration_gain=1.2)
    end = advance(issue(REST, parameters, acceleration=50.0, steering_rate=-9.0), parameters, 0.1)
    assert (end.v, end.delta) == pytest.approx((0.1 * 5.0 * 1.2, -0.1), abs=1e-12)


def test_errors_of_the_model_show_in_the_turn_only() -> None:
    parameters = PlantParameters.of(Vehicle(), Limits(), wheelbase_error=0.05, steering_offset=0.02)
    end = driven(PlantState(x=0.0, y=0.0, phi=0.0, v=2.0, delta=0.3), parameters, 1.0, 0.01)
    assert end.delta == 0.3
    assert end.phi == pytest.approx(2.0 * tan(0.32) / (1.05 * Vehicle().wheelbase), abs=1e-12)


@pytest.mark.parametrize("step", [0.01, 0.05, 1.0])
def test_a_slope_acts_whatever_is_commanded(step: float) -> None:
    parameters = PlantParameters.of(Vehicle(), Limits(), acceleration_gain=1.1, acceleration_offset=-0.3)
    end = driven(REST, parameters, 1.0, step)
    assert (end.v, end.x) == pytest.approx((-0.3, -0.15), abs=1e-12)
    pushed = issue(REST, parameters, acceleration=1.0, steering_rate=0.0)
    assert driven(pushed, parameters, 1.0, step).v == pytest.approx(1.1 - 0.3, abs=1e-12)


@pytest.mark.parametrize("value", [nan, inf, -inf])
@pytest.mark.parametrize("name", ["acceleration", "steering_rate"])
def test_command_that_is_not_finite_is_refused(name: str, value: float) -> None:
    command = {"acceleration": 0.0, "steering_rate": 0.0} | {name: value}
    with pytest.raises(InputError, match=rf"command\.{name} = .*finite"):
        issue(REST, PARAMETERS, **command)


# -- faults ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("step", [0.01, 0.05, 1.0])
@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_weak_brakes_act_with_their_share_up_to_the_standstill(direction: float, step: float) -> None:
    fault = PlantFault(begin=0.333, end=9.0, braking_share=0.4)
    parameters = replace(PARAMETERS, faults=(fault,))
    start = PlantState(x=0.0, y=0.0, phi=0.0, v=direction * 2.0)
    plant = issue(start, parameters, acceleration=-direction * 2.0, steering_rate=0.0)
    # 2 m/s² until 0.333 s, 0.8 m/s² until it stands, and all of it in the other direction.
    left = 2.0 - 2.0 * 0.333
    stands = 0.333 + left / 0.8
    end = driven(plant, parameters, 4.0, step)
    assert end.v == pytest.approx(-direction * 2.0 * (4.0 - stands), abs=1e-9)
    way = 2.0 * 0.333 - 0.333**2 + 0.5 * left**2 / 0.8 - (4.0 - stands) ** 2
    assert end.x == pytest.approx(direction * way, abs=1e-9)


@pytest.mark.parametrize("step", [0.01, 0.05])
def test_stuck_steering_stays_and_goes_on_with_what_it_is_told(step: float) -> None:
    parameters = replace(PARAMETERS, faults=(PlantFault(begin=0.123, end=0.777, steering_share=0.0),))
    plant = issue(REST, parameters, acceleration=0.0, steering_rate=0.3)
    for time, delta in ((0.1, 0.03), (0.4, 0.0369), (0.75, 0.0369), (1.0, 0.0369 + 0.3 * 0.223)):
        assert driven(plant, parameters, time, step).delta == pytest.approx(delta, abs=1e-12)


def test_a_late_command_acts_from_its_arrival_until_the_next_one_arrives() -> None:
    plant = issue(REST, PARAMETERS, acceleration=1.0, steering_rate=0.0, delay=0.3)
    plant = issue(advance(plant, PARAMETERS, 0.1), PARAMETERS, acceleration=0.0, steering_rate=0.0)
    plant = issue(plant, PARAMETERS, acceleration=0.0, steering_rate=0.0, delay=0.4)
    assert [time for time, _ in plant.pending] == pytest.approx([0.1, 0.3, 0.5])
    assert driven(plant, PARAMETERS, 1.0, 0.05).v == pytest.approx(0.2, abs=1e-12)


def test_actuators_with_lag_follow_exponentially() -> None:
    """A step of the command: v = a (t - tau (1 - exp(-t / tau))), and the same for the steering."""
    lags = replace(PARAMETERS, drive_lag=0.3, steering_lag=0.2)
    plant = issue(PlantState(x=0.0, y=0.0, phi=0.0), lags, acceleration=0.5, steering_rate=0.4)
    plant = advance(plant, lags, 0.7)
    for got, rate, lag in ((plant.v, 0.5, 0.3), (plant.delta, 0.4, 0.2)):
        assert got == pytest.approx(rate * (0.7 - lag * (1.0 - exp(-0.7 / lag))), rel=1e-4)
    assert plant.acceleration == pytest.approx(0.5 * (1.0 - exp(-0.7 / 0.3)), rel=1e-6)
