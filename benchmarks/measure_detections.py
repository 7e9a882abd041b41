"""Docks by detections over several seeds and writes the tables of docs/results.md and docs/decisions.

    OMP_NUM_THREADS=1 python -m benchmarks.measure_detections

Beside the filter the same noise as raw detections, the goal known, and the filter with one part undone at a
time. The figures go to docs/detections.json too.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import degrees, hypot
from statistics import mean
from typing import Any

import numpy as np

from benchmarks.tables import ROOT, command_line, number, origin, write_json, write_table
from rti_mpcc.simulation import GoalSource, builtin_names, load_scenario, simulate, summary
from rti_mpcc.simulation.closed_loop import Controller, controller_of

COMMAND = "python -m benchmarks.measure_detections"
SEEDS = range(10)
PARTS: dict[str, dict[str, Any]] = {"as it is": {}, "first detection accepted": {"confirmations": 1}}
"""Settings of the filter."""


def controller(scenario_name: str, settings: Mapping[str, Any]) -> Controller:
    """The controller of a scenario with other settings of its goal filter."""
    scenario = load_scenario(scenario_name)
    config = scenario.controller_config().changed(goal_tracking={"filter": settings})
    return controller_of(scenario, config)


def measure(name: str, seed: int, source: GoalSource, part: str = "as it is") -> dict[str, Any]:
    """One run's figures."""
    drives = controller(name, PARTS[part]) if source is GoalSource.DETECTED else None
    result = simulate(load_scenario(name), seed=seed, goal_source=source, controller=drives)
    found = summary(result)
    error = found["final_error"]
    return {
        "scenario": name,
        "seed": seed,
        "source": source.value,
        "part": part,
        "docked": found["docked"],
        "time_to_dock_s": found["time_to_dock_s"],
        "position_error_m": hypot(error["longitudinal_m"], error["lateral_m"]),
        "heading_error_rad": abs(error["heading_rad"]),
        "min_clearance_m": found["min_clearance_m"],
        "steering_rate_energy": found["energy"]["steering_rate"],
        "acceleration_energy": found["energy"]["acceleration"],
        "largest_acceleration_step": float(np.abs(np.diff(result.cycles.acceleration)).max()),
        "without_a_plan": found["solver"]["failures"],
    }


def row(first: str, second: str, runs: list[dict[str, Any]]) -> list[str]:
    """Means over the runs that docked, extremes over all."""
    docked = [one for one in runs if one["docked"]]
    if not docked:
        return [first, second, f"0 of {len(runs)}", *["–"] * 7]
    return [
        first,
        second,
        f"{len(docked)} of {len(runs)}",
        number(mean(one["time_to_dock_s"] for one in docked), 2),
        number(1e3 * max(one["position_error_m"] for one in docked), 0),
        number(degrees(max(one["heading_error_rad"] for one in docked)), 2),
        number(min(one["min_clearance_m"] for one in runs), 2),
        number(mean(one["steering_rate_energy"] for one in docked), 3),
        number(mean(one["acceleration_energy"] for one in docked), 2),
        number(max(one["largest_acceleration_step"] for one in runs), 2),
    ]


def main() -> None:
    command_line(__doc__, COMMAND).parse_args()
    source = origin(COMMAND)  # first: the code is loaded, the commit may change while it runs
    loaded = map(load_scenario, builtin_names())
    scenarios = [each.name for each in loaded if each.goal.measurement is not None and not each.in_area]
    runs = []
    for name in scenarios:
        for known in GoalSource:
            runs += [measure(name, seed, known) for seed in SEEDS]
            print(name, known.value, sum(one["docked"] for one in runs[-len(SEEDS) :]))
    undone = []
    for name in ("docking_noisy", "docking_moving_goal"):
        for part in PARTS:
            undone += [measure(name, seed, GoalSource.DETECTED, part) for seed in SEEDS]
            print(name, part, sum(one["docked"] for one in undone[-len(SEEDS) :]))
    write_json(ROOT / "docs" / "detections.json", {"origin": source, "runs": runs, "undone": undone})
    header = ["scenario", "goal", "docked", "to dock [s]", "largest error [mm]", "[deg]", "clearance [m]"]
    header += ["∫δ̇² [rad²/s]", "∫a² [m²/s³]", "largest step of a [m/s² a cycle]"]
    rows = [
        row(name, known.value, [r for r in runs if (r["scenario"], r["source"]) == (name, known.value)])
        for name in scenarios
        for known in (GoalSource.KNOWN, GoalSource.DETECTED, GoalSource.RAW)
    ]
    write_table(ROOT / "docs" / "results.md", "detections", header, rows, source)
    header[1] = "filter"
    rows = [
        row(name, part, [r for r in undone if (r["scenario"], r["part"]) == (name, part)])
        for name in ("docking_noisy", "docking_moving_goal")
        for part in PARTS
    ]
    page = ROOT / "docs" / "decisions" / "16-goal-filter.md"
    write_table(page, "filter_parts", header, rows, source)


if __name__ == "__main__":
    main()
