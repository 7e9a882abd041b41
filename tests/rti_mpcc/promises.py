"""The promises that hold for every command, whatever the controller is told."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import isfinite
from typing import TypeVar

import numpy as np
from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis.strategies import SearchStrategy

from geometry import Pose2
from rti_mpcc import Command, ControllerConfig, DockingController, Reason, Source, Status, VehicleState
from rti_mpcc.model.layout import V
from rti_mpcc.planning.state import MOVING_SPEED
from rti_mpcc.simulation.plant import PlantParameters, PlantState, advance, issue
from tests.rti_mpcc.drawn import RUNS, Placed, Run, is_finite, measured, placed_state, told
from tests.rti_mpcc.worlds import World, world

T = TypeVar("T")
ROUNDING = 1e-9
LONGEST = 2.5
"""So long the plant is driven on between two cycles at most [s]."""
HELD_OUT = 2.0
"""Share of the tolerance inside which DOCKED is held for a moment, although measured outside."""


def hold(draws: int, chunk: int) -> None:
    """So many drawn runs, the same for the same `chunk`, keep the promises."""
    hold_for(RUNS, keep_promises, draws, chunk)


def hold_for(drawn: SearchStrategy[T], check: Callable[[T], None], draws: int, chunk: int) -> None:
    """So many draws, the same for the same `chunk`, pass a check."""

    @seed(chunk)
    @settings(
        max_examples=draws,
        deadline=None,
        database=None,
        suppress_health_check=list(HealthCheck),
        phases=(Phase.generate, Phase.shrink),
        print_blob=False,
    )
    @given(example=drawn)
    def promised(example: T) -> None:
        check(example)

    promised()


def on_path(here: World, config: ControllerConfig) -> DockingController:
    """The controller of most runs."""
    return DockingController(here.path, here.corridor, config)


def keep_promises(run: Run, made: Callable[[World, ControllerConfig], DockingController] = on_path) -> None:
    """Drive a run; the plant follows the commands wherever the state is not drawn."""
    here, config = world(run.world), run.setting.config()
    controller = made(here, config)
    parameters = PlantParameters.of(config.vehicle, config.limits, dead_time=config.dead_time)
    limit, now = config.limits.speed, 0.0
    plant = _moved(PlantState(x=0.0, y=0.0, phi=0.0), run.start, here, limit)
    for cycle in run.cycles:
        if isinstance(cycle.state, Placed):
            plant = _moved(plant, cycle.state, here, limit)
        state = measured(cycle, plant.measured)
        pose = Pose2(plant.x, plant.y, plant.phi)
        command = controller.step(state, now=now, **told(cycle, here, pose, now))
        check_numbers(command, config)
        check_return(controller, state, command)
        check_account(state, command, config)
        plant = issue(
            plant, parameters, acceleration=command.acceleration, steering_rate=command.steering_rate
        )
        passed = config.cycle if cycle.passed is None else cycle.passed
        now = passed[0] if isinstance(passed, tuple) else now + passed
        lasted = passed if isinstance(passed, float) and 0.0 <= passed <= LONGEST else config.cycle
        plant = advance(plant, parameters, plant.time + lasted)


def check_numbers(command: Command, config: ControllerConfig) -> None:
    """Everything is finite, within the input limits, and of the documented shape."""
    numbers = (command.acceleration, command.steering_rate, command.speed, command.steering)
    assert all(type(number) is float and isfinite(number) for number in numbers), numbers
    assert abs(command.acceleration) <= config.limits.acceleration + ROUNDING
    assert abs(command.steering_rate) <= config.limits.steering_rate + ROUNDING
    plan, stages = command.trajectory, config.stages
    for array, shape in (
        (plan.times, (stages + 1,)),
        (plan.states, (stages + 1, 6)),
        (plan.controls, (stages, 3)),
    ):
        assert array.shape == shape
        assert np.isfinite(array).all()
        assert not array.flags.writeable


def check_return(controller: DockingController, state: VehicleState, command: Command) -> None:
    """What is measured outside its limit is not led further out.

    Only measurements that have contradicted one another for long don't keep a vehicle from braking.
    """
    config, monitor = controller.config, controller.state.vehicle.monitor
    odd = monitor.odd_since is not None and monitor.at - monitor.odd_since > config.plausibility.blind
    slows = odd and monitor.state is not None and monitor.state[V] * command.acceleration < 0.0
    for value, limit, rate in (
        (0.0 if slows else state.v, config.limits.speed, command.acceleration),
        (state.delta, config.limits.steering, command.steering_rate),
    ):
        if isfinite(value) and abs(value) > limit:
            assert np.sign(value) * rate <= ROUNDING, (value, limit, rate)


def check_account(state: VehicleState, command: Command, config: ControllerConfig) -> None:
    """Status, source and reason tell what is the case."""
    assert type(command.status) is Status
    assert type(command.source) is Source
    assert command.diagnostics.cause is not Reason.MISTAKE, command.diagnostics.reason
    assert len(command.diagnostics.reason.splitlines()) <= 1
    if command.diagnostics.deadline_missed:
        assert command.source is not Source.SOLUTION
    if command.status is Status.FAILED:
        assert command.diagnostics.reason
    assert type(command.docked) is bool
    assert command.docked is (command.status is Status.DOCKED)
    if command.docked:
        assert is_finite(state)
        error = Pose2(state.x, state.y, state.phi).relative_to(command.diagnostics.aim)
        along, across, heading = (HELD_OUT * most for most in config.goal_tolerance)
        assert abs(error.x) <= along + MOVING_SPEED * config.dead_time, error
        assert abs(error.y) <= across, error
        assert abs(error.phi) <= heading, error
        assert abs(state.v) <= MOVING_SPEED


def _moved(plant: PlantState, place: Placed, here: World, limit: float) -> PlantState:
    """The plant at a place; commands under way stay."""
    state = placed_state(place, here, limit)
    return replace(plant, x=state.x, y=state.y, phi=state.phi, v=state.v, delta=state.delta)
