"""The workload: the inputs of every cycle of the built-in scenarios, recorded once, to be fed again.

Inputs, not timings: each scenario is driven in closed loop with a `Recorder`, and what it wrote is read back.
Fresh controllers are then fed with the same inputs, and their commands compared with the recorded ones, so
that every round does the very same work.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from rti_mpcc.docking import DockingController
from rti_mpcc.planning.clock import Decisions, PlayedBack
from rti_mpcc.recording import Cycle, Header, Inputs, Recorder, read_recording
from rti_mpcc.recording.contents import core_of
from rti_mpcc.simulation import docking_controller, load_scenario, simulate
from rti_mpcc.types import Array, Command

SAME = 1e-9
"""Commands of a round differ from the recorded ones by at most this [m/s²], [rad/s]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Drive:
    """One scenario's cycles.

    Attributes:
        name: of the scenario.
        header: what its controller is made from.
        cycles: inputs of each, and the decisions of a clock that was not the wall clock, else None.
        commands: (m, 2) recorded acceleration [m/s²] and steering rate [rad/s].
        first_ms: (m,) times of step() while it was recorded: the first time that the code ran [ms].
    """

    name: str
    header: Header
    cycles: tuple[tuple[Inputs, Decisions | None], ...]
    commands: Array
    first_ms: Array

    def controller(self) -> DockingController:
        """A fresh one like the one that was recorded."""
        return core_of(self.header.driver())


def record(name: str, most: int | None = None) -> Drive:
    """Drive a built-in scenario in closed loop and keep what its controller was told.

    Args:
        name: of the scenario; most: keep only so many cycles from the first one on.
    """
    scenario = load_scenario(name)
    with TemporaryDirectory() as folder:
        file = Path(folder) / "recording.jsonl"
        with Recorder(docking_controller(scenario), file) as recorder:
            result = simulate(scenario, controller=recorder)
        recording = read_recording(file)
    cycles = recording.cycles[:most]
    return Drive(
        name=name,
        header=recording.header,
        cycles=tuple((cycle.inputs, _forced(cycle)) for cycle in cycles),
        commands=np.array([_commanded(cycle.command) for cycle in cycles]),
        first_ms=np.array(result.cycles.step_ms[:most]),
    )


def feed(
    drive: Drive,
    each: Callable[[int, Command], None] | None = None,
    controller: DockingController | None = None,
) -> None:
    """Feed a fresh controller with a drive's inputs; `each` gets number and command of every cycle.

    Raises RuntimeError where a command is not the recorded one: then it is not the same work.
    """
    controller = controller or drive.controller()
    for number, (inputs, decided) in enumerate(drive.cycles):
        command = step(controller, inputs, decided)
        check_same(drive, number, command)
        if each is not None:
            each(number, command)


def step(controller: DockingController, inputs: Inputs, decided: Decisions | None) -> Command:
    """One cycle as it was recorded."""
    if inputs.goal_cleared:
        controller.clear_goal()
    return controller.step(
        inputs.state,
        now=inputs.now,
        goal=inputs.goal,
        measurements=inputs.measurements,
        obstacles=inputs.obstacles,
        clock=None if decided is None else PlayedBack(decided),
    )


def check_same(drive: Drive, number: int, command: Command) -> None:
    """Raise RuntimeError where a command is not the recorded one."""
    off = float(np.abs(drive.commands[number] - _commanded(command)).max())
    if not off <= SAME:
        raise RuntimeError(
            f"{drive.name}: cycle {number} of a fresh controller differs from the recorded one by {off:.3g}: "
            "the controller is not deterministic, or something acts on it from outside"
        )


def first_cycles(drives: Sequence[Drive]) -> Array:
    """Number of each cycle in its drive, for all drives one after the other."""
    return np.concatenate([np.arange(len(drive.cycles)) for drive in drives])


def _commanded(command: Command | None) -> tuple[float, float]:
    if command is None:
        raise RuntimeError("a recorded cycle raised instead of giving a command")
    return command.acceleration, command.steering_rate


def _forced(cycle: Cycle) -> Decisions | None:
    """What a fault of the scenario decided in place of the wall clock, or None."""
    decided = cycle.decisions
    free = all(decided.granted) and not any(decided.stops) and not decided.late
    return None if free else decided
