"""What a campaign costs: drawing, driving, throughput of two processes and of a Dask cluster, memory.

    OMP_NUM_THREADS=1 python -m benchmarks.measure_campaigns [--courses 100] [--cases 100] [--rows 10000]

Throughputs are those of whole campaigns, the start of their workers left out, best of `--rounds`, which take
turns; they mean something on a machine with nothing else to do, and with so many cases that the last ones,
for which one worker waits, count for little. Seconds of CPU tell a slow machine from workers that wait: they
are those of all workers, their start included. Writes runs/campaigns.json; exit status 1 if
two processes are less than 1.8 times as fast as one, the cluster is more than 10 % slower than two processes,
or the memory of the parent grows by more than 2 % behind the first tenth of the rows.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import sys
from collections import Counter
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Any

import numpy as np

from benchmarks.problems.courses import CAMPAIGN, draws
from benchmarks.tables import ROOT, origin, write_json
from rti_mpcc.simulation import Scenario
from rti_mpcc.simulation.campaign import (
    CampaignCase,
    CampaignRow,
    CampaignSettings,
    CaseOutcome,
    Engine,
    Level,
    ProcessEngine,
    drive_case,
    run_campaign,
)

FASTER = 1.8
"""Two processes against one, at least."""
CLUSTER = 0.9
"""A Dask cluster of two workers against two processes, at least."""
GROWTH = 0.02
"""Share by which the memory of the parent may grow."""
UNPROFILED = {"DASK_DISTRIBUTED__WORKER__PROFILE__ENABLED": "False"}
"""Dask's workers look at what they do a hundred times a second, which takes some of the time."""
REASONS = {
    "the body there crosses": "no room for the body at the goal",
    "out of reach": "the goal is out of reach of the route",
    "at least as wide as the body": "the corridor is narrower than the body",
}


def reason(told: str) -> str:
    """Why a draw is rejected, in few words."""
    return next((short for part, short in REASONS.items() if part in told), told)


def drawing(seed: int, count: int) -> dict[str, Any]:
    """Seconds for each course, and what became of the draws."""
    seconds, found = [], Counter[str]()
    for index in range(count):
        began = perf_counter()
        for drawn in draws(seed, index, CAMPAIGN):
            found["accepted" if isinstance(drawn, Scenario) else reason(drawn)] += 1
        seconds.append(perf_counter() - began)
    return {"courses": count, "seconds": spread(seconds), "draws": found.total(), "by_end": dict(found)}


def driving(seed: int, count: int) -> dict[str, Any]:
    """Seconds for each case, drawing included, in this process."""
    seconds = {}
    for level in Level:
        seconds[level.value] = spread(
            [timed(drive_case, CampaignCase(seed=seed, level=level, index=index)) for index in range(count)]
        )
    return {"cases": count, "seconds": seconds}


def timed(call: Callable[..., object], *arguments: object) -> float:
    began = perf_counter()
    call(*arguments)
    return perf_counter() - began


def spread(values: list[float]) -> dict[str, float]:
    p50, p95, worst = np.percentile(values, [50, 95, 100]).round(3).tolist()
    return {"p50": p50, "p95": p95, "max": worst, "mean": round(float(np.mean(values)), 3)}


def instant(case: CampaignCase) -> CampaignRow:
    """A row as long as a real one, without any run."""
    return CampaignRow(
        index=case.index,
        scenario=case.name,
        outcome=CaseOutcome.DOCKED,
        detail="." * 2000,
        course=None,
        disturbances=None,
        figures={"min_clearance_m": 0.1, "failures_driven": 0},
    )


def rate(engine: Engine, settings: CampaignSettings, kept: list[str]) -> float:
    """Cases a second, from the first that ends to the last; their sorted rows go to `kept`."""
    ends: list[float] = []
    with TemporaryDirectory() as folder:
        place = Path(folder)
        run_campaign(settings, place, engine=engine, progress=lambda done, total: ends.append(perf_counter()))
        kept[:] = sorted((place / "rows.jsonl").read_text().splitlines())
    return (len(ends) - 1) / (ends[-1] - ends[0])


def of_workers() -> float:
    """Seconds of CPU that the processes begun by this one have taken, those that have ended."""
    taken = resource.getrusage(resource.RUSAGE_CHILDREN)
    return taken.ru_utime + taken.ru_stime


def throughput(settings: CampaignSettings, rounds: int) -> dict[str, Any]:
    """Best rates of one and two processes and of a Dask cluster of two workers, and whether rows agree."""
    os.environ |= UNPROFILED  # workers have it from here
    import distributed

    made: Any = distributed.LocalCluster  # it has no types
    rates: dict[str, list[float]] = {"one_process": [], "two_processes": [], "dask_two_workers": []}
    rows: dict[str, list[str]] = {name: [] for name in rates}
    seconds: dict[str, list[float]] = {name: [] for name in rates}
    for _ in range(rounds):
        for name in rates:
            before = of_workers()
            with ExitStack() as stack:
                engine: Engine = ProcessEngine(1 if name == "one_process" else 2)
                if name == "dask_two_workers":
                    from rti_mpcc.simulation.campaign.cluster import DaskEngine

                    options = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": None}
                    cluster = stack.enter_context(made(processes=True, **options))
                    engine = DaskEngine(cluster.scheduler_address)
                rates[name].append(rate(engine, settings, rows[name]))
            seconds[name].append(of_workers() - before)
            print(f"{name}: {rates[name][-1]:.3f} cases/s, {seconds[name][-1]:.1f} s of CPU", flush=True)
    best = {name: max(values) for name, values in rates.items()}
    return {
        "cases": settings.count,
        "rates": rates,
        "cpu_seconds": seconds,
        "two_to_one": best["two_processes"] / best["one_process"],
        "dask_to_two": best["dask_two_workers"] / best["two_processes"],
        "same_rows": rows["one_process"] == rows["two_processes"] == rows["dask_two_workers"],
    }


def memory(count: int) -> dict[str, Any]:
    """Resident memory of this process [MiB] after each tenth of so many rows."""
    settings = CampaignSettings(count=count, level=Level.NOMINAL, seed=1)
    found: list[float] = []

    def note(done: int, total: int) -> None:
        if done % (total // 10) == 0:
            pages = int(Path("/proc/self/statm").read_text().split()[1])
            found.append(pages * os.sysconf("SC_PAGE_SIZE") / 2**20)

    with TemporaryDirectory() as folder:
        run_campaign(settings, Path(folder), engine=ProcessEngine(2), drive=instant, progress=note)
    return {"rows": count, "resident_mib": found, "growth": found[-1] / found[0] - 1.0}


def parsed() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--courses", type=int, default=100, help="to draw")
    parser.add_argument("--drives", type=int, default=10, help="cases of each level to drive one by one")
    parser.add_argument("--cases", type=int, default=100, help="of each campaign that is timed")
    parser.add_argument("--rounds", type=int, default=2)
    parser.add_argument("--rows", type=int, default=10_000)
    parser.add_argument("--only", choices=["drawing", "driving", "throughput", "memory"], nargs="+")
    return parser.parse_args()


def main() -> int:
    asked = parsed()
    source = origin("python -m benchmarks.measure_campaigns")
    settings = CampaignSettings(count=asked.cases, level=Level.NOMINAL, seed=1)
    measures: dict[str, Callable[[], dict[str, Any]]] = {
        "drawing": lambda: drawing(1, asked.courses),
        "driving": lambda: driving(1, asked.drives),
        "memory": lambda: memory(asked.rows),
        "throughput": lambda: throughput(settings, asked.rounds),
    }
    found: dict[str, Any] = {"origin": source}
    for name in asked.only or measures:
        found[name] = measures[name]()
        print(json.dumps({name: found[name]}, indent=1), flush=True)
    file = ROOT / "runs" / "campaigns.json"
    file.parent.mkdir(exist_ok=True)
    write_json(file, found)
    checks = [
        "throughput" not in found or found["throughput"]["two_to_one"] >= FASTER,
        "throughput" not in found or found["throughput"]["dask_to_two"] >= CLUSTER,
        "throughput" not in found or found["throughput"]["same_rows"],
        "memory" not in found or found["memory"]["growth"] <= GROWTH,
    ]
    return 0 if all(checks) else 1


if __name__ == "__main__":
    sys.exit(main())
