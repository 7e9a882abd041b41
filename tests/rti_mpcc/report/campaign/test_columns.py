"""Rows become columns: order, missing figures, torn and repeated lines, and what is refused."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rti_mpcc.errors import InputError
from rti_mpcc.report.campaign.columns import read_campaign
from rti_mpcc.simulation.campaign import CaseOutcome
from tests.rti_mpcc.report.campaign.made_up import CALM, campaign, docked, raised, stalled, write


def test_columns_are_in_the_order_of_the_cases(tmp_path: Path) -> None:
    read = campaign(tmp_path / "one", docked(3, 25.0), stalled(0, 0.3), docked(1, 21.0, 0.1))
    assert read.name == "one"
    assert read.index.tolist() == [0, 1, 3]
    assert read.docked.tolist() == [False, True, True]
    assert [read.outcome_of(place) for place in range(2)] == [CaseOutcome.STALLED, CaseOutcome.DOCKED]
    assert read["time_to_dock_s"][1:].tolist() == [21.0, 25.0]
    assert np.isnan(read["time_to_dock_s"][0])
    assert read["min_clearance_m"].tolist() == [0.3, 0.1, 0.2]
    assert read["goal_beside_m"] == pytest.approx([-1.0, -1.01, -1.03])
    assert read["final_error.lateral_m"].tolist() == [-0.002] * 3
    assert read.scenarios[0] == "campaign_1_00_nominal"
    assert read.details == {0: "no plan"}
    assert read.statuses == {"arriving": 30, "docked": 6}
    assert not read["length_m"].flags.writeable


def test_what_is_null_is_not_a_number(tmp_path: Path) -> None:
    """Neither the figures of what raised, nor the course of what could not be drawn."""
    undrawn = replace(raised(1), course=None, disturbances=None)
    read = campaign(tmp_path, raised(0), undrawn, docked(2, clearance=None))
    assert np.isnan(read["time_to_dock_s"]).tolist() == [True, True, False]
    assert np.isnan(read["length_m"]).tolist() == [False, True, False]
    assert np.isnan(read["dead_time_s"]).tolist() == [False, True, False]
    assert not read.crossed.any()
    assert read.details[0] == "ValueError: <odd> 'x'"


def test_lists_of_disturbances_are_columns_of_their_own(tmp_path: Path) -> None:
    noisy = replace(CALM, initial_offset=(0.3, -0.4, -0.1), state_noise=(0.01, 0.01, 0.002, 0.03, 0.004))
    read = campaign(tmp_path, docked(0, disturbances=noisy))
    assert read["initial_offset_m"][0] == pytest.approx(0.5)
    assert read["initial_turned_rad"][0] == pytest.approx(0.1)
    assert read["noise_v_m_s"][0] == 0.03
    assert read["noise_delta_rad"][0] == 0.004


def test_keys_tell_courses_and_disturbances_apart(tmp_path: Path) -> None:
    noisy = replace(CALM, dropout=0.1)
    read = campaign(tmp_path, docked(0), docked(1), docked(2, course={"goal_beside_m": -1.0}))
    other = campaign(tmp_path, docked(0, disturbances=noisy))
    assert read.course[0] == other.course[0] == read.course[2] != read.course[1]
    assert read.disturbed[0] == read.disturbed[1] != other.disturbed[0]


def test_a_torn_last_line_is_left_out(tmp_path: Path) -> None:
    read = campaign(tmp_path, docked(0), docked(1), tail=docked(2).line()[:50])
    assert read.torn
    assert read.index.tolist() == [0, 1]
    assert not campaign(tmp_path, docked(0)).torn


def test_a_case_counts_once(tmp_path: Path) -> None:
    read = campaign(tmp_path, docked(0, 20.0), docked(1), docked(0, 30.0))
    assert read.repeated == 1
    assert read["time_to_dock_s"].tolist() == [20.0, 20.0]


@pytest.mark.parametrize(
    ("tail", "message"),
    [
        ("torn {\n", "line 2"),
        ('{"index": 1}\n', r"line 2: is not the row of a case \(KeyError: 'outcome'\)"),
        ("[1]\n", "line 2: is not the row of a case"),
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
