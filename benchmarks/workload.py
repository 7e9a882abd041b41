"""The workload: the inputs of every cycle of the built-in scenarios, recorded once, to be fed again.

Inputs, not timings: each scenario is driven in closed loop with a `Recorder`, and what it wrote is read back.
Fresh controllers are then fed with the same inputs, and their commands compared with the recorded ones, so
that every round does the very same work.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

import numpy as np
import pandas as pd

from benchmarks.phases import SolverCounts, counted, watched
from rti_mpcc import DockingController, prepare_process
from rti_mpcc.clock import PlayedBack
from rti_mpcc.recording import Cycle, Header, Recorder, read_recording
from rti_mpcc.recording.contents import core_of
from rti_mpcc.simulation import changed, docking_controller, load_scenario, simulate
from rti_mpcc.types import Command

SAME = 1e-9
"""Commands of a round differ from the recorded ones by at most this [m/s²], [rad/s]."""
COLUMNS = ("step_ms", "prepare_ms", "feedback_ms", "solve_ms", "iterations")
"""What a round holds of every cycle: time of step() as its caller sees it, of the two phases and of the
QPs' solve as the controller takes them, and the iterations of the solvers."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Drive:
    """One scenario's cycles, and what its controller is made from."""

    name: str
    header: Header
    cycles: tuple[Cycle, ...]

    def controller(self) -> DockingController:
        """A fresh one like the one that was recorded."""
        return core_of(self.header.driver())


def record(name: str, most: int | None = None) -> Drive:
    """Drive a built-in scenario in closed loop, or only its first `most` cycles; keep their inputs."""
    scenario = load_scenario(name)
    if most is not None:
        seconds = min(most * scenario.simulation.cycle, scenario.simulation.duration)
        scenario = changed(scenario, {"simulation.duration": seconds})
    with TemporaryDirectory() as folder:
        file = Path(folder) / "recording.jsonl"
        with Recorder(docking_controller(scenario), file) as recorder:
            simulate(scenario, controller=recorder)
        recording = read_recording(file)
    return Drive(name=name, header=recording.header, cycles=recording.cycles[:most])


def feed(drive: Drive, controller: DockingController) -> Iterator[tuple[int, Command, float]]:
    """Feed a fresh controller with a drive's inputs: number, command and time [ms] of every cycle.

    Raises RuntimeError where a command is not the recorded one: then it is not the same work.
    """
    for cycle in drive.cycles:
        inputs, decided, recorded = cycle.inputs, cycle.decisions, cycle.command
        # Not all by the wall clock: a fault of the scenario may have decided in its place.
        free = all(decided.granted) and not any(decided.stops) and not decided.late
        clock = None if free else PlayedBack(decided)
        if inputs.goal_cleared:
            controller.clear_goal()
        begun = perf_counter()
        command = controller.step(
            inputs.state,
            now=inputs.now,
            goal=inputs.goal,
            measurements=inputs.measurements,
            obstacles=inputs.obstacles,
            clock=clock,
        )
        took = perf_counter() - begun
        if recorded is None or not _apart(recorded, command) <= SAME:
            raise RuntimeError(
                f"{drive.name}: cycle {cycle.number} of a fresh controller differs from the recorded one: "
                "the controller is not deterministic, or something acts on it from outside"
            )
        yield cycle.number, command, 1e3 * took


def _apart(one: Command, other: Command) -> float:
    """The larger difference of the two rates [m/s²], [rad/s]."""
    return max(abs(one.acceleration - other.acceleration), abs(one.steering_rate - other.steering_rate))


def timed_round(drives: Sequence[Drive], between: Callable[[], None]) -> pd.DataFrame:
    """`COLUMNS` of all cycles of a round, by their numbers; `between` comes after each drive."""
    rows: list[tuple[float, ...]] = []
    numbers: list[int] = []
    for drive in drives:
        controller = drive.controller()
        prepare_process()  # as a user's is, once the controller exists
        for number, command, took in feed(drive, controller):
            seen = command.diagnostics
            rows.append((took, seen.prepare_ms, seen.feedback_ms, seen.solve_ms, seen.iterations))
            numbers.append(number)
        between()
    return pd.DataFrame(rows, columns=list(COLUMNS), index=numbers)


def later(cycles: pd.DataFrame) -> pd.DataFrame:
    """All but the first cycle of each drive."""
    return cycles[cycles.index > 0]


def solving(cycles: pd.DataFrame) -> pd.DataFrame:
    """Those of `later` in which a QP was solved."""
    return later(cycles)[later(cycles)["iterations"] > 0]


def phase_round(drives: Sequence[Drive]) -> tuple[pd.DataFrame, SolverCounts]:
    """Times of the phases [ms] as `timed_round`, by stop watches; and the work of OSQP."""
    rows: list[dict[str, float]] = []
    numbers: list[int] = []
    with watched() as watches, counted() as counts:
        for drive in drives:
            controller = drive.controller()
            watches.read()
            prepare_process()
            for number, _, _ in feed(drive, controller):
                rows.append(watches.read())
                numbers.append(number)
    counts.check()
    times = 1e3 * pd.DataFrame(rows, index=np.array(numbers))
    before = times.loc[:, "shift of the last plan":"prepare, rest"].sum(axis=1)
    after = times.loc[:, "QP solve":"feedback, rest"].sum(axis=1)
    return times.assign(prepare=before, feedback=after, total=times.sum(axis=1)), counts
