"""Settings at the edges that they allow: what follows from them, and a cycle that is driven with them."""

from __future__ import annotations

from math import isfinite, sqrt
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from geometry import Corridor, Pose2, ReferencePath
from rti_mpcc import DockingController, VehicleState
from rti_mpcc.config import ControllerConfig, Limits, Vehicle, Weights
from rti_mpcc.mission.straight import mendable
from rti_mpcc.model.layout import CONTROLS, STATES
from rti_mpcc.ocp.bounds import StageBounds
from rti_mpcc.ocp.targets import Target, TargetKind
from rti_mpcc.paper import SpeedProfile
from rti_mpcc.planning.plausibility import StateMonitor, validate_measurement
from rti_mpcc.qp.filling import ROW_SCALING_MOST, empty_values, fill_bounds
from rti_mpcc.qp.pattern import build_pattern
from rti_mpcc.simulation.plant import PlantFault, PlantParameters, PlantState, advance, issue
from rti_mpcc.types import Source
from tests.properties.magnitudes import examples, few_examples, from_zero, positive, signed

PATH = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 60.0)])
CORRIDOR = Corridor.from_offsets(PATH, left=4.0, right=-4.0)


@given(
    positive(1e-3, 100.0), positive(1e-3, 100.0), st.floats(1e-3, 1.0), positive(1e-3, 1.4),
    positive(0.1, 20.0), st.floats(3.0, 300.0), st.sampled_from(("smooth", "brisk")),
)  # fmt: skip
@example(1e-3, 1e-3, 1e-3, 1e-3, 20.0, 3.0, "smooth")
@example(100.0, 100.0, 1.0, 1.4, 0.1, 300.0, "brisk")
@examples
def test_what_follows_from_the_limits_is_positive_and_within_them(
    speed: float,
    acceleration: float,
    share: float,
    steering: float,
    wheelbase: float,
    horizon: float,
    ride: Any,
) -> None:
    config = ControllerConfig(
        limits=Limits(speed=speed, acceleration=acceleration, steering=steering),
        vehicle=Vehicle(wheelbase=wheelbase),
        comfort_acceleration=share * acceleration,
        arrival_horizon=horizon,
        ride=ride,
    )
    assert 0.0 < config.cruise_speed <= speed
    assert 0.0 < config.arrival_acceleration <= share * acceleration
    assert config.comfort.jerk > 0.0
    assert config.arrival_reach > 0.0
    assert 0.0 < config.max_curvature < np.inf
    assert config.planned_acceleration >= share * acceleration


@given(from_zero(1e-12, 1e6), positive(1e-3, 10.0), positive(1e-3, 100.0), from_zero(1e-3, 1.0))
@example(0.0, 1.0, 5.0, 0.5)
@examples
def test_the_speed_at_a_stop_is_the_final_one_at_least_and_one_that_stops_behind_it(
    behind: float, final: float, deceleration: float, share: float
) -> None:
    profile = SpeedProfile(final=final, deceleration=deceleration, behind=share)
    target = Target(pose=Pose2(0.0, 0.0, 0.0), theta=behind, theta_end=0.0, kind=TargetKind.POSE)
    (at_stop,) = profile.speeds(target, np.zeros(1))
    assert final <= at_stop <= max(final, sqrt(2.0 * deceleration * behind) * (1.0 + 1e-9))


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
    controller = DockingController(PATH, CORRIDOR, config)
    for k in range(3):
        state = VehicleState(x=1.0, y=0.0, phi=0.0, v=0.0, delta=0.0)
        command = controller.step(state, now=k * config.cycle)
        assert isfinite(command.acceleration)
        assert isfinite(command.steering_rate)
    assert command.source is Source.SOLUTION, command.diagnostics.reason


@given(signed(1e-12, 1e12))
@example(0.0)
@few_examples
def test_however_far_a_bound_is_its_row_is_scaled_by_a_bounded_factor_and_stays_the_same_bound(
    distance: float,
) -> None:
    pattern = build_pattern(2, 0, 0)
    values = empty_values(pattern)
    limits = np.empty((2, 2, 2, CONTROLS))
    limits[:, :, 0], limits[:, :, 1] = -np.inf, distance
    bounds = StageBounds(states=limits[0], controls=limits[1])
    fill_bounds(values, pattern, bounds, np.zeros((3, STATES)), np.zeros((2, CONTROLS)))
    by = values.row_scaling_by.bounds
    assert (by >= 1.0).all()
    assert (by <= ROW_SCALING_MOST).all()
    assert np.isfinite(values.constraints).all()
    np.testing.assert_allclose(
        values.upper_by.bounds * by * pattern.bound_units[:, None], distance, rtol=1e-9
    )
    assert (values.lower_by.bounds == -np.inf).all()


@given(signed(1e-12, 30.0), positive(1e-12, 1.0), positive(1e-12, 1.0), st.integers(2, 50))
@example(1e-12, 1e-12, 1e-12, 2)
@examples
def test_a_straight_move_without_an_error_can_always_be_begun(
    way: float, curvature: float, tolerance: float, headings: int
) -> None:
    assert mendable(Pose2(0.0, 0.0, 0.0), way, curvature, (tolerance, tolerance), headings)
    # Nothing is mended on no way: an error outside the tolerance stays.
    assert not mendable(Pose2(0.0, 2.0 * tolerance, 0.0), 0.0, curvature, (tolerance, 1.0), headings)
    assert not mendable(Pose2(0.0, 0.0, 2.0 * tolerance), 0.0, curvature, (1.0, tolerance), headings)


@given(from_zero(1e-12, 1e9), from_zero(1e-12, 1e9), st.floats(-0.15, 0.15))
@example(0.0, 0.0, 0.0)
@examples
def test_a_measurement_after_any_time_is_taken_or_doubted_and_a_gap_of_the_steering_fades(
    first: float, seconds: float, steering: float
) -> None:
    config = ControllerConfig()
    monitor = StateMonitor()
    for now, delta in ((first, 0.0), (first + seconds, steering)):
        state = VehicleState(x=0.0, y=0.0, phi=0.0, v=0.0, delta=delta)
        monitor = validate_measurement(monitor, state, (), now, config)
    assert monitor.state is not None
    assert np.isfinite(monitor.state).all()
    assert abs(monitor.steering_gap) <= abs(steering) + 1e-12


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
