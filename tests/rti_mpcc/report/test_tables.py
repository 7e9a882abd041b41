"""Figures in files and tables: of a run, of several, of a mission, of a replay."""

from __future__ import annotations

import json
from dataclasses import replace
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console
from rich.table import Table

from rti_mpcc.report.files import write_files
from rti_mpcc.report.ride import Ride, ride_of_run
from rti_mpcc.report.text import (
    compared,
    comparison_tables,
    failure_lines,
    mission_rows,
    number,
    percent,
    summary_table,
)
from rti_mpcc.simulation import RunResult


def shown(table: Table, width: int = 120) -> dict[str, list[str]]:
    """Name to the other cells of a row."""
    stream = StringIO()
    Console(file=stream, width=width).print(table)
    lines = [[cell.strip() for cell in line.split("│")[1:-1]] for line in stream.getvalue().splitlines()]
    return {cells[0]: cells[1:] for cells in lines if cells}


def test_trajectory_is_the_truth_at_every_plant_step(
    run: RunResult, ride: Ride, figures: dict[str, Any], tmp_path: Path
) -> None:
    written = write_files(ride, figures, tmp_path, plots=False)
    assert [file.name for file in written] == ["summary.json", "trajectory.csv"]
    assert json.loads(written[0].read_text()) == figures
    assert written[1].read_text().splitlines()[0] == "t,x,y,phi,v,delta,theta,a,delta_dot"
    table = np.genfromtxt(written[1], delimiter=",", names=True)
    truth = run.truth
    assert table["t"] == pytest.approx(0.01 * np.arange(321), abs=1e-9)
    columns = {"y": truth.poses[:, 1], "v": truth.v, "theta": truth.theta}
    columns |= {"delta": truth.delta, "a": truth.acceleration, "delta_dot": truth.steering_rate}
    for name, values in columns.items():
        assert table[name] == pytest.approx(values, rel=1e-9, abs=1e-9)
    poses = truth.poses + np.array([7_008_600_719.29408, -8_722_360_256.93465, 0.0])
    far = ride_of_run(replace(run, truth=replace(truth, poses=poses)))
    write_files(far, figures, tmp_path, plots=False)
    row = written[1].read_text().splitlines()[1].split(",")
    assert (float(row[1]), float(row[2])) == (poses[0, 0], poses[0, 1])


def test_table_has_each_figure_with_its_unit(figures: dict[str, Any]) -> None:
    error = {"longitudinal_m": -0.0123, "lateral_m": 0.0045, "heading_rad": 0.01}
    peaks = {"acceleration": 0.4004, "lateral_acceleration": 0.5, "steering_rate": 0.5006, "jerk": 1.0000002}
    comfort = {"acceleration": 0.4, "lateral_acceleration": 1.0, "steering_rate": 0.5, "jerk": 1.0}
    times = {"time_to_tolerance_s": 22.951, "time_to_dock_s": None, "hard_braking": {"overlap": 2}}
    rows = shown(summary_table({**figures, **times, "final_error": error, "peak": peaks, "comfort": comfort}))
    for name, cells in {
        "docked": ["no", ""],
        "time to tolerance": ["22.95", "s"],
        "time to dock": ["–", ""],
        "final error longitudinal": ["−12.3", "mm"],
        "final error heading": ["0.57", "deg"],
        "min clearance": [f"{figures['min_clearance_m']:.3f}", "m"],
        "hard braking": ["2 overlap", ""],
        "peak acceleration": ["0.400 (limit 0.400)", "m/s²"],
        "peak steering rate": ["0.501 (limit 0.500 exceeded)", "rad/s"],
        "peak jerk": ["1.000 (limit 1.000)", "m/s³"],
        "energy acceleration": [f"{figures['energy']['acceleration']:.3f}", "m²/s³"],
        "rms steering": [f"{figures['rms']['steering']:.3f}", "rad"],
        "solver failures": ["0", ""],
    }.items():
        assert rows[name] == cells, name
    assert rows["cycle p50 / p95 / p99 / max"][1] == "ms"
    assert len(rows["cycle p50 / p95 / p99 / max"][0].split(" / ")) == 4


STEP = {
    "step": 0,
    "kind": "dock",
    "attempt": 0,
    "begin_s": 0.0,
    "end_s": 2.5,
    "result": "BLOCKED",
    "reason": "a wall",
    "final_error": {"longitudinal_m": 0.0011, "lateral_m": -0.002, "heading_rad": 0.0},
}


def test_steps_of_a_mission_have_a_row_and_one_for_their_error() -> None:
    steps = [STEP, {**STEP, "attempt": 1, "result": "RUNNING", "end_s": None, "final_error": None}]
    assert list(mission_rows(steps)) == [
        ("step 0: dock", "BLOCKED 0.00 to 2.50", "s"),
        ("error at its end, along / across / heading", "1.1 / −2.0 / 0.00", "mm, deg"),
        ("step 0: dock, try 2", "RUNNING 0.00 to ", "s"),
    ]
    assert failure_lines(steps) == ["step 0: dock: BLOCKED: a wall"]
    assert failure_lines([{**STEP, "reason": ""}]) == ["step 0: dock: BLOCKED"]
    assert (list(mission_rows(None)), failure_lines(None)) == ([], [])


def of(scenario: str, method: str, **changes: Any) -> dict[str, Any]:
    usual: dict[str, Any] = {
        "scenario": scenario,
        "method": method,
        "preset": "paper",
        "docked": True,
        "time_to_tolerance_s": 20.0,
        "time_to_dock_s": 21.0,
        "direction_changes": 0,
        "min_clearance_m": 0.5,
        "rms": {"steering": 0.4, "steering_rate": 0.1, "acceleration": 0.2, "lateral_acceleration": 0.3},
        "energy": {"steering_rate": 1.0, "acceleration": 2.0, "lateral_acceleration": 4.0},
        "cycle_ms": {"p50": 4.0, "p95": 5.0, "p99": 6.0, "max": 9.0},
    }
    return {**usual, **changes}


RUNS = [
    of("inside", "dynamic", time_to_dock_s=None),
    of("inside", "separated", time_to_tolerance_s=30.0, docked=False),
    of("behind", "dynamic", time_to_tolerance_s=None, cycle_ms={"p50": None, "p95": None}),
    of("behind", "switched", direction_changes=2),
]


def test_ratios_are_to_the_first_run_of_the_same_scenario() -> None:
    inside, separated, behind, switched = (run["ratios"] for run in compared(RUNS))
    assert inside["time_to_tolerance_s"] == inside["energy.acceleration"] == 1.0
    assert separated["time_to_tolerance_s"] == pytest.approx(1.5)
    for ratios, path in (
        (separated, "time_to_dock_s"),
        (behind, "time_to_tolerance_s"),
        (switched, "time_to_tolerance_s"),
        (switched, "cycle_ms.p50"),
    ):
        assert ratios[path] is None


def test_a_table_for_each_scenario_has_a_column_for_each_run() -> None:
    first, second = comparison_tables(compared(RUNS))
    assert (first.title, second.title) == ("inside", "behind")
    heads = ["", "dynamic\n(paper)", "separated\n(paper)", "unit"]
    assert [column.header for column in first.columns] == heads
    rows = shown(first)
    for name, cells in {
        "docked": ["yes", "no", ""],
        "time to tolerance": ["20.00", "30.00", "s"],
        "time to dock": ["–", "21.00", "s"],
        "rms acceleration": ["0.200", "0.200", "m/s²"],
        "time to tolerance, ratio": ["1.00", "1.50", ""],
        "time to dock, ratio": ["–", "–", ""],
    }.items():
        assert rows[name] == cells
    (alone,) = comparison_tables(compared(RUNS[:1]))
    assert not [name for name in shown(alone) if name.endswith(", ratio")]


def test_numbers_have_no_sign_of_zero_and_only_all_is_all() -> None:
    cases = [(-0.04, 1, "0.0"), (-0.06, 1, "−0.1"), (None, 2, "–"), (float("nan"), 2, "–"), (0.0, 0, "0")]
    assert [number(value, digits) for value, digits, _ in cases] == [told for *_, told in cases]
    shares = {0.0: "0.00 %", 1e-6: "0.01 %", 0.5: "50.00 %", 0.999999: "99.99 %", 1.0: "100.00 %"}
    assert [percent(share) for share in shares] == list(shares.values())
