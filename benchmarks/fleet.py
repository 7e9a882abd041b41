"""How fast one process steps many controllers, what threads gain, and what a controller takes.

    OMP_NUM_THREADS=1 python -m benchmarks.fleet [--docs]

Feeds 1, 30 and 300 controllers in turn with recorded inputs of docking_inside, as `measure_speed` does; each
command is compared with the recorded one. With two threads each one steps half of the controllers. Prints the
tables; with `--docs` writes them into docs/performance.md.
"""

from __future__ import annotations

import pickle
import timeit
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from time import perf_counter, process_time, thread_time
from typing import NamedTuple

import numpy as np
from rich.progress import track

from benchmarks.standing_costs import resident
from benchmarks.tables import command_line, number, origin, publish, table, told
from benchmarks.workload import Drive, feed, record
from benchmarks.yardstick import Yardstick, fixed_set
from rti_mpcc import prepare_process

COMMAND = "python -m benchmarks.fleet"
SCENARIO, CYCLES = "docking_inside", 40  # of each controller, after its first one
COUNTS = 1, 30, 300
ROUNDS = 3  # at least, with one thread and with two; the least times count
MADE = 30  # controllers, whose median time counts
HEADER = "controllers", "cycles a CPU second", "cycle / yardstick", "a second", "with 2 threads", "gain"
NEEDS = "a controller", "to make, p50 [ms]", "/ yardstick", "pickled [MB]", "RSS [MB]"


class Speed(NamedTuple):
    """Of some cycles: CPU and wall time [s]; memory that each controller has added [MB]."""

    cycles: int
    cpu: float
    wall: float
    memory: float


def in_turn(drives: Sequence[Iterator[object]]) -> int:
    """Step controllers in turn to the end of their drives; the number of cycles."""
    return sum(len(each) for each in zip(*drives, strict=True))


def stepped(drive: Drive, count: int, threads: int) -> Speed:
    """So many new controllers, each driven after its first cycle, divided between threads."""
    before = resident()
    drives: list[Iterator[object]] = [feed(drive, drive.controller()) for _ in range(count)]
    for each in drives:
        next(each)
    prepare_process()
    with ThreadPoolExecutor(threads) as pool:
        wall, cpu = perf_counter(), process_time()
        cycles = sum(pool.map(in_turn, [drives[k::threads] for k in range(threads)]))
        cpu, wall = process_time() - cpu, perf_counter() - wall
    return Speed(cycles=cycles, cpu=cpu, wall=wall, memory=(resident() - before) / count)


def least(runs: Sequence[Speed]) -> Speed:
    """The least times of runs of as many cycles each, with the memory of the first one."""
    cpu, wall = min(run.cpu for run in runs), min(run.wall for run in runs)
    return runs[0]._replace(cpu=cpu, wall=wall)


def speed_row(count: int, one: Speed, two: Speed, yardstick: float) -> list[str]:
    """Of `HEADER`, with one thread and, if there are several controllers, with two."""
    values = number(one.cycles / one.cpu, 0), number(1e3 * one.cpu / one.cycles / yardstick, 2)
    both = number(two.cycles / two.wall, 0), number(one.wall / two.wall, 2)
    return [str(count), *values, number(one.cycles / one.wall, 0), *(both if count > 1 else ("–", "–"))]


def main() -> None:
    parser = command_line(__doc__, COMMAND)
    parser.add_argument("--docs", action="store_true", help="write docs/performance.md")
    asked, yardstick = parser.parse_args(), Yardstick(problems=fixed_set())
    drive = record(SCENARIO, CYCLES + 1)
    controller = drive.controller()
    in_turn([feed(drive, controller)])
    prepare_process()
    times = timeit.repeat(drive.controller, timer=thread_time, number=1, repeat=MADE)
    speeds = {}
    for count in track(COUNTS[::-1]):  # first the most: memory that others leave would be used again
        runs = []
        for _ in range(max(ROUNDS, COUNTS[1] // count)):  # in turn: other work comes and goes
            yardstick.measure()
            runs.append([stepped(drive, count, threads) for threads in (1, 2)])
        one, two = (least(each) for each in zip(*runs, strict=True))
        speeds[count] = one, two
    rows = [speed_row(count, *speeds[count], yardstick.p50) for count in COUNTS]
    p50, size = 1e3 * float(np.median(times)), len(pickle.dumps(controller)) / 2**20
    values = p50, p50 / yardstick.p50, size, speeds[max(COUNTS)][0].memory
    needs = [SCENARIO, *(number(each, 2) for each in values)]
    text = f"{table(HEADER, rows)}\n\n{table(NEEDS, [needs])}\n\n{told(origin(COMMAND))}"
    publish("performance.md", {"fleet": text}, docs=asked.docs)
    print(f"Yardstick: {yardstick.p50:.2f} ms.")


if __name__ == "__main__":
    main()
