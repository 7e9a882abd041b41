from __future__ import annotations

from io import StringIO
from typing import Any

import pytest
from rich.console import Console

from rti_mpcc.report.comparison import compared, comparison_tables


def figures(scenario: str, method: str, **changes: Any) -> dict[str, Any]:
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
    figures("inside", "dynamic"),
    figures("inside", "separated", time_to_tolerance_s=30.0, docked=False, time_to_dock_s=None),
    figures("behind", "dynamic", time_to_tolerance_s=None, cycle_ms={"p50": None, "p95": None}),
    figures("behind", "switched", direction_changes=2),
]


def shown(runs: list[dict[str, Any]], width: int = 120) -> str:
    console = Console(width=width, file=StringIO())
    for table in comparison_tables(runs):
        console.print(table)
    written = console.file
    assert isinstance(written, StringIO)
    return written.getvalue()


def test_ratios_are_to_the_first_run_of_the_same_scenario() -> None:
    inside, separated, behind, switched = (run["ratios"] for run in compared(RUNS))
    assert inside["time_to_tolerance_s"] == inside["energy.acceleration"] == 1.0
    assert separated["time_to_tolerance_s"] == pytest.approx(1.5)
    assert separated["time_to_dock_s"] is None
    assert behind["time_to_tolerance_s"] is None
    assert switched["time_to_tolerance_s"] is None
    assert switched["cycle_ms.p50"] is None


def test_the_tables_have_a_row_a_run_and_say_what_never_came() -> None:
    text = shown(RUNS)
    lines = [line.strip() for line in text.splitlines()]
    for title in ("inside", "inside, further figures", "inside, times that of dynamic (paper)", "behind"):
        assert title in lines
    assert text.count("separated (paper)") == 3
    assert "separated (paper), not docked" in text
    assert "30.00" in text
    for unit in ("[s]", "[rad]", "[rad/s]", "[m/s²]", "[m]", "[ms]"):
        assert unit in text
    assert "–" in text


def test_nothing_is_cut_off_on_a_narrow_terminal() -> None:
    text = shown([figures("inside", "constant_100", preset="paper_printed", docked=False)], width=80)
    assert "…" not in text
    for word in ("constant_100", "(paper_printed)", "docked", "reversals", "[m²/s³]", "cycle"):
        assert word in text


def test_one_run_alone_has_nothing_to_be_compared_with() -> None:
    assert len(comparison_tables(RUNS[:1])) == 2
