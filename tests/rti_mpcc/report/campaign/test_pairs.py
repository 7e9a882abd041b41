"""Two campaigns case by case, against values reckoned by hand."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rti_mpcc.errors import InputError
from rti_mpcc.report.campaign.pairs import Pairs, compared, differences, paired, sentences
from rti_mpcc.report.campaign.pictures import pairs_figure
from rti_mpcc.report.campaign.report import write_report
from rti_mpcc.report.campaign.rows import Campaign
from tests.rti_mpcc.report.campaign.made_up import CALM, SETTINGS, campaign, docked, raised, stalled
from tests.rti_mpcc.report.pages import parsed

PAPER = replace(SETTINGS, preset="paper", count=9)


@pytest.fixture
def first(tmp_path: Path) -> Campaign:
    return campaign(
        tmp_path / "a",
        docked(0, 20.0, 0.2),
        docked(1, 30.0, 0.1),
        docked(2, 40.0, 0.3),
        stalled(3, 0.5),
        docked(4, 25.0),
        raised(5),
        docked(6),
    )


@pytest.fixture
def pairs(tmp_path: Path, first: Campaign) -> Pairs:
    second = campaign(
        tmp_path / "b",
        docked(7),
        docked(4, 50.0, course={"length_m": 30.0}),
        stalled(5),
        docked(3, 25.0, -0.1),
        docked(2, 50.0, 0.5),
        docked(1, 30.0, 0.5, disturbances=replace(CALM, dropout=0.2)),
        docked(0, 40.0, 0.5),
        stalled(6),
        settings=PAPER,
    )
    return paired(first, second)


def test_cases_are_paired_by_index_and_course(pairs: Pairs) -> None:
    """Case 4 is on another course there, 7 is not here."""
    told = compared(pairs)
    assert pairs.first.index.tolist() == pairs.second.index.tolist() == [0, 1, 2, 3, 5, 6]
    assert (told["common"], told["only_in_first"], told["only_in_second"]) == (6, 1, 2)
    assert told["disturbed_differently"] == 1


def test_figures_are_those_of_the_pairs(pairs: Pairs) -> None:
    told = compared(pairs)
    assert told["docked"] == [4, 4]
    counts = [told[f"docked_{who}"] for who in ("both", "first_only", "second_only", "none")]
    assert counts == [3, 1, 1, 1]
    assert (told["lost_by_first"], told["lost_by_second"], told["lost_by_both"]) == ([3], [6], [5])
    assert told["collisions"] == [0, 1]
    assert told["min_clearance_m"] == [0.1, -0.1]
    # 20/40, 30/30, 40/50
    assert told["ratios"]["time_to_dock_s"] == pytest.approx({"p25": 0.65, "p50": 0.8, "p75": 0.9})
    assert told["ratios"]["energy_to_dock.acceleration"]["p50"] == 1.0
    assert told["clearance_difference_m"] == pytest.approx({"p25": -0.35, "p50": -0.3, "p75": -0.25})
    assert told["first_faster"] == 2
    json.dumps(told, allow_nan=False)


def test_the_comparison_is_told(pairs: Pairs, first: Campaign, tmp_path: Path) -> None:
    assert pairs.names == ("default", "paper")
    told = sentences(pairs, compared(pairs))
    assert told[0] == (
        "6 cases in common: 3 dock in both, 1 in `default` only, 1 in `paper` only, 1 in neither."
    )
    assert "takes 0.800 times the time to dock of `paper` (median; quartiles 0.650 and 0.900)" in told[1]
    assert told[-1] == "Settings that differ: count (4 and 9), preset (default and paper)."
    page = parsed(write_report(first, tmp_path, pairs=pairs, worst=0).files[0].read_text(encoding="utf-8"))
    assert page.rows_below("Cases that one docks")[1:] == [
        ["3", "stalled", "docked", "no plan"],
        ["6", "docked", "stalled", "no plan"],
    ]
    assert page.rows_below("Settings that differ.")[1:] == [
        ["count", "4", "9"],
        ["preset", "default", "paper"],
    ]
    assert page.rows_below("Both campaigns on their 6 common cases.")[1:] == [
        ["default", "4", "1", "0", "0.100"],
        ["paper", "4", "1", "1", "−0.100"],
    ]


def test_the_picture_has_every_pair(pairs: Pairs) -> None:
    times, clearances = pairs_figure(pairs).axes
    points = [np.asarray(collection.get_offsets()) for collection in times.collections]
    assert sum(len(one) for one in points) == 5  # of case 5 neither has a time
    assert points[0].tolist() == [[40.0, 20.0], [30.0, 30.0], [50.0, 40.0]]
    edge = times.get_ylim()[1]
    assert points[2].tolist() == [[25.0, edge]]
    assert times.get_aspect() == clearances.get_aspect() == 1.0
    assert times.get_xlim() == times.get_ylim()


def test_settings_differ_by_their_paths() -> None:
    one = {"count": 3, "versions": {"numpy": "2.0", "osqp": "1.1"}}
    other = {"count": 3, "versions": {"numpy": "2.1", "osqp": "1.1"}, "preset": "paper"}
    assert differences(one, other) == {"versions.numpy": ("2.0", "2.1"), "preset": (None, "paper")}


def test_campaigns_of_the_same_settings_are_named_by_their_folders(tmp_path: Path) -> None:
    one, other = campaign(tmp_path / "before", docked(0)), campaign(tmp_path / "after", docked(0))
    assert paired(one, other).names == ("before", "after")
    assert paired(one, one).names == ("before, the first", "before, the second")


def test_nothing_docked_by_both(tmp_path: Path) -> None:
    pairs = paired(campaign(tmp_path / "a", stalled(0)), campaign(tmp_path / "b", raised(0)))
    told = compared(pairs)
    assert told["ratios"]["time_to_dock_s"] == {"p25": None, "p50": None, "p75": None}
    assert sentences(pairs, told)[0].endswith("1 in neither.")
    pairs_figure(pairs).draw_without_rendering()


def test_campaigns_without_a_common_case_are_refused(tmp_path: Path) -> None:
    one = campaign(tmp_path / "a", docked(0))
    with pytest.raises(InputError, match="seed = 1 and 2"):
        paired(one, campaign(tmp_path / "b", docked(0), settings=replace(SETTINGS, seed=2)))
    with pytest.raises(InputError, match="none of one is in the other"):
        paired(one, campaign(tmp_path / "b", docked(1)))
    with pytest.raises(InputError, match="none of the same index is on the same course"):
        paired(one, campaign(tmp_path / "b", docked(0, course={"length_m": 40.0})))
