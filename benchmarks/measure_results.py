"""Runs every built-in scenario whose goal is known, with every preset; writes tables of docs.

    OMP_NUM_THREADS=1 python -m benchmarks.measure_results

The figures go to docs/results.json too. Nothing timed is among them: other work on the machine changes none.
"""

from __future__ import annotations

from collections import Counter
from math import degrees
from typing import Any

from benchmarks.reproduction.published import published
from benchmarks.tables import (
    ENERGIES,
    ROOT,
    TIMES,
    Column,
    cells,
    command_line,
    heads,
    number,
    origin,
    replace_block,
    table,
    told,
    write_json,
    write_table,
)
from rti_mpcc import ControllerConfig
from rti_mpcc.iteration import DAMPING, DAMPING_SHARE, FIRST_DAMPING
from rti_mpcc.ocp.objectives import FIRM_TIME, GOAL_CLIP
from rti_mpcc.ocp.stage_cost import LEAST_TIME
from rti_mpcc.qp.filling import CHANGE_WEIGHT, IDLE_WEIGHT, ROW_SCALING_FROM
from rti_mpcc.qp.pattern import BOUND_UNIT
from rti_mpcc.qp.solver import ITERATIONS, OVER_RELAXATION, RHO
from rti_mpcc.simulation import builtin_names, load_scenario, simulate, summary
from rti_mpcc.simulation.metrics import untimed

COMMAND = "python -m benchmarks.measure_results"

# Of the method that the paper proposes, by scenario.
PUBLISHED: dict[str, dict[str, Any]] = {
    run["scenario"]: run for run in published()["runs"] if run["method"] == "dynamic"
}
COLUMNS = (*TIMES, Column("direction changes", "direction_changes", 0), *ENERGIES)
SOLVER = ControllerConfig().solver
SOLVED = ("default", "paper")
SCENARIOS = tuple(name for name in builtin_names() if load_scenario(name).goal.measurement is None)
"""Those whose goal is known; the others are measured by measure_detections."""


def measure(scenario: str, preset: str) -> dict[str, Any]:
    """The summary of a run but for what is timed, and how many cycles had which status."""
    result = simulate(load_scenario(scenario), preset=preset)
    statuses = Counter(status.value for status in result.cycles.status)
    return {**untimed(summary(result)), "cycles_by_status": dict(statuses)}


def result_rows(runs: list[dict[str, Any]]) -> list[list[str]]:
    rows = []
    for scenario in SCENARIOS:
        for run in runs:
            if run["scenario"] == scenario and run["preset"] in SOLVED:
                rows.append(_row(scenario, run["preset"], run))
        if scenario in PUBLISHED:
            rows.append(_row(scenario, "*published code*", PUBLISHED[scenario]))
    return rows


def _row(scenario: str, preset: str, run: dict[str, Any]) -> list[str]:
    return [scenario, preset, *cells(run, COLUMNS)]


def printed_rows(runs: list[dict[str, Any]]) -> list[list[str]]:
    rows = []
    for run in runs:
        if run["preset"] != "paper_printed":
            continue
        error, statuses = run["final_error"], run["cycles_by_status"]
        most = sorted(statuses, key=statuses.__getitem__, reverse=True)[:3]
        rows.append(
            [
                run["scenario"],
                "yes" if run["docked"] else "no",
                number(run["time_to_tolerance_s"], 1),
                number(error["longitudinal_m"], 2),
                number(error["lateral_m"], 2),
                number(degrees(error["heading_rad"]), 1),
                str(run["solver"]["failures"]),
                f"{run['ended']}, {run['duration_s']:.0f} s",
                ", ".join(f"{name} {statuses[name]}" for name in most),
            ]
        )
    return rows


def not_docked(runs: list[dict[str, Any]]) -> str:
    """One sentence for each run of the table that did not dock."""
    told = []
    for run in runs:
        error = run["final_error"]
        if run["preset"] in SOLVED and not run["docked"]:
            told.append(
                f"Not docked: `{run['scenario']}` with `{run['preset']}` ended at rest "
                f"{number(100.0 * error['longitudinal_m'], 1)} cm longitudinally, "
                f"{number(100.0 * error['lateral_m'], 1)} cm laterally and "
                f"{number(degrees(error['heading_rad']), 1)} deg off the goal."
            )
    return " ".join(told) or "All of them docked."


def constant_rows() -> list[list[str]]:
    """Numbers of the method, read from the settings, or from where they act."""
    return [
        ["damping from a first guess on", "`rti_mpcc.iteration.FIRST_DAMPING`", f"{FIRST_DAMPING:g}"],
        ["damping from cycle to cycle", "`rti_mpcc.iteration.DAMPING`", f"{DAMPING:g}"],
        [
            "share of it that the next iteration has, until then",
            "`rti_mpcc.iteration.DAMPING_SHARE`",
            f"{DAMPING_SHARE:g}",
        ],
        ["weight on every change", "`qp.filling.CHANGE_WEIGHT`", f"{CHANGE_WEIGHT:g}"],
        ["the same on idle progress", "`qp.filling.IDLE_WEIGHT`", f"{IDLE_WEIGHT:g}"],
        ["unit of rows of bounds, in units", "`qp.pattern.BOUND_UNIT`", f"{BOUND_UNIT:g}"],
        [
            "rows are scaled down beyond, in units",
            "`qp.filling.ROW_SCALING_FROM`",
            f"{ROW_SCALING_FROM:g}",
        ],
        [
            "tolerance, iterations of OSQP",
            "`SolverSettings`, `qp.solver`",
            f"{SOLVER.tolerance:g}, {ITERATIONS}",
        ],
        ["ρ, α", "`qp.solver`", f"{RHO:g}, {OVER_RELAXATION:g}"],
        ["effort fades below [s]", "`ocp.objectives.FIRM_TIME`", f"{FIRM_TIME:g}"],
        ["shortest time to go [s]", "`rti_mpcc.ocp.stage_cost.LEAST_TIME`", f"{LEAST_TIME:g}"],
        ["goal's pull is linear beyond [m], [rad]", "`ocp.objectives.GOAL_CLIP`", f"{GOAL_CLIP}"],
    ]


def main() -> None:
    command_line(__doc__, COMMAND).parse_args()
    source = origin(COMMAND)  # first: the code is loaded, the commit may change while it runs
    runs = []
    for preset in ("default", "paper", "paper_printed"):
        for scenario in SCENARIOS:
            runs.append(measure(scenario, preset))
            print(f"{scenario}, {preset}: docked {runs[-1]['docked']}, T {runs[-1]['time_to_tolerance_s']}")
    write_json(ROOT / "docs" / "results.json", {"origin": source, "published": PUBLISHED, "runs": runs})
    text = table(["scenario", "preset", *heads(COLUMNS)], result_rows(runs))
    replace_block(ROOT / "docs" / "results.md", "results", f"{text}\n\n{not_docked(runs)} {told(source)}")
    page = ROOT / "docs" / "decisions" / "04-solver-settings.md"
    replace_block(page, "constants", table(["constant", "where", "value"], constant_rows()))
    header = ["scenario", "docked", "to tolerance [s]", "longitudinal [m]", "lateral [m]", "heading [deg]"]
    header += ["unsolved QPs", "ended", "most frequent statuses (cycles)"]
    page = ROOT / "docs" / "decisions" / "07-paper-presets.md"
    write_table(page, "paper_printed", header, printed_rows(runs), source)


if __name__ == "__main__":
    main()
