"""Settings at the edges that they allow: what follows from them, and a cycle that is driven with them."""

from __future__ import annotations

from math import isfinite
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from benchmarks.encounters import on_lane
from rti_mpcc import VehicleState
from rti_mpcc.config import ControllerConfig, Limits, Vehicle, Weights
from rti_mpcc.simulation.plant import PlantFault, PlantParameters, PlantState, advance, issue
from rti_mpcc.types import Source
from tests.properties.magnitudes import few_examples, from_zero, positive, signed


@pytest.mark.parametrize(
    "changes",
    [
        {"weights": Weights(lag=0.0)},
        {"weights": Weights(contouring=0.0)},
        {"weights": Weights(progress_reward=0.0)},
        {"weights": Weights(acceleration=0.0, steering_rate=0.0)},
        {"comfort_acceleration": 1e-2},
        {"comfort_lateral_acceleration": 1e-2},
        {"comfort_steering_rate": 1e-2},
        {"comfort_jerk": 1e-2},
        {"cycle": 0.005},
        {"cycle": 0.2},
        {"dead_time": 1.0},
        {"cruise_horizon": 1.0},
        {"limits": Limits(speed=0.1)},
        {"ride": "brisk"},
    ],
    ids=lambda changes: " and ".join(changes),
)
def test_a_straight_path_is_driven_whatever_the_settings_are(changes: dict[str, Any]) -> None:
    config = ControllerConfig(**changes)
    controller = on_lane(60.0, 4.0, config)
    for k in range(3):
        state = VehicleState(x=1.0, y=0.0, phi=0.0, v=0.0, delta=0.0)
        command = controller.step(state, now=k * config.cycle)
        assert isfinite(command.acceleration)
        assert isfinite(command.steering_rate)
    assert command.source is Source.SOLUTION, command.diagnostics.reason


faults = st.builds(
    lambda begin, length, steering, braking: PlantFault(
        begin=begin, end=begin + length, steering_share=steering, braking_share=braking
    ),
    st.floats(0.0, 0.2), positive(1e-9, 1.0), from_zero(1e-6, 1.0), positive(1e-6, 1.0),
)  # fmt: skip


@given(
    signed(1e-12, 10.0),
    st.floats(-0.6, 0.6),
    signed(1e-9, 5.0),
    signed(1e-9, 1.0),
    st.lists(faults, max_size=3),
)
@example(0.0, 0.6, -5.0, 1.0, [])
@example(1e-12, 0.0, -5.0, 0.0, [PlantFault(begin=0.0, end=1.0, braking_share=1e-6)])
@example(1.0, 0.6 - 1e-12, 0.0, 1e-9, [PlantFault(begin=0.0, end=1.0, steering_share=0.0)])
@few_examples
def test_the_plant_is_finite_and_within_its_stops_whatever_its_actuators_do(
    speed: float, steering: float, acceleration: float, rate: float, faults: list[PlantFault]
) -> None:
    parameters = PlantParameters.of(Vehicle(), Limits(), dead_time=0.0, faults=tuple(faults))
    plant = PlantState(x=0.0, y=0.0, phi=0.0, v=speed, delta=steering)
    plant = issue(plant, parameters, acceleration=acceleration, steering_rate=rate)
    plant = advance(plant, parameters, 0.3)
    assert all(map(isfinite, (plant.x, plant.y, plant.phi, plant.v, plant.delta)))
    assert abs(plant.delta) <= parameters.steering_limit
    assert abs(plant.v - speed) <= 0.3 * abs(acceleration) * (1.0 + 1e-9) + 1e-12
    assert np.hypot(plant.x, plant.y) <= 0.3 * (abs(speed) + 0.3 * abs(acceleration)) * (1.0 + 1e-9)
