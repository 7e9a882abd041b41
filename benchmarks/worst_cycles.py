"""How long the longest cycles of whole campaigns are, with the deadline that a controller has by default.

    OMP_NUM_THREADS=1 python -m benchmarks.worst_cycles [--count 50] [--seed 1] [--docs]

Drives so many `hard` courses and `hard` scenes, in a process prepared as the README says (without that,
garbage collections of up to 180 ms are the longest cycles). Times are those of the thread's CPU, also as
multiples of the yardstick. Prints the table, and the longest cycles with
what was done in them; with `--docs` writes the table into docs/performance.md.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from time import thread_time
from typing import Any

import pandas as pd
from rich.progress import track

from benchmarks.figures import distribution, ratio_row
from benchmarks.problems.case import CampaignCase, Problems
from benchmarks.problems.levels import Level
from benchmarks.tables import command_line, origin, publish, table, told
from benchmarks.yardstick import Yardstick, fixed_set
from rti_mpcc import Command, ControllerConfig, VehicleState
from rti_mpcc.cli.arguments import integer
from rti_mpcc.simulation import driver_of
from rti_mpcc.simulation.batch import Case, drive

COMMAND = "python -m benchmarks.worst_cycles"
LONGEST = 10
"""That are listed, of each kind of problem."""
COLUMNS = "deadline_missed", "status", "iterations", "reason"
DEADLINE = ControllerConfig().deadline
HEADER = "time [ms]", "p50", "p95", "p99", "max", "count", *(f"p{p} / yardstick" for p in (50, 95, 99))


@dataclass(frozen=True, slots=True)
class Timed:
    """A controller, and the CPU time of each of its cycles [ms]."""

    controller: Any
    took: list[float] = field(default_factory=list)

    def step(self, state: VehicleState, **given: Any) -> Command:
        """As the controller's."""
        begun = thread_time()
        command: Command = self.controller.step(state, **given)
        self.took.append(1e3 * (thread_time() - begun))
        return command


def cycles_of(problems: Problems, count: int, seed: int) -> tuple[pd.DataFrame, int]:
    """All cycles of so many problems, by their numbers in their drives; how many of these docked."""
    found, docked = [], 0
    for index in track(range(count), description=problems.value):
        case = CampaignCase(seed=seed, level=Level.HARD, index=index, problems=problems, deadline=DEADLINE)
        scenario = case.scenario()
        timed = Timed(driver_of(scenario))
        driven = drive(Case(scenario=scenario, **case.run), timed)
        cycles = {name: getattr(driven.result.cycles, name) for name in COLUMNS}
        found.append(pd.DataFrame({"ms": timed.took, **cycles}))
        docked += driven.figures["docked"]
    return pd.concat(found), docked


def main() -> None:
    parser = command_line(__doc__, COMMAND)
    parser.add_argument("--count", type=integer(1), default=50, help="of each kind; default: %(default)s")
    parser.add_argument("--seed", type=integer(0), default=1, help="default: %(default)s")
    parser.add_argument("--docs", action="store_true", help="write docs/performance.md")
    asked = parser.parse_args()
    rows, yardstick = [], Yardstick(problems=fixed_set())
    for problems in (Problems.COURSES, Problems.SCENES):
        yardstick.measure()
        cycles, docked = cycles_of(problems, asked.count, asked.seed)
        yardstick.measure()
        first = cycles.index == 0
        for name, some in (("first cycle", cycles[first]), ("others", cycles[~first])):
            row = ratio_row(f"{problems.value}, {name}", distribution(some["ms"]), yardstick.p50)
            rows.append([*row, f"{docked} of {asked.count}", str(int(some["deadline_missed"].sum()))])
        print(cycles.nlargest(LONGEST, "ms").to_string(), end="\n\n")
    source = origin(f"{COMMAND} --count {asked.count} --seed {asked.seed}")
    text = f"{table([*HEADER, 'docked', 'deadline missed'], rows)}\n\n{told(source)}"
    publish("performance.md", {"worst": text}, docs=asked.docs)
    print(f"Yardstick: {yardstick.p50:.2f} ms.")


if __name__ == "__main__":
    main()
