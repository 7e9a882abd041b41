"""The table of measured missions: its command, and the figures of a row."""

from __future__ import annotations

from argparse import Namespace
from math import radians
from types import SimpleNamespace
from typing import Any

from benchmarks.measure_missions import command, contacts, row

COMFORT = {"acceleration": 0.4, "lateral_acceleration": 1.0, "steering_rate": 0.5}


def driven(result: str, clearance: float | None, across: float, at_goal: float | None = 30.0) -> Any:
    error = {"longitudinal_m": 0.02, "lateral_m": across, "heading_rad": radians(-0.2)}
    figures = {
        "mission_result": result,
        "min_clearance_m": clearance,
        "time_to_tolerance_s": at_goal,
        "direction_changes": 2,
        "duration_s": 60.0,
        "peak": dict(COMFORT),
        "comfort": COMFORT,
        "mission": [
            {"kind": "dock", "result": "SUCCEEDED", "final_error": error},
            {"kind": "straight", "result": result, "final_error": error},
        ],
    }
    return SimpleNamespace(figures=figures)


def test_the_command_says_how_many_were_driven() -> None:
    told = command(Namespace(seed=7, seeds=2, count=3, undockings=4, jobs=1))
    assert told == "python -m benchmarks.measure_missions --seed 7 --seeds 2 --count 3 --undockings 4"


def test_a_row_counts_results_and_what_was_touched() -> None:
    some = [
        driven("SUCCEEDED", 0.2, 0.003),
        driven("SUCCEEDED", -0.01, -0.004),
        driven("NOT_DETECTED", None, 0.1, at_goal=None),
    ]
    cells = row("drawn", some)
    assert cells[:4] == ["drawn", "2 of 3; 1 NOT_DETECTED", "1", "−0.010"]
    assert cells[4] == "30.0 (30.0)"
    assert cells[5] == "4.0, 0.20"  # of contacts that succeeded
    assert cells[6] == "1.00 (1.00); 1.00 (1.00); 1.00 (1.00)"
    assert cells[7:] == ["2 (2)", "60 (60)"]


def test_a_row_of_no_runs_and_of_no_contacts() -> None:
    assert row("none", []) == ["none", *["-"] * 8]
    assert contacts([driven("BLOCKED", 0.1, 0.0).figures]) == "-"
