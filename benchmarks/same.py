"""Whether the controller still does to the bit what it did when `benchmarks/same.json` was frozen.

    make same                               # drive all of it again, say what differs
    python -m benchmarks.same --runs        # without the 240 cases of the campaigns
    python -m benchmarks.same --only NAME   # some of it; without a NAME that fits, the names are told
    python -m benchmarks.same --freeze      # write the file anew: only where a difference is wanted

Of a run three digests are kept: of its commands (numbers), its meanings (status, source, docked) and its
plans; and a short one of each cycle, by which the first that differs is found. Of a campaign's row one is
kept. Digests are of numbers and of codes that this module gives to meanings: a status may get another name,
a recording another format, and a reason another text.

The last bits depend on processor and libraries: on another machine than the file's own nothing is compared.
There, freeze at the commit that the file names, and go on from that.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Mapping
from contextlib import closing
from dataclasses import asdict, dataclass, field
from hashlib import blake2b
from pathlib import Path
from struct import pack
from typing import Any

from rich.console import Console
from rich.progress import track

from benchmarks.problems.case import CampaignCase
from benchmarks.problems.levels import Level
from benchmarks.tables import origin
from rti_mpcc.config import ControllerConfig
from rti_mpcc.planning.clock import Decisions, PlayedBack
from rti_mpcc.recording.machine import Machine
from rti_mpcc.simulation import Scenario, builtin_names, changed, docking_controller, load_scenario, simulate
from rti_mpcc.simulation.batch import spread
from rti_mpcc.simulation.campaign import drive_case
from rti_mpcc.simulation.campaign_row import CampaignRow, CaseOutcome
from rti_mpcc.simulation.forced_clock import FAILED, TIMED_OUT
from rti_mpcc.types import Command, Source, Status, VehicleState

FILE = Path(__file__).with_suffix(".json")

# What a meaning is called in a digest, for ever. A member that is renamed keeps its number.
STATUSES: Mapping[Status, int] = {
    Status.FOLLOWING: 1,
    Status.ARRIVING: 2,
    Status.SETTLING: 3,
    Status.DOCKED: 4,
    Status.CHANGING_DIRECTION: 5,
    Status.STARTING: 6,
    Status.BLOCKED: 7,
    Status.GOAL_LOST: 8,
    Status.SEARCHING: 9,
    Status.STALLED: 11,
    Status.FAILED: 12,
    Status.PLANNING: 13,
    Status.GOAL_BEHIND: 14,
    Status.GOAL_REJECTED: 15,
}
SOURCES: Mapping[Source, int] = {
    Source.SOLUTION: 1,
    Source.SHIFTED_PLAN: 2,
    Source.BRAKING: 3,
    Source.STANDSTILL: 4,
    Source.ESCAPE: 5,
}
OUTCOMES: Mapping[CaseOutcome, int] = {
    CaseOutcome.DOCKED: 1,
    CaseOutcome.STALLED: 2,
    CaseOutcome.FAILED: 3,
    CaseOutcome.UNFINISHED: 4,
    CaseOutcome.RAISED: 5,
    CaseOutcome.WORKER_DIED: 6,
    CaseOutcome.UNCONFIRMED: 7,
}

CAMPAIGN_SEED = 41
CAMPAIGN_CASES = 60
FAULTS = (
    {"kind": "frozen_state", "from": 2.0, "to": 2.2},
    {"kind": "state_jump", "from": 4.0, "to": 4.1, "size": 0.4},
    {"kind": "nan_state", "from": 6.0, "to": 6.3},
    {"kind": "lost_cycles", "from": 8.0, "to": 8.4},
    {"kind": "late_cycles", "from": 10.0, "to": 11.0, "size": 0.07},
    {"kind": "blocked", "from": 14.0, "to": 22.0, "size": 6.0},
    {"kind": "goal_jump", "from": 30.0, "to": 33.0, "size": 0.3},
    {"kind": "clock_back", "from": 36.0, "to": 36.2, "size": 1.0},
    {"kind": "weak_brakes", "from": 38.0, "to": 41.0, "size": 0.6},
)


def scripted_clock(cycle: int) -> PlayedBack:
    """What a deadline decides in a cycle, by its number instead of the time: no two runs differ by it."""
    few = cycle % 7 == 3  # a cycle that gets one iteration only
    decisions = Decisions(granted=(True,) * (1 if few else 40), late=cycle % 97 == 60)
    if cycle % 131 == 100:
        decisions = Decisions(granted=(True,), stops=(TIMED_OUT,), late=True)
    if cycle % 151 == 120:
        decisions = Decisions(granted=(True,) * 40, stops=(FAILED,) * 40)
    return PlayedBack(decisions)


@dataclass(slots=True)
class Watched:
    """A controller that is driven as it is, and whose commands go into digests."""

    controller: Any
    clock_at: Callable[[int], PlayedBack] | None = None
    cycles: list[str] = field(default_factory=list)
    parts: dict[str, Any] = field(
        default_factory=lambda: {name: blake2b(digest_size=16) for name in ("commands", "meanings", "plans")}
    )

    def step(self, state: VehicleState, *, now: float, **given: Any) -> Command:
        """The command of the controller; in runs with a scripted clock that one decides."""
        if self.clock_at is not None:
            given["clock"] = self.clock_at(len(self.cycles))
        command: Command = self.controller.step(state, now=now, **given)
        told = bytes_of(command)
        for name, data in told.items():
            self.parts[name].update(data)
        self.cycles.append(blake2b(b"".join(told.values()), digest_size=2).hexdigest())
        return command

    def digest(self) -> dict[str, str]:
        """Of all cycles so far."""
        return {name: each.hexdigest() for name, each in self.parts.items()} | {
            "cycles": "".join(self.cycles)
        }


def bytes_of(command: Command) -> dict[str, bytes]:
    """A command by what is compared of it."""
    plan = command.trajectory
    numbers = (command.acceleration, command.steering_rate, command.speed, command.steering)
    return {
        "commands": pack("<4d", *numbers),
        "meanings": bytes((STATUSES[command.status], SOURCES[command.source], command.docked)),
        "plans": plan.times.tobytes() + plan.states.tobytes() + plan.controls.tobytes(),
    }


def row_digest(row: CampaignRow) -> str:
    """Of a campaign's row: its numbers, and its meanings by their codes; neither texts nor times."""
    figures = dict(row.figures or {})
    for name in ("scenario", "method", "preset"):
        figures.pop(name, None)
    counts = figures.pop("cycles_by_status", {})
    figures["cycles_by_status"] = {STATUSES[Status(name)]: count for name, count in counts.items()}
    meant = {
        "outcome": OUTCOMES[row.outcome],
        "course": dict(row.course) if row.course else None,
        "disturbances": dict(row.disturbances) if row.disturbances else None,
        "figures": figures,
    }
    return blake2b(json.dumps(meant, sort_keys=True).encode(), digest_size=4).hexdigest()


@dataclass(frozen=True, slots=True)
class Run:
    """One run that is frozen."""

    scenario: str
    preset: str = "default"
    method: str = "dynamic"
    faulty: bool = False

    @property
    def name(self) -> str:
        """In the file."""
        faulty = "-faulty" if self.faulty else ""
        return f"{self.scenario}-{self.method}-{self.preset}{faulty}"

    def drive(self) -> dict[str, str]:
        """Its digest."""
        scenario = load_scenario(self.scenario)
        if self.faulty:
            scenario = with_faults(scenario)
        watched = Watched(
            docking_controller(scenario, preset=self.preset, method=self.method),
            clock_at=scripted_clock if self.faulty else None,
        )
        simulate(scenario, preset=self.preset, method=self.method, controller=watched)
        return watched.digest()


def with_faults(scenario: Scenario) -> Scenario:
    """A scenario in which much goes wrong, and whose controller has a deadline."""
    return changed(scenario, {"faults": list(FAULTS), "controller.deadline": 0.02})


RUNS: tuple[Run, ...] = (
    *(Run(name) for name in builtin_names()),
    *(Run(name, preset="paper") for name in ("docking_inside", "docking_behind")),
    *(
        Run(name, method=method)
        for name in ("docking_inside", "docking_behind")
        for method in ("separated", "switched")
    ),
    Run("docking_full_course", faulty=True),
)


@dataclass(frozen=True, slots=True)
class Row:
    """One case of a campaign that is frozen."""

    level: Level
    index: int

    @property
    def name(self) -> str:
        """In the file."""
        return f"campaign-{self.level.value}-{self.index:02d}"

    def drive(self) -> str:
        """Its digest."""
        return row_digest(drive_case(CampaignCase(seed=CAMPAIGN_SEED, level=self.level, index=self.index)))


Task = Run | Row
ROWS: tuple[Row, ...] = tuple(Row(level, index) for index in range(CAMPAIGN_CASES) for level in Level)
ALL: tuple[Task, ...] = (*RUNS, *ROWS)
TASKS: Mapping[str, Task] = {task.name: task for task in ALL}


def driven(task: Task) -> dict[str, str] | str:
    """The digest of a task: what a worker does."""
    return task.drive()


def difference(frozen: dict[str, str] | str | None, found: dict[str, str] | str, cycle: float) -> str:
    """What differs, in one line; "" where nothing does."""
    if found == frozen:
        return ""
    if not isinstance(frozen, dict) or not isinstance(found, dict):
        return "not in the file" if frozen is None else "its row is another"
    parts = [name for name in ("commands", "meanings", "plans") if frozen[name] != found[name]]
    before, after = frozen["cycles"], found["cycles"]
    first = next(
        (i for i in range(0, min(len(before), len(after)), 4) if before[i : i + 4] != after[i : i + 4]), None
    )
    where = "" if first is None else f", first in cycle {first // 4} (t = {first // 4 * cycle:.2f} s)"
    lengths = "" if len(before) == len(after) else f", {len(before) // 4} cycles -> {len(after) // 4}"
    return f"differs in {', '.join(parts)}{where}{lengths}"


def main() -> int:
    """Exit status: 0 all is the same (or was frozen), 1 something differs, 2 it cannot be compared."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--freeze", action="store_true", help="write what is driven now into the file")
    parser.add_argument("--only", metavar="NAME", help="only what has this in its name")
    parser.add_argument("--runs", action="store_true", help="only the runs, none of the campaign's cases")
    parser.add_argument("--jobs", type=int, default=2, help="processes (default: 2)")
    given = parser.parse_args()
    tasks = {
        name: task
        for name, task in TASKS.items()
        if (not given.only or given.only in name) and not (given.runs and isinstance(task, Row))
    }
    if not tasks:
        names = ", ".join([*(run.name for run in RUNS), "campaign-LEVEL-INDEX"])
        print(f"--only {given.only}: fits none of {names}", file=sys.stderr)
        return 2
    file: dict[str, Any] = json.loads(FILE.read_text(encoding="utf-8")) if FILE.exists() else {}
    here = asdict(Machine.here())
    del here["versions"]["rti-mpcc"]  # a release changes no bit by its number
    if not given.freeze and file.get("machine") != here:
        wanted = file.get("origin", {}).get("commit", "the commit to compare with")
        print(
            f"{FILE.name} was frozen on another machine or with other versions: check out {wanted}, "
            "run python -m benchmarks.same --freeze there, and bring its file here",
            file=sys.stderr,
        )
        return 2
    digests: dict[str, Any] = dict(file.get("digests", {})) if file.get("machine") == here else {}
    different = 0
    order = list(tasks)
    with closing(spread(driven, list(tasks.values()), given.jobs)) as results:
        for place, found in track(results, total=len(tasks), console=Console(stderr=True), transient=True):
            name = order[place]
            if given.freeze:
                digests[name] = found
            elif said := difference(digests.get(name), found, ControllerConfig().cycle):
                different += 1
                print(f"{name}: {said}", flush=True)
    if given.freeze:
        written = {"origin": origin("make same"), "machine": here, "digests": dict(sorted(digests.items()))}
        FILE.write_text(json.dumps(written, indent=1) + "\n", encoding="utf-8")
        print(f"frozen: {len(tasks)} in {FILE.name}")
        return 0
    print(f"{len(tasks) - different} of {len(tasks)} the same")
    return min(different, 1)


if __name__ == "__main__":
    sys.exit(main())
