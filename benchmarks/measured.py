"""All that `measure_speed` measures, in order: what is timed runs alone, what is not in several processes."""

from __future__ import annotations

import os
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np
from rich.console import Console

from benchmarks import standing_costs
from benchmarks.ledger import Entry, closed_loop, ledger
from benchmarks.phases import SolverCounts
from benchmarks.sweeps import Variant, sweep, variants
from benchmarks.workload import Drive, PhaseTimes, Rounds, first_cycles, phase_round, record, timed_round
from benchmarks.yardstick import Yardstick, fixed_set
from rti_mpcc.types import Array

LONGEST = 10_000
"""Of the routes whose construction and memory are measured [m]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Extent:
    """How much is measured.

    Attributes:
        scenarios: driven; cycles: of each at most, None for all.
        rounds: besides the first one.
        passes: of the sweeps; quick: only the ends of each series.
        processes: started for each figure of import and memory.
        presets: driven in closed loop.
    """

    scenarios: tuple[str, ...]
    cycles: int | None = None
    rounds: int = 3
    passes: int = 3
    processes: int = 5
    quick: bool = False
    presets: tuple[str, ...] = ("default",)


QUICK = Extent(scenarios=("docking_behind",), cycles=60, rounds=2, passes=1, processes=1, quick=True)


@dataclass(frozen=True, slots=True, kw_only=True)
class Measured:
    """All of it. Times in ms unless said otherwise.

    Attributes:
        drives: the workload.
        warm_up: the first round; plain: the others.
        phases, counts: of the instrumented round.
        yardstick: measured between the drives of the rounds; sweep_yardstick: between the sweeps.
        sweeps: all variants.
        entries, loops: the accuracy ledger, and the runs in closed loop.
        imported: seconds and what was loaded; standing: by length of the route [m].
        seconds: that each part took.
    """

    drives: list[Drive]
    warm_up: Rounds
    plain: Rounds
    phases: PhaseTimes
    counts: SolverCounts
    yardstick: Yardstick
    sweep_yardstick: Yardstick
    sweeps: list[Variant]
    entries: list[Entry]
    loops: list[dict[str, Any]]
    imported: dict[str, Any]
    standing: dict[int, dict[str, list[float]]]
    seconds: dict[str, float]


class Stages:
    """Says what is being done and keeps how long each part took."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._console = Console(stderr=True)
        self._name, self._started = "", perf_counter()

    def begin(self, name: str) -> None:
        """End the part before and begin this one."""
        now = perf_counter()
        if self._name:
            self.seconds[self._name] = now - self._started
        if name:
            self._console.print(f"{name} ...", style="dim")
        self._name, self._started = name, now


def measure(extent: Extent) -> Measured:
    """What is timed runs alone and one after the other; what is not, in several processes at the end."""
    stages, problems = Stages(), fixed_set()
    stages.begin("recording the workload")
    drives = [record(name, extent.cycles) for name in extent.scenarios]
    stages.begin("timing cycles")
    yardstick = Yardstick(problems=problems)
    warm_up, plain = timed(drives, extent.rounds, yardstick)
    stages.begin("timing phases")
    phases, counts = phase_round(drives)
    stages.begin("sweeps")
    sweep_yardstick = Yardstick(problems=problems)
    sweeps = variants(quick=extent.quick)
    sweep(sweeps, passes=extent.passes, between=sweep_yardstick.measure)
    stages.begin("import, construction, memory")
    imported = standing_costs.imported(extent.processes)
    standing = {length: standing_costs.standing(length, extent.processes) for length in (30, LONGEST)}
    workers = max(1, min(os.cpu_count() or 1, 8))
    stages.begin("accuracy ledger")
    entries = ledger(drives, workers=workers)
    stages.begin("closed loop with tight settings")
    loops = closed_loop(extent.scenarios, presets=extent.presets, workers=workers)
    stages.begin("")
    return Measured(
        drives=drives,
        warm_up=warm_up,
        plain=plain,
        phases=phases,
        counts=counts,
        yardstick=yardstick,
        sweep_yardstick=sweep_yardstick,
        sweeps=sweeps,
        entries=entries,
        loops=loops,
        imported=imported,
        standing=standing,
        seconds=stages.seconds,
    )


def timed(drives: list[Drive], rounds: int, yardstick: Yardstick) -> tuple[Rounds, Rounds]:
    """The first round, and the others."""
    yardstick.measure(osqp_too=True)

    def once() -> Array:
        return timed_round(drives, lambda: yardstick.measure(osqp_too=True))

    number = first_cycles(drives)
    values = np.stack([once() for _ in range(1 + rounds)])
    return Rounds(values=values[:1], number=number), Rounds(values=values[1:], number=number)
