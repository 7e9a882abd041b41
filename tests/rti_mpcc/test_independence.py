"""Controllers in one process, interleaved and in threads, don't influence each other's results."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from threading import Barrier
from typing import Any

import numpy as np
import pytest

from estimation import GoalMeasurement
from rti_mpcc.simulation import Scenario, docking_controller
from rti_mpcc.simulation.plant import PlantState, advance
from rti_mpcc.types import Command
from tests.rti_mpcc.docking_runs import between_obstacles, narrow, obeyed, short, straight

CYCLES = 80


TASKS: dict[str, tuple[Scenario, bool]] = {
    "short, detected": (short(), True),
    "reverse, obstacles": (between_obstacles(-1), False),
    "forward, detected": (straight(1, 15.0), True),
    "reverse, narrow": (narrow(-1, 0.2), False),
}
"""Scenarios, and whether the goal is known from detections only."""


def commands(name: str) -> Iterator[Command]:
    """The commands of a run, one a cycle, as the plant goes on."""
    scenario, detected = TASKS[name]
    path, parameters = scenario.build_path(), scenario.plant_parameters()
    controller, goal = docking_controller(scenario), scenario.goal_pose()
    noise = np.random.default_rng(1)
    plant = PlantState(x=path.start.x, y=path.start.y, phi=path.start.phi)
    for cycle in range(CYCLES):
        plant = advance(plant, parameters, cycle * scenario.simulation.cycle)
        x, y, phi = (np.array([goal.x, goal.y, goal.phi]) + noise.normal(0.0, [0.05, 0.05, 0.01])).tolist()
        seen = GoalMeasurement(stamp=plant.time, x=x, y=y, phi=phi)
        given: dict[str, Any] = {"measurements": [seen]} if detected else {"goal": goal}
        command = controller.step(plant.measured, now=plant.time, **given)
        yield command
        plant = obeyed(plant, command, parameters)


@pytest.fixture(scope="module")
def alone() -> dict[str, list[Command]]:
    return {name: list(commands(name)) for name in TASKS}


def assert_same(run: list[Command], other: list[Command]) -> None:
    """Bit by bit."""
    assert len(run) == len(other) == CYCLES
    for one, two in zip(run, other, strict=True):
        assert numbers(one) == numbers(two)
        assert (one.status, one.source, one.docked) == (two.status, two.source, two.docked)
        assert one.diagnostics.reason == two.diagnostics.reason
        assert one.diagnostics.iterations == two.diagnostics.iterations
        for name in ("times", "states", "controls"):
            assert getattr(one.trajectory, name).tobytes() == getattr(two.trajectory, name).tobytes()


def numbers(command: Command) -> list[str]:
    values = (command.acceleration, command.steering_rate, command.speed, command.steering)
    return [value.hex() for value in values]


def test_two_that_take_turns_are_as_alone(alone: dict[str, list[Command]]) -> None:
    one, two = "short, detected", "reverse, obstacles"
    both = list(zip(commands(one), commands(two), strict=True))
    assert_same([first for first, _ in both], alone[one])
    assert_same([second for _, second in both], alone[two])


@pytest.mark.acceptance
def test_one_in_each_of_four_threads_is_as_alone(alone: dict[str, list[Command]]) -> None:
    together = Barrier(len(TASKS))

    def run(name: str) -> list[Command]:
        together.wait()
        return list(commands(name))

    with ThreadPoolExecutor(len(TASKS)) as threads:
        found = dict(zip(TASKS, threads.map(run, TASKS), strict=True))
    for name in TASKS:
        assert_same(found[name], alone[name])
