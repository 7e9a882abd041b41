"""The order of the worst cases, and what is told of one that was driven again."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from rti_mpcc.report.campaign.rows import Campaign
from rti_mpcc.report.campaign.worst import (
    BY_FIGURE,
    CLOSE,
    CROSSED,
    Again,
    command_of,
    drive_again,
    shown,
    told,
    worst_cases,
)
from rti_mpcc.simulation.campaign import CampaignCase, CaseOutcome, Level
from tests.rti_mpcc.report.campaign.made_up import (
    SETTINGS,
    campaign,
    docked,
    figures,
    peak,
    raised,
    row,
    stalled,
)


def order(read: Campaign, count: int = 20) -> list[tuple[int, str]]:
    return list(worst_cases(read.rows, count).items())


def test_failures_come_first_then_the_worst_by_each_figure_in_turn(tmp_path: Path) -> None:
    read = campaign(
        tmp_path,
        row(0, figures(20.0, 0.5, energy_ratio=3.0)),
        row(1, figures(24.0, 0.4, peak=peak(steering_rate=0.9))),
        docked(2, 19.0, 0.11),
        row(3, figures(18.0, 0.12, expected_time_s=10.0)),
        row(4, figures(30.0, None, peak=peak(acceleration=0.9, lateral_acceleration=1.1))),
        docked(5, 20.0, -0.1),
        row(6, figures(None, -0.3), outcome=CaseOutcome.UNFINISHED),
        row(7, figures(None, 0.3), outcome=CaseOutcome.UNFINISHED),
        stalled(8, 0.3),
        stalled(9, 0.2),
        row(10, figures(None, 0.2), outcome=CaseOutcome.FAILED),
        raised(11),
        raised(12, CaseOutcome.WORKER_DIED),
    )
    expected = [
        (6, CROSSED),
        (5, CROSSED),
        (12, "worker died"),
        (11, "raised"),
        (10, "failed"),
        (9, "stalled"),
        (8, "stalled"),
        (7, "unfinished"),
        (2, CLOSE),
        (4, BY_FIGURE["over_yardstick"]),
        (1, BY_FIGURE["over_comfort.steering_rate"]),
        (0, BY_FIGURE["energy_ratio"]),
        (3, BY_FIGURE["over_expected"]),
    ]
    assert order(read) == expected
    assert order(read, 3) == expected[:3]
    assert order(read, 0) == []


def test_of_equal_cases_the_first_is_the_worse(tmp_path: Path) -> None:
    read = campaign(tmp_path, *(docked(index) for index in (3, 1, 2)))
    assert [index for index, _ in order(read)] == [1, 2, 3]


def test_the_command_names_all_that_makes_a_case() -> None:
    case = CampaignCase(seed=3, level=Level.HARD, index=17, method="separated", preset="paper")
    assert command_of(case) == (
        "rti-mpcc campaign-case --level hard --seed 3 --index 17 --method separated --preset paper"
    )


def test_what_raises_is_told_and_drawn_as_far_as_it_can_be(monkeypatch: pytest.MonkeyPatch) -> None:
    case = SETTINGS.case(0)

    def fails(*arguments: Any) -> None:
        raise ZeroDivisionError("odd")

    monkeypatch.setattr("rti_mpcc.report.campaign.worst.drive", fails)
    again = drive_again(case)
    assert again.scenario is not None
    assert (again.outcome, again.raised) == (None, "ZeroDivisionError: odd")
    assert drive_again(case, drives=False) == Again(scenario=again.scenario, outcome=None)
    monkeypatch.setattr(CampaignCase, "scenario", fails)
    assert drive_again(case) == Again(scenario=None, outcome=None, raised="ZeroDivisionError: odd")


def test_a_case_that_ended_its_worker_is_not_driven_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    driven: list[tuple[int, bool]] = []

    def driven_again(case: CampaignCase, *, drives: bool) -> Again:
        driven.append((case.index, drives))
        return Again(scenario=None, outcome=None, raised="ValueError: no course")

    monkeypatch.setattr("rti_mpcc.report.campaign.worst.drive_again", driven_again)
    read = campaign(tmp_path, raised(0), raised(1, CaseOutcome.WORKER_DIED), docked(2), docked(3))
    progress: list[tuple[int, int]] = []
    cases = told(read, worst_cases(read.rows, 3))
    found = list(shown(read, cases, lambda done, total: progress.append((done, total))))
    assert driven == [(1, False), (0, True), (2, True)]
    assert progress == [(1, 3), (2, 3), (3, 3)]
    assert [one["command"] for one in found] == [one["command"] for one in cases]
    assert len({one["command"] for one in found}) == 3
    assert all("It cannot be drawn: ValueError: no course." in one["sentence"] for one in found)
    assert all(one["figure"] is None for one in found)
    assert cases[0]["time_to_dock_s"] is None
    assert cases[2]["time_over_yardstick"] == pytest.approx(20.0 / 15.0)
