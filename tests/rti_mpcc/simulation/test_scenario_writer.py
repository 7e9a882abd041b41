"""Scenarios written to a file and read back."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from benchmarks.problems.courses import CAMPAIGN, drawn_course
from rti_mpcc.simulation import (
    Scenario,
    builtin_names,
    changed,
    load_scenario,
    save_scenario,
    scenario_from_dict,
    scenario_text,
)

TRICKY = 'a "quoted" \\ text,\nsecond line\ttab, \x7f and \x01, δ̇ ≤ 0.6, 🚚'


def back(scenario: Scenario, folder: Path) -> Scenario:
    return load_scenario(save_scenario(scenario, folder))


@pytest.mark.parametrize("name", builtin_names())
def test_built_in_scenarios_come_back(name: str, tmp_path: Path) -> None:
    scenario = load_scenario(name)
    assert back(scenario, tmp_path / "new" / "folder") == scenario
    assert (tmp_path / "new" / "folder" / f"{name}.toml").is_file()


@pytest.mark.parametrize("index", [0, *(pytest.param(k, marks=pytest.mark.acceptance) for k in (1, 2, 3))])
def test_courses_come_back(index: int, tmp_path: Path) -> None:
    course = drawn_course(5, index, CAMPAIGN)
    assert back(course, tmp_path) == course


def test_everything_a_file_may_have_comes_back(tables: dict[str, Any], tmp_path: Path) -> None:
    scenario = scenario_from_dict(
        {
            **tables,
            "description": TRICKY,
            "corridor": {
                "polygon": [[-2, -3], [16, -3], [16, 3], [-2, 3]],
                "obstacles": [[[6, 2.5], [7, 2.5], [7, 2.75]], [[6, -2.5], [7, -2.5], [7, -2.75]]],
            },
            "goal": {
                "pose": [9.5, 0.1, 1e-7],
                "measurement": {"visible_after_cusp": True, "rate": 5},
                "shifts": [{"at_distance": 3.0, "offset": [0.1, 1 / 3, 0.0]}],
            },
            "controller": {"deadline": 0.02},
            "simulation": {"state_noise": [0.1, 0.1, 0.01, 0.0, 0.0]},
            "faults": [
                {"kind": "nan_state", "from": 1.0, "to": 2.0},
                {"kind": "blocked", "from": 1, "to": 2, "size": 3},
            ],
        }
    )
    assert back(scenario, tmp_path) == scenario


def test_what_was_not_set_is_not_written(straight: Scenario) -> None:
    text = scenario_text(changed(straight, {"corridor.narrowings": []}))
    assert "[vehicle]" not in text
    assert "dead_time" not in text
    assert "None" not in scenario_text(straight)


def test_a_path_file_is_found_from_elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rows = ["x,y,heading,direction", *(f"{x},0.0,0.0,1" for x in range(0, 11, 2))]
    (tmp_path / "way.csv").write_text("\n".join(rows))
    file = tmp_path / "mine.toml"
    file.write_text('name = "mine"\n[path]\nfile = "way.csv"\n[corridor]\nleft = 3\nright = -3\n')
    monkeypatch.chdir(tmp_path)
    scenario = load_scenario("mine.toml")
    assert scenario.path.file == "way.csv"
    assert back(scenario, tmp_path / "elsewhere").build_path().length == pytest.approx(10.0)
