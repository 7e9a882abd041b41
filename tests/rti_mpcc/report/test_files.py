"""The files and the table of a run."""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console

from rti_mpcc.report.files import write_files
from rti_mpcc.report.table import summary_table
from rti_mpcc.simulation import RunResult


def test_trajectory_is_the_truth_at_every_plant_step(
    run: RunResult, figures: dict[str, Any], tmp_path: Path
) -> None:
    write_files(run, figures, tmp_path, plots=False)
    file = tmp_path / "trajectory.csv"
    assert file.read_text().splitlines()[0] == "t,x,y,phi,v,delta,theta,a,delta_dot"
    table = np.genfromtxt(file, delimiter=",", names=True)
    truth = run.truth
    assert len(table) == 321
    assert table["t"] == pytest.approx(0.01 * np.arange(321), abs=1e-9)
    for name, values in (("y", truth.poses[:, 1]), ("v", truth.v), ("theta", truth.theta)):
        assert table[name] == pytest.approx(values, rel=1e-9, abs=1e-9)
    for name, values in (("a", truth.acceleration), ("delta_dot", truth.steering_rate)):
        assert table[name] == pytest.approx(values, rel=1e-9, abs=1e-9)


def test_summary_file_is_the_summary(run: RunResult, figures: dict[str, Any], tmp_path: Path) -> None:
    write_files(run, figures, tmp_path, plots=False)
    assert json.loads((tmp_path / "summary.json").read_text()) == figures


@pytest.mark.parametrize("plots", [True, False])
def test_pictures_are_written_unless_not_wanted(
    run: RunResult, figures: dict[str, Any], tmp_path: Path, plots: bool
) -> None:
    written = write_files(run, figures, tmp_path, plots=plots)
    names = ["summary.json", "trajectory.csv", *(["overview.png", "timeline.png"] if plots else [])]
    assert [file.name for file in written] == names
    assert sorted(names) == sorted(file.name for file in tmp_path.iterdir())
    for file in written[2:]:
        assert file.read_bytes().startswith(b"\x89PNG")


def test_summary_with_infinity_is_not_written(
    run: RunResult, figures: dict[str, Any], tmp_path: Path
) -> None:
    with pytest.raises(ValueError, match="JSON"):
        write_files(run, {**figures, "distance_m": float("inf")}, tmp_path, plots=False)


def told(figures: dict[str, Any]) -> dict[str, tuple[str, str]]:
    """Name to value and unit, as the table shows them."""
    stream = io.StringIO()
    Console(file=stream, width=100).print(summary_table(figures))
    rows = {}
    for line in stream.getvalue().splitlines():
        cells = [cell.strip() for cell in line.split("│")[1:-1]]
        if len(cells) == 3:
            rows[cells[0]] = (cells[1], cells[2])
    return rows


def test_table_tells_the_figures_and_what_never_happened(figures: dict[str, Any]) -> None:
    rows = told({**figures, "time_to_tolerance_s": 22.951, "time_to_dock_s": None})
    assert rows["docked"] == ("no", "")
    assert rows["time to tolerance"] == ("22.95", "s")
    assert rows["time to dock"] == ("never", "")
    assert rows["smallest clearance"] == (f"{figures['min_clearance_m']:.3f}", "m")
    assert not [name for name in rows if "goal" in name]


def test_table_marks_peaks_that_it_shows_above_comfort(figures: dict[str, Any]) -> None:
    peaks = {"acceleration": 0.4004, "lateral_acceleration": 0.5, "steering_rate": 0.5006, "jerk": 1.0000002}
    comfort = {"acceleration": 0.4, "lateral_acceleration": 1.0, "steering_rate": 0.5, "jerk": 1.0}
    rows = told({**figures, "peak": {**figures["peak"], **peaks}, "comfort": comfort})
    assert rows["peak / comfort acceleration"] == ("0.400 / 0.400", "m/s²")
    assert rows["peak / comfort lateral acceleration"] == ("0.500 / 1.000", "m/s²")
    assert rows["peak / comfort steering rate"] == ("above 0.501 / 0.500", "rad/s")
    assert rows["peak / comfort jerk"] == ("1.000 / 1.000", "m/s³")


def test_table_tells_how_the_goal_was_known(watched_figures: dict[str, Any]) -> None:
    error = {"longitudinal_m": -0.0123, "lateral_m": 0.0045, "heading_rad": 0.01}
    changes = {"accepted": 27, "rejected": 7, "refused": 1, "first_seen_s": 1.4, "mean_nis": 3.249}
    goal = {**watched_figures["goal"], **changes, "estimate_error": error, "final_status": "lost"}
    rows = told({**watched_figures, "goal": goal})
    assert rows["goal source"] == ("detected", "")
    assert rows["goal first seen"] == ("1.40", "s")
    assert rows["detections accepted / rejected / refused"] == ("27 / 7 / 1", "")
    assert rows["goal estimate, longitudinal"] == ("-12.3", "mm")
    assert rows["goal estimate, lateral"] == ("4.5", "mm")
    assert rows["goal estimate, heading"] == ("0.57", "deg")
    assert rows["mean NIS of accepted detections"] == ("3.25", "")
    assert rows["goal status at the end"] == ("lost", "")


def test_table_of_a_goal_that_was_never_seen(watched_figures: dict[str, Any]) -> None:
    nothing = dict.fromkeys(("longitudinal_m", "lateral_m", "heading_rad"))
    goal = {**watched_figures["goal"], "first_seen_s": None, "estimate_error": nothing, "mean_nis": None}
    rows = told({**watched_figures, "goal": goal})
    assert rows["goal first seen"] == rows["goal estimate, lateral"] == ("never", "")


def test_table_without_a_filter_names_the_source_only(watched_figures: dict[str, Any]) -> None:
    rows = told({**watched_figures, "goal": {**watched_figures["goal"], "source": "raw"}})
    assert {name: value for name, value in rows.items() if "goal" in name or "detections" in name} == {
        "goal source": ("raw", "")
    }
