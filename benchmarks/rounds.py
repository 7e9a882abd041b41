"""Rounds through the workload: times of every cycle, and by phase."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from benchmarks.phases import PHASES, SolverCounts, counted, watched
from benchmarks.workload import Drive, check_same, feed, step
from rti_mpcc import DockingController, prepare_process
from rti_mpcc.types import Array, Command

COLUMNS = ("step_ms", "prepare_ms", "feedback_ms", "solve_ms", "iterations")
"""What a round holds of every cycle: time of step() as its caller sees it, of the two phases and of OSQP's
solve as the controller takes them, and OSQP's iterations."""


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
