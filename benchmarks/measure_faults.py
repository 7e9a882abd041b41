"""Runs docking_full_course with each kind of fault and writes the table of docs/faults.md.

    OMP_NUM_THREADS=1 python -m benchmarks.measure_faults

What the controller says is looked at from the fault's begin until `AFTERWARDS` after its end. The runs are
deterministic.
"""

from __future__ import annotations

from typing import get_args

import numpy as np

from benchmarks.tables import ROOT, command_line, number, origin, write_table
from rti_mpcc.simulation import RunResult, changed, load_scenario, simulate, summary
from rti_mpcc.simulation.faults import SIZES, FaultSection, Kind
from rti_mpcc.types import Source

COMMAND = "python -m benchmarks.measure_faults"
SCENARIO = "docking_full_course"
USUAL = (30.0, 33.0)
"""In the bends in reverse, at full speed [s]."""
OTHERS: dict[Kind, tuple[float, float]] = {"blocked": (30.0, 38.0), "weak_brakes": (38.0, 44.0)}
"""Longer than it takes to stop; and while braking before the dock [s]."""
AFTERWARDS = 2.0
"""What the controller says is looked at until so long after the fault [s]."""
STANDS = 0.02
"""Slower than this [m/s] is standing."""
UNITS = {"state_jump": "m", "late_cycles": "s", "clock_back": "s", "goal_jump": "m", "blocked": "m"}


def run(kind: Kind) -> RunResult:
    begin, end = OTHERS.get(kind, USUAL)
    return simulate(changed(load_scenario(SCENARIO), {"faults": [{"kind": kind, "from": begin, "to": end}]}))


def said(result: RunResult) -> tuple[list[str], str]:
    """What the controller says from the fault on, each thing once, and the first reason that it gives."""
    (fault,), cycles = result.scenario.faults, result.cycles
    here = np.flatnonzero((cycles.times >= fault.begin - 1e-9) & (cycles.times <= fault.end + AFTERWARDS))
    states = [(cycles.status[i].value, cycles.source[i]) for i in here]
    words = [
        status if source is Source.SOLUTION else f"{status} / {source.value}" for status, source in states
    ]
    return list(dict.fromkeys(words)), next((cycles.reason[i] for i in here if cycles.reason[i]), "–")


def stood(result: RunResult, until: float | None) -> float:
    """How long the vehicle stood from the fault on, before it docked [s]."""
    truth, begin = result.truth, result.scenario.faults[0].begin
    counted = (truth.times >= begin) & (truth.times < (np.inf if until is None else until))
    standing = counted & (np.abs(truth.v) <= STANDS)
    return float(np.count_nonzero(standing) * result.scenario.simulation.plant_step)


def size(fault: FaultSection) -> str:
    return f"{fault.amount:g} {UNITS.get(fault.kind, '')}".strip() if fault.kind in SIZES else "–"


def row(result: RunResult, usual: float | None) -> list[str]:
    found, fault = summary(result), result.scenario.faults[0]
    words, reason = said(result)
    still = stood(result, found["time_to_dock_s"])
    return [
        f"`{fault.kind}`",
        size(fault),
        f"{fault.begin:g} to {fault.end:g}",
        ", ".join(words),
        reason,
        "no" if still == 0.0 else number(still, 1),
        number(found["min_clearance_m"], 2),
        number(found["time_to_dock_s"], 1) if found["docked"] else f"no: {result.cycles.status[-1].value}",
        number(usual, 1),
    ]


def main() -> None:
    command_line(__doc__, COMMAND).parse_args()
    source = origin(COMMAND)  # first: the code is loaded, the commit may change while it runs
    usual = summary(simulate(load_scenario(SCENARIO)))["time_to_dock_s"]
    rows = []
    for kind in get_args(Kind):
        rows.append(row(run(kind), usual))
        print(*rows[-1], sep=" | ")
    header = ["fault", "size", "from, to [s]", "statuses", "first reason", "stood [s]"]
    header += ["clearance [m]", "docked [s]", "without the fault [s]"]
    write_table(ROOT / "docs" / "faults.md", "faults", header, rows, source)


if __name__ == "__main__":
    main()
