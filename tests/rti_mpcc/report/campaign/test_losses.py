"""Cases that were lost, grouped by what was told of them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from rti_mpcc.report.campaign.losses import losses
from rti_mpcc.report.campaign.report import write_report
from rti_mpcc.simulation.campaign import CampaignRow, CaseOutcome
from tests.rti_mpcc.report.campaign.made_up import campaign, docked, figures, raised, row
from tests.rti_mpcc.report.pages import parsed


def off(index: int, x: float, y: float, phi: float, detail: str) -> CampaignRow:
    error = {"longitudinal_m": x, "lateral_m": y, "heading_rad": phi}
    return row(index, figures(None, final_error=error), outcome=CaseOutcome.STALLED, detail=detail)


def test_cases_that_ended_alike_are_a_group(tmp_path: Path) -> None:
    read = campaign(
        tmp_path,
        raised(0),
        off(2, 0.3, 0.4, -0.2, "contact in 1.25 s"),
        off(1, 0.0, -0.1, 0.1, "contact in 3 s"),
        off(4, 1.0, 0.0, 0.0, "no plan"),
        docked(3, clearance=-0.2),
        docked(5),
    )
    found = losses(read)
    assert [(group["outcome"], group["told"], group["index"]) for group in found] == [
        ("stalled", "contact in # s", [1, 2]),
        ("raised", "ValueError: <odd> 'x'", [0]),
        ("stalled", "no plan", [4]),
        ("collision", "", [3]),
    ]
    assert found[0]["off_m"] == pytest.approx({"p50": 0.3, "max": 0.5})
    assert found[0]["off_rad"] == pytest.approx({"p50": 0.15, "max": 0.2})
    assert found[1]["off_m"] == {"p50": None, "max": None}
    json.dumps(found, allow_nan=False)


def test_many_cases_are_not_all_named(tmp_path: Path) -> None:
    """In the page, that is."""
    rows = [off(20, 0.3, 0.4, -0.2, "contact in 1.25 s"), off(21, 0.0, -0.1, 0.1, "contact in 3 s")]
    read = campaign(tmp_path, *(raised(index) for index in range(15)), *rows)
    assert losses(read)[0]["cases"] == 15
    page = write_report(read, tmp_path, worst=0).files[0].read_text(encoding="utf-8")
    lost = parsed(page).rows_below("Cases that did not dock")
    assert lost[1][2:4] == ["15", "– / –"]
    assert lost[1][5].endswith("10, 11 and 3 more")
    assert lost[2] == ["stalled", "contact in # s", "2", "0.30 / 0.50", "8.59 / 11.46", "20, 21"]


def test_nothing_is_lost(tmp_path: Path) -> None:
    assert losses(campaign(tmp_path, docked(0))) == []
