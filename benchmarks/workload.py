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
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from benchmarks.phases import PHASES, SolverCounts, counted, watched
from rti_mpcc import DockingController, prepare_process
from rti_mpcc.clock import Decisions, PlayedBack
from rti_mpcc.recording import Cycle, Header, Inputs, Recorder, read_recording
from rti_mpcc.recording.contents import core_of
from rti_mpcc.simulation import docking_controller, load_scenario, simulate
from rti_mpcc.types import Array, Command

SAME = 1e-9
"""Commands of a round differ from the recorded ones by at most this [m/s²], [rad/s]."""
COLUMNS = ("step_ms", "prepare_ms", "feedback_ms", "solve_ms", "iterations")
"""What a round holds of every cycle: time of step() as its caller sees it, of the two phases and of OSQP's
solve as the controller takes them, and OSQP's iterations."""


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


@dataclass(frozen=True, slots=True, kw_only=True)
class Rounds:
    """Several rounds through the same cycles.

    Attributes:
        values: (rounds, cycles, columns), see `COLUMNS`.
        number: (cycles,) of each cycle in its drive.
    """

    values: Array
    number: Array

    def of(self, column: str, *, first: bool = False) -> Array:
        """(rounds, n) of all but the first cycle of each drive, or of those alone."""
        chosen = (self.number == 0) if first else (self.number > 0)
        values: Array = self.values[:, chosen, COLUMNS.index(column)]
        return values

    def solving(self, column: str) -> Array:
        """(rounds, n) of the cycles, but the first ones, in which a QP was solved."""
        chosen = self.of("iterations")[0] > 0.0
        values: Array = self.of(column)[:, chosen]
        return values


def timed_round(drives: Sequence[Drive], between: Callable[[], None] = lambda: None) -> Array:
    """(cycles, columns) of one round, fresh controllers; `between` is called after each drive."""
    rows: list[Array] = []
    for drive in drives:
        controller = drive.controller()
        prepare_process()  # as a user's is, once the controller exists
        rows.append(_timed_drive(drive, controller))
        between()
    return np.concatenate(rows)


def _timed_drive(drive: Drive, controller: DockingController) -> Array:
    rows = np.empty((len(drive.cycles), len(COLUMNS)))
    for number, (inputs, decided) in enumerate(drive.cycles):
        begun = perf_counter()
        command = step(controller, inputs, decided)
        took = perf_counter() - begun
        seen = command.diagnostics
        rows[number] = 1e3 * took, seen.prepare_ms, seen.feedback_ms, seen.solve_ms, seen.iterations
        check_same(drive, number, command)
    return rows


@dataclass(frozen=True, slots=True, kw_only=True)
class PhaseTimes:
    """Of one instrumented round.

    Attributes:
        phases_ms: (cycles, phases) exclusive times in the order of `PHASES`.
        number: (cycles,) of each cycle in its drive.
    """

    phases_ms: Array
    number: Array

    def rows(self, chosen: NDArray[np.bool_]) -> dict[str, Array]:
        """Name -> (n,) times of the cycles with `chosen` (cycles,) true; sums of the phases at the end."""
        names = [name for name, _ in PHASES]
        times = self.phases_ms[chosen]
        found: dict[str, Array] = dict(zip(names, times.T, strict=True))
        found["prepare"] = times[:, names.index("shift of the last plan") : names.index("OSQP solve")].sum(1)
        found["feedback"] = times[:, names.index("OSQP solve") : names.index("check of the plan")].sum(1)
        found["total"] = times.sum(axis=1)
        return found


def phase_round(drives: Sequence[Drive]) -> tuple[PhaseTimes, SolverCounts]:
    """One round with stop watches around the phases, and OSQP's work counted."""
    rows: list[list[float]] = []
    numbers: list[int] = []

    def note(number: int, _: Command) -> None:
        rows.append(watches.read())
        numbers.append(number)

    with watched() as watches, counted() as counts:
        for drive in drives:
            controller = drive.controller()
            watches.read()
            prepare_process()
            feed(drive, note, controller)
    counts.check()
    return PhaseTimes(phases_ms=1e3 * np.array(rows), number=np.array(numbers)), counts
