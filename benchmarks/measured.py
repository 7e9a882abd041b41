"""All that `measure_speed` measures, in order: what is timed runs alone, what is not in several processes."""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import partial
from typing import Any

import pandas as pd
from rich.console import Console

from benchmarks import standing_costs
from benchmarks.ledger import closed_loop, ledger
from benchmarks.phases import SolverCounts
from benchmarks.sweeps import Variant, sweep, variants
from benchmarks.workload import Drive, phase_round, record, timed_round
from benchmarks.yardstick import Yardstick, fixed_set

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
    """

    scenarios: tuple[str, ...]
    cycles: int | None = None
    rounds: int = 3
    passes: int = 3
    processes: int = 5
    quick: bool = False


QUICK = Extent(scenarios=("docking_behind",), cycles=60, rounds=2, passes=1, processes=1, quick=True)


@dataclass(frozen=True, slots=True, kw_only=True)
class Measured:
    """All of it. Times in ms unless said otherwise.

    Attributes:
        drives: the workload.
        warm_up: the first round, see `timed_round`; rounds: the others, one after the other.
        phases, counts: of the instrumented round, see `phase_round`.
        yardstick: measured between the drives of the rounds; sweep_yardstick: between the sweeps.
        sweeps: all variants.
        entries, loops: the accuracy ledger, and the runs in closed loop.
        imported: seconds and what was loaded; standing: by length of the route [m].
    """

    drives: list[Drive]
    warm_up: pd.DataFrame
    rounds: pd.DataFrame
    phases: pd.DataFrame
    counts: SolverCounts
    yardstick: Yardstick
    sweep_yardstick: Yardstick
    sweeps: list[Variant]
    entries: pd.DataFrame
    loops: list[dict[str, Any]]
    imported: dict[str, Any]
    standing: dict[int, dict[str, list[float]]]


def measure(extent: Extent) -> Measured:
    """What is timed runs alone and one after the other; what is not, in several processes at the end."""
    say, problems = partial(Console(stderr=True).print, style="dim"), fixed_set()
    say("recording the workload ...")
    drives = [record(name, extent.cycles) for name in extent.scenarios]
    say("timing cycles ...")
    yardstick = Yardstick(problems=problems)
    between = partial(yardstick.measure, osqp_too=True)
    between()
    warm_up, *rounds = [timed_round(drives, between) for _ in range(1 + extent.rounds)]
    say("timing phases ...")
    phases, counts = phase_round(drives)
    say("sweeps ...")
    sweep_yardstick = Yardstick(problems=problems)
    sweeps = variants(quick=extent.quick)
    sweep(sweeps, passes=extent.passes, between=sweep_yardstick.measure)
    say("import, construction, memory ...")
    imported = standing_costs.imported(extent.processes)
    standing = {length: standing_costs.standing(length, extent.processes) for length in (30, LONGEST)}
    workers = max(1, min(os.cpu_count() or 1, 8))
    say("accuracy ledger ...")
    entries = ledger(drives, workers=workers)
    say("closed loop with tight settings ...")
    loops = closed_loop(extent.scenarios, workers=workers)
    return Measured(
        drives=drives,
        warm_up=warm_up,
        rounds=pd.concat(rounds),
        phases=phases,
        counts=counts,
        yardstick=yardstick,
        sweep_yardstick=sweep_yardstick,
        sweeps=sweeps,
        entries=entries,
        loops=loops,
        imported=imported,
        standing=standing,
    )
