"""Rows become a table: order, missing figures, torn and repeated lines, and what is refused."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rti_mpcc.errors import InputError
from rti_mpcc.report.campaign.rows import read_campaign
from rti_mpcc.simulation.campaign import CaseOutcome
from tests.rti_mpcc.report.campaign.made_up import (
    CALM,
    SCENES,
    campaign,
    docked,
    figures,
    raised,
    scene,
    stalled,
    write,
)


def test_columns_are_in_the_order_of_the_cases(tmp_path: Path) -> None:
    read = campaign(tmp_path / "one", docked(3, 25.0), stalled(0, 0.3), docked(1, 21.0, 0.1))
    assert read.name == "one"
    rows = read.rows
    assert rows.index.tolist() == [0, 1, 3]
    assert rows["docked"].tolist() == [False, True, True]
    assert rows["outcome"].tolist() == ["stalled", "docked", "docked"]
    assert rows["outcome"].min() == "stalled"
    assert rows["time_to_dock_s"].tolist()[1:] == [21.0, 25.0]
    assert np.isnan(rows["time_to_dock_s"][0])
    assert rows["min_clearance_m"].tolist() == [0.3, 0.1, 0.2]
    assert rows["goal_beside_m"].tolist() == pytest.approx([-1.0, -1.01, -1.03])
    assert rows["final_error.lateral_m"].tolist() == [-0.002] * 3
    assert rows["scenario"][0] == "campaign_1_00_nominal"
    assert rows["detail"].tolist() == ["no plan", "", ""]
    assert read.statuses == {"arriving": 30, "docked": 6}


def test_what_is_null_is_not_a_number(tmp_path: Path) -> None:
    """Neither the figures of what raised, nor the course of what could not be drawn."""
    undrawn = replace(raised(1), course=None, disturbances=None)
    read = campaign(tmp_path, raised(0), undrawn, docked(2, clearance=None))
    for name, unknown in (
        ("time_to_dock_s", [True, True, False]),
        ("length_m", [False, True, False]),
        ("dead_time_s", [False, True, False]),
    ):
        assert read.rows[name].isna().tolist() == unknown
    assert not read.rows["crossed"].any()
    assert read.rows["detail"][0] == "ValueError: <odd> 'x'"


def test_lists_of_disturbances_are_columns_of_their_own(tmp_path: Path) -> None:
    noisy = replace(CALM, initial_offset=(0.3, -0.4, -0.1), state_noise=(0.01, 0.01, 0.002, 0.03, 0.004))
    read = campaign(tmp_path, docked(0, disturbances=noisy))
    assert read.rows["initial_offset_m"][0] == pytest.approx(0.5)
    assert read.rows["initial_turned_rad"][0] == pytest.approx(0.1)
    assert read.rows["noise_v_m_s"][0] == 0.03
    assert read.rows["noise_delta_rad"][0] == 0.004


def test_texts_tell_courses_and_disturbances_apart(tmp_path: Path) -> None:
    noisy = replace(CALM, dropout=0.1)
    read = campaign(tmp_path, docked(0), docked(1), docked(2, course={"goal_beside_m": -1.0}))
    other = campaign(tmp_path, docked(0, disturbances=noisy))
    course, disturbances = read.rows["course"], read.rows["disturbances"]
    assert course[0] == other.rows["course"][0] == course[2] != course[1]
    assert disturbances[0] == disturbances[1] != other.rows["disturbances"][0]


def test_a_torn_last_line_is_left_out(tmp_path: Path) -> None:
    read = campaign(tmp_path, docked(0), docked(1), tail=docked(2).line()[:50])
    assert read.torn
    assert read.rows.index.tolist() == [0, 1]
    assert not campaign(tmp_path, docked(0)).torn


def test_a_case_counts_once(tmp_path: Path) -> None:
    read = campaign(tmp_path, docked(0, 20.0), docked(1), docked(0, 30.0))
    assert read.repeated == 1
    assert read.rows["time_to_dock_s"].tolist() == [20.0, 20.0]
    assert read.statuses == {"arriving": 20, "docked": 4}


def test_the_yardstick_time_is_that_of_the_way(tmp_path: Path) -> None:
    """2 sqrt((c + 1) D / a): 22.5 m at 0.4 m/s² take 15 s, 40 m in two parts 28.28 s, 10 m less 11.18 s."""
    two = {"cusps": 1, "length_m": 37.0, "goal_behind_m": 3.0}
    read = campaign(
        tmp_path,
        docked(0, 30.0),
        docked(1, 800.0**0.5, course=two),
        docked(2, 125.0**0.5, course={"goal_behind_m": -10.0}),
        stalled(3),
    )
    over = read.rows["over_yardstick"].tolist()
    assert over[:3] == pytest.approx([2.0, 1.0, 1.0])
    assert np.isnan(over[3])


def test_no_way_has_no_yardstick(tmp_path: Path) -> None:
    read = campaign(tmp_path, docked(0, course={"goal_behind_m": -30.0}), docked(1))
    assert read.rows["over_yardstick"].isna().tolist() == [True, False]


def test_scenes_have_the_way_that_was_planned_first(tmp_path: Path) -> None:
    stuck = figures(None) | {"direction_changes": 4}
    lost = scene(1, stuck, kind="slot", outcome=CaseOutcome.UNFINISHED)
    read = campaign(tmp_path, scene(0, figures(200.0**0.5)), lost, settings=SCENES)
    rows = read.rows
    assert read.of_scenes
    assert rows["kind"].tolist() == ["bay", "slot"]
    assert rows["apart_m"].tolist() == [12.0, 13.0]
    assert rows["curvature"].isna().all()
    assert rows["length_m"].tolist() == [10.0, 10.0]
    assert rows["over_yardstick"][0] == pytest.approx(1.0)
    assert rows["turns_beyond"].tolist() == [0.0, 3.0]
    assert rows["timed.planning_s"].tolist() == pytest.approx([0.1, 0.2])
    assert rows["timed.cycle_ms.max"].tolist() == [40.0, 41.0]


def test_courses_have_no_times(tmp_path: Path) -> None:
    read = campaign(tmp_path, docked(0))
    assert not read.of_scenes
    assert read.rows["kind"].tolist() == [""]
    for name in ("apart_m", "planning.length_m", "timed.cycle_ms.p50"):
        assert read.rows[name].isna().all()


def test_fewer_turns_than_cusps_are_none_beyond(tmp_path: Path) -> None:
    read = campaign(tmp_path, docked(0, course={"cusps": 1}), raised(1))
    assert read.rows["turns_beyond"][0] == 0.0
    assert np.isnan(read.rows["turns_beyond"][1])


@pytest.mark.parametrize(
    ("tail", "message"),
    [
        ("torn {\n", "line 2"),
        ('{"index": 1}\n', r"line 2: is not the row of a case \(KeyError: 'outcome'\)"),
        ("[1]\n", "line 2: is not the row of a case"),
        (docked(1).line().replace("22.5", '"far"'), "line 2: is not the row of a case"),
        (docked(1).line().replace("docked", "lost"), "line 2: is not the row of a case"),
    ],
)
def test_what_is_no_row_is_refused(tmp_path: Path, tail: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        campaign(tmp_path, docked(0), tail=tail)


def test_what_is_no_campaign_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="is no campaign"):
        read_campaign(tmp_path / "missing")
    folder = write(tmp_path / "one", [])
    with pytest.raises(InputError, match="has no whole row"):
        read_campaign(folder)
    (folder / "rows.jsonl").unlink()
    with pytest.raises(InputError, match="has no whole row"):
        read_campaign(folder)
    for changes, message in (({"level": "easy"}, "'easy' is not a valid Level"), ({"preset": "x"}, "preset")):
        settings = json.loads((folder / "campaign.json").read_text())
        (tmp_path / "campaign.json").write_text(json.dumps({**settings, **changes}))
        with pytest.raises(InputError, match=message):
            read_campaign(tmp_path)
    (tmp_path / "campaign.json").write_text('{"count": 3, "level": "hard"}')
    with pytest.raises(InputError, match="does not tell 'seed'"):
        read_campaign(tmp_path)
