"""What the tests of recordings share: short recorded runs, and files changed afterwards."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from math import nan
from pathlib import Path
from typing import Any

import numpy as np

from estimation import Frame, GoalMeasurement
from geometry import Pose2
from rti_mpcc.clock import CycleClock
from rti_mpcc.docking import DockingController
from rti_mpcc.qp.solver import ITERATIONS, Stop
from rti_mpcc.recording import Recorder
from rti_mpcc.recording.contents import from_line, to_line
from rti_mpcc.simulation import docking_controller
from rti_mpcc.simulation.plant import PlantState, advance
from rti_mpcc.types import Command, VehicleState
from tests.rti_mpcc.docking_runs import obeyed, short

SCENARIO = short()
"""An S of 12 m in reverse."""
CYCLE = SCENARIO.simulation.cycle
GOAL = SCENARIO.goal_pose()

Given = Callable[[int, VehicleState], dict[str, Any]]
"""Arguments of the step of a cycle, or of the place of the measured state, in place of the usual ones."""


class Forced(CycleClock):
    """Ends every QP before it is begun, as a deadline would."""

    def stop(self) -> Stop:
        return Stop("forced to fail", 0)


class Moody(CycleClock):
    """Decides by chance: some iterations may not begin, some QPs are stopped, some plans come too late."""

    def __init__(self, random: np.random.Generator) -> None:
        super().__init__()
        self._random = random

    def stop(self) -> Stop | None:
        iterations = int(self._random.integers(2)) * ITERATIONS
        return Stop("a whim", iterations) if self._random.random() < 0.3 else None

    def grants(self, least: float = 0.0) -> bool:
        super().grants(least)
        self._granted[-1] = bool(self._random.random() < 0.8)
        return self._granted[-1]

    def late(self) -> bool:
        if self._late is None:
            self._late = bool(self._random.random() < 0.2)
        return self._late


def controller(kind: type[DockingController] = DockingController, **settings: Any) -> DockingController:
    """A new controller for `SCENARIO`, with some settings changed."""
    path = SCENARIO.build_path()
    config = SCENARIO.controller_config().model_copy(update=settings)
    return kind(path, SCENARIO.build_corridor(path), config)


def usual(cycle: int, state: VehicleState) -> dict[str, Any]:
    """Given the goal and nothing else."""
    return {"goal": GOAL}


def drive(recorder: Recorder, cycles: Iterable[int], given: Given = usual) -> list[Command]:
    """The commands of so many cycles in closed loop."""
    parameters, start = SCENARIO.plant_parameters(), SCENARIO.build_path().start
    plant = PlantState(x=start.x, y=start.y, phi=start.phi)
    commands = []
    for cycle in cycles:
        plant = advance(plant, parameters, cycle * CYCLE)
        state = plant.measured
        arguments: dict[str, Any] = {"state": state, "now": cycle * CYCLE} | given(cycle, state)
        command = recorder.step(arguments.pop("state"), **arguments)
        commands.append(command)
        plant = obeyed(plant, command, parameters)
    return commands


def record(file: Path, cycles: int, given: Given = usual, **options: Any) -> Path:
    """A recording of so many cycles of `SCENARIO`."""
    with Recorder(docking_controller(SCENARIO), file, **options) as recorder:
        drive(recorder, range(cycles), given)
    return file


def box(x: float, y: float) -> np.ndarray[Any, Any]:
    """Outline (4, 2) [m] of an obstacle around a point."""
    return np.array([[x, y], [x + 0.5, y], [x + 0.5, y + 0.5], [x, y + 0.5]])


def measurement(cycle: int, state: VehicleState, **changes: Any) -> GoalMeasurement:
    """The goal seen from the vehicle, a little off."""
    vehicle, noise = Pose2(state.x, state.y, state.phi), np.diag([1e-3, 2e-3, 1e-4])
    seen, stamp = GOAL.relative_to(vehicle), cycle * CYCLE
    given = GoalMeasurement(stamp=stamp, x=seen.x + 0.01, y=seen.y - 0.02, phi=seen.phi, covariance=noise)
    return replace(replace(given, frame=Frame.VEHICLE, vehicle=vehicle), **changes)


EVENTFUL = 36
"""Cycles of the eventful recording."""
DETECTED, BEFORE, AWAY, BLIND, BACK, UNREADABLE, LATE, FAILED = 8, 12, 16, 18, 22, 24, 26, range(30, 33)
"""Its cycles with a detection, an obstacle, another one, no state, a clock that runs back, obstacles that are
none, a late detection, QPs that fail."""


def eventful(cycle: int, state: VehicleState) -> dict[str, Any]:
    """Everything that may happen."""
    given: dict[str, Any] = {"goal": GOAL if cycle < AWAY else None}
    if DETECTED - 2 <= cycle < BACK:
        given["measurements"] = [measurement(cycle, state)]
    if cycle == LATE:
        given["measurements"] = [
            measurement(cycle - 4, state, vehicle=None, covariance=None),
            measurement(cycle, state, x=nan),
        ]
    if cycle in (BEFORE, AWAY, UNREADABLE + 1):
        given["obstacles"] = [box(2.0, 8.0), box(-3.0 if cycle == BEFORE else 4.0, -3.0)]
    if cycle == UNREADABLE:
        given["obstacles"] = [[[1.0, 2.0], [3.0]]]
    if cycle == BLIND:
        given["state"] = replace(state, x=nan, v=float("inf"))
    if cycle >= BACK:
        given["now"] = cycle * CYCLE - 0.3
    if cycle in FAILED:
        given["clock"] = Forced()
    return given


def eventful_recording(file: Path) -> Path:
    """Of the eventful cycles."""
    return record(file, EVENTFUL, eventful)


def change(file: Path, cycle: int, edit: Callable[[dict[str, Any]], object], *, checked: bool) -> Path:
    """A copy of a recording with the line of a cycle edited; `checked`: its checksum corrected."""
    lines = file.read_bytes().splitlines(keepends=True)
    place = cycle + 1
    data, _ = from_line(lines[place].rstrip())
    checksum = lines[place][-12:-4]
    edit(data)
    text = to_line(data)
    lines[place] = text if checked else text[:-12] + checksum + text[-4:]
    changed = file.with_name("changed.jsonl")
    changed.write_bytes(b"".join(lines))
    return changed
