"""Drives the runs of `benchmarks.same` in one tree and prints a line of JSON for each: its digests.

    python -P same_drive.py JOBS < RUNS

Run as a file with the tree on PYTHONPATH. It depends on public names of the package only, so that it runs in
any version of it; `names_of` and `scripted_clock` are the places that know more.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from hashlib import blake2b
from pathlib import Path
from struct import pack
from typing import Any

import numpy as np
from joblib import Parallel, delayed

import rti_mpcc
from rti_mpcc.simulation import changed, driver_of, load_scenario, simulate

PARTS = ("commands", "meanings", "plans")


def names_of(command: Any) -> tuple[str, ...]:
    """Status, source, reason of a command and the step and results of its mission, by their names."""
    mission = command.mission
    step = () if mission is None else (mission.step, mission.result.name, mission.mission_result.name)
    names = (command.status.name, command.source.name, command.diagnostics.cause.name)
    return (*names, str(command.docked), *map(str, step))


def scripted_clock(cycle: int) -> Any:
    """The decisions of a cycle about its deadline, by the cycle's number instead of the time."""
    # Stop, too, from there: it was in another module at former commits.
    from rti_mpcc.clock import TIME_IS_UP, Decisions, PlayedBack, Stop  # type: ignore[attr-defined]

    few = cycle % 7 == 3  # a cycle with one iteration
    decisions = Decisions(granted=(True,) * (1 if few else 40), late=cycle % 97 == 60)
    if cycle % 131 == 100:
        decisions = Decisions(granted=(True,), stops=(Stop(TIME_IS_UP, 0),), late=True)
    if cycle % 151 == 120:
        decisions = Decisions(granted=(True,) * 40, stops=(Stop("forced to fail", 0),) * 40)
    return PlayedBack(decisions)


@dataclass(slots=True)
class Watched:
    """A controller whose commands go into digests.

    Attributes:
        renamed: name in this tree -> its name at HEAD.
        cycles: a short digest of each cycle; times: of the cycles [s].
    """

    controller: Any
    renamed: dict[str, str]
    scripted: bool
    cycles: list[str] = field(default_factory=list)
    times: list[float] = field(default_factory=list)
    parts: dict[str, Any] = field(default_factory=lambda: {name: blake2b(digest_size=16) for name in PARTS})

    def step(self, state: Any, *, now: float, **given: Any) -> Any:
        """The controller's command; a scripted run gives it its clock."""
        if self.scripted:
            given["clock"] = scripted_clock(len(self.cycles))
        command = self.controller.step(state, now=now, **given)
        told = self.bytes_of(command)
        for name, data in told.items():
            self.parts[name].update(data)
        self.cycles.append(blake2b(b"".join(told.values()), digest_size=2).hexdigest())
        self.times.append(round(now, 3))
        return command

    def bytes_of(self, command: Any) -> dict[str, bytes]:
        """The command by its parts."""
        plan = command.trajectory
        numbers = (command.acceleration, command.steering_rate, command.speed, command.steering)
        names = [self.renamed.get(name, name) for name in names_of(command)]
        return {
            "commands": pack("<4d", *numbers),
            "meanings": "\n".join((*names, "")).encode(),
            "plans": plan.times.tobytes() + plan.states.tobytes() + plan.controls.tobytes(),
        }

    def digests(self) -> dict[str, Any]:
        """Of all cycles so far."""
        found: dict[str, Any] = {name: part.hexdigest() for name, part in self.parts.items()}
        return found | {"cycles": "".join(self.cycles), "times": self.times}


def moving(movers: list[dict[str, Any]]) -> Callable[[float], list[Any]]:
    """Outlines (4, 2) [m] of the movers at a time [s]."""
    corners = 0.5 * np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])

    def at(time: float) -> list[Any]:
        return [
            each["at"] + (time - each["since"]) * np.array(each["velocity"]) + corners * each["size"]
            for each in movers
            if each["since"] <= time < each["until"]
        ]

    return at


def drive(run: dict[str, Any], renamed: dict[str, str]) -> dict[str, Any]:
    """The digests of a run; what it raised, if it raised."""
    try:
        scenario = load_scenario(run["scenario"])
        if run["changes"]:
            scenario = changed(scenario, run["changes"])
        how = {"preset": run["preset"], "method": run["method"]}
        watched = Watched(driver_of(scenario, **how), renamed, run["scripted"])
        more: dict[str, Any] = {"obstacles_at": moving(run["movers"])} if run["movers"] else {}
        simulate(scenario, seed=run["seed"], controller=watched, **how, **more)
    except Exception as error:  # a run that raises is a result
        return {"name": run["name"], "raised": f"{type(error).__name__}: {error}"}
    return {"name": run["name"], **watched.digests()}


def driven(given: dict[str, Any], jobs: int) -> Iterator[dict[str, Any]]:
    """The digests of all runs, as they come."""
    work = (delayed(drive)(run, given["renamed"]) for run in given["runs"])
    found: Iterator[dict[str, Any]] = Parallel(n_jobs=jobs, return_as="generator_unordered")(work)
    return found


def main() -> None:
    package = Path(rti_mpcc.__file__)
    if Path.cwd().resolve() not in package.resolve().parents:
        raise SystemExit(f"{package} is of another tree")
    for found in driven(json.load(sys.stdin), int(sys.argv[1])):
        print(json.dumps(found), flush=True)


if __name__ == "__main__":
    main()
