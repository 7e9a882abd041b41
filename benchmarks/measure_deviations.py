"""Undoes, one at a time, what this project does otherwise than the paper or its own first design.

    OMP_NUM_THREADS=1 python -m benchmarks.measure_deviations

Writes the tables of docs/decisions and docs/deviations.json. Every row is a whole run in closed loop; rows
with the same letter belong together, the first of them is the product as it is.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from contextlib import ExitStack
from typing import Any
from unittest.mock import patch

import numpy as np

from benchmarks.problems.variants import mirrored, moved, turned_round
from benchmarks.tables import (
    ROOT,
    command_line,
    named,
    number,
    origin,
    replace_block,
    table,
    write_json,
    write_table,
)
from benchmarks.variations import VARIATIONS, Variation
from geometry import Pose2
from rti_mpcc import DockingController
from rti_mpcc.model.layout import X, Y
from rti_mpcc.simulation import Scenario, changed, load_scenario, scenario_from_dict, simulate, summary
from rti_mpcc.simulation.closed_loop import controller_of
from rti_mpcc.simulation.metrics import errors_to
from rti_mpcc.simulation.result import RunResult
from rti_mpcc.types import Array, Command, Status, VehicleState

COMMAND = "python -m benchmarks.measure_deviations"
DECISIONS = ROOT / "docs" / "decisions"
PAGES = {
    "01-arrival-at-rest.md": "de",
    "02-progress-reward.md": "a",
    "04-solver-settings.md": "bcop",
    "05-damping-and-curvature.md": "g",
    "07-paper-presets.md": "fn",
    "09-margin-given-back.md": "l",
}
"""Which page of docs/decisions has the rows of which letters."""
TURN = Pose2(0.0, 0.0, 2.0)
SHIFT = Pose2(5000.0, -3000.0, 0.0)
SHORT_TO_GO = 1.2
"""An arrival is a short one when it has less time to go than this [s]."""


class Recorder:
    """Passes each cycle on to the controller and keeps what its shortest arrivals at the goal accept."""

    def __init__(self, controller: DockingController) -> None:
        self.controller = controller
        self.accepted = 0.0

    def step(self, state: VehicleState, *, now: float, **told: Any) -> Command:
        """One cycle of the controller inside."""
        command = self.controller.step(state, now=now, **told)
        left, part = command.diagnostics.time_to_go, command.diagnostics.part
        arriving = command.status is Status.ARRIVING and part == len(self.controller.state.path.parts) - 1
        if arriving and left is not None and left < SHORT_TO_GO:
            end, aim = command.trajectory.states[-1], command.diagnostics.target
            self.accepted = max(self.accepted, float(np.hypot(end[X] - aim.x, end[Y] - aim.y)))
        return command


def run(variation: Variation) -> dict[str, Any]:
    """Drive a variation and give its figures."""
    scenario = changed(load_scenario(variation.scenario), variation.changes)
    config = scenario.controller_config(variation.preset).changed(**variation.settings)
    with ExitStack() as stack:
        for name, value in variation.patches.items():
            stack.enter_context(patch(name, value))
        recorder = Recorder(controller_of(scenario, config))
        result = simulate(scenario, preset=variation.preset, controller=recorder)
    figures = summary(result)
    later = result.cycles.iterations[1:][result.cycles.solved[1:]]
    return {
        "letter": variation.letter,
        "what": variation.what,
        "scenario": variation.scenario,
        "preset": variation.preset,
        "docked": figures["docked"],
        "time_to_tolerance_s": figures["time_to_tolerance_s"],
        "time_to_dock_s": figures["time_to_dock_s"],
        "ended": f"{figures['ended']}, {figures['duration_s']:.1f} s",
        "overshoot_m": overshoot(result),
        "min_clearance_m": figures["min_clearance_m"],
        "accepted_m": recorder.accepted,
        "iterations": [float(np.percentile(later, p)) for p in (50, 95, 100)],
        "failures": figures["solver"]["failures"],
        "jitter": float(np.sqrt(np.mean(np.diff(result.cycles.steering_rate) ** 2))),
        "first_iterations": int(result.cycles.iterations[0]),
    }


def overshoot(result: RunResult) -> float:
    """How far the rear axle went past the goal, along it in the direction of the last part [m]."""
    direction = result.path.parts[-1].direction
    truth, last = result.truth, result.truth.part == result.truth.part[-1]
    return max(0.0, float((direction * errors_to(truth.goals, truth.poses)[last, 0]).max()))


def invariance(name: str) -> dict[str, float]:
    """Largest distance [m] between a scenario's trajectory and the same one elsewhere, put back."""
    base = load_scenario(name)
    reference = simulate(base).truth.poses
    cases: dict[str, tuple[Scenario, Callable[[Array], Array]]] = {
        "turned by 2 rad": (moved(base, TURN), lambda p: _turned(p, -TURN.phi)),
        "mirrored": (mirrored(base), lambda p: p * [1.0, -1.0]),
        "shifted by (5000, −3000) m": (moved(base, SHIFT), lambda p: p - [SHIFT.x, SHIFT.y]),
        "driven with the other end ahead": (turned_round(base), lambda p: p),
    }
    found = {}
    for case, (scenario, back) in cases.items():
        poses = simulate(scenario).truth.poses
        n = min(len(poses), len(reference))
        found[case] = float(np.linalg.norm(back(poses[:n, :2]) - reference[:n, :2], axis=1).max())
    return found


def wall() -> dict[str, Any]:
    """A wall across a straight corridor 20 m ahead, which is taken away after 30 s (i)."""
    straight = {"direction": 1, "curvature": 0.0, "length": 40.0}
    scenario = scenario_from_dict(
        {
            "name": "wall",
            "path": {"start": [0.0, 0.0, 0.0], "segments": [straight]},
            "corridor": {"left": 3.0, "right": -3.0},
            "goal": {"offset": [0.0, 0.0, 0.0]},
            "simulation": {"dead_time": 0.18},
        }
    )
    outline = np.array([[20.0, -3.2], [20.5, -3.2], [20.5, 3.2], [20.0, 3.2]])
    result = simulate(scenario, obstacles_at=lambda time: [outline] if time < 30.0 else [])
    front = result.truth.poses[:, 0] + scenario.vehicle.front
    standing = result.truth.times[(result.truth.times > 1.0) & (np.abs(result.truth.v) <= 0.02)]
    return {
        "stands_from_s": float(standing[0]),
        "gap_m": 20.0 - float(front[result.truth.times < 30.0].max()),
        "to_dock_s": summary(result)["time_to_dock_s"],
        "statuses": dict(Counter(status.value for status in result.cycles.status)),
        "first_iterations": int(result.cycles.iterations[0]),
    }


def _turned(points: Array, angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    turned: Array = points @ np.array([[c, s], [-s, c]])
    return turned


def rows(runs: list[dict[str, Any]]) -> list[list[str]]:
    return [
        [
            f"({each['letter']}) {each['what']}",
            f"{each['scenario']}, {each['preset']}",
            "yes" if each["docked"] else "no",
            number(each["time_to_tolerance_s"], 2),
            number(each["time_to_dock_s"], 2),
            number(100.0 * each["overshoot_m"], 1),
            number(100.0 * each["accepted_m"], 1),
            number(each["min_clearance_m"], 2),
            " / ".join(f"{value:.0f}" for value in each["iterations"]),
            str(each["failures"]),
            str(each["first_iterations"]),
            number(each["jitter"], 4),
        ]
        for each in runs
    ]


def main() -> None:
    command_line(__doc__, COMMAND).parse_args()
    source = origin(COMMAND)  # first: the code is loaded, the commit may change while it runs
    runs = []
    for variation in VARIATIONS:
        runs.append(run(variation))
        print(runs[-1])
    same = invariance("docking_behind")
    blocked = wall()
    print(same, blocked)
    content = {"origin": source, "runs": runs, "invariance_m": same}
    write_json(ROOT / "docs" / "deviations.json", {**content, "wall": blocked})
    header = ["run", "scenario, preset", "docked", "to tolerance [s]", "to dock [s]", "overshoot [cm]"]
    header += ["accepted error [cm]", "clearance [m]", "iterations p50 / p95 / max", "without a plan"]
    header += ["iterations, first cycle", "change of δ̇ a cycle, rms [rad/s]"]
    for page, letters in PAGES.items():
        own = [each for each in runs if each["letter"] in letters]
        write_table(DECISIONS / page, "deviations", header, rows(own), source)
    distances = [[case, f"{distance:.1e}"] for case, distance in same.items()]
    header = ["docking_behind", "largest distance [m]"]
    replace_block(
        DECISIONS / "08-signed-distance.md", "invariance", f"{table(header, distances)}\n\n{named(source)}"
    )
    values = [
        [number(blocked["stands_from_s"], 1), number(blocked["gap_m"], 2), number(blocked["to_dock_s"], 1)]
    ]
    header = ["stands from [s]", "front to wall [m]", "docked, the wall being gone after 30 s [s]"]
    replace_block(
        DECISIONS / "12-obstacles-in-the-way.md", "wall", f"{table(header, values)}\n\n{named(source)}"
    )


if __name__ == "__main__":
    main()
