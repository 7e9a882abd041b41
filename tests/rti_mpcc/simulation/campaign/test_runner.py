"""Campaigns on an engine of this process: each case once, whatever goes wrong."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from rti_mpcc.errors import CampaignError, InputError
from rti_mpcc.simulation.campaign import (
    CampaignCase,
    CampaignSettings,
    CaseOutcome,
    Level,
    read_rows,
    run_campaign,
)
from rti_mpcc.simulation.campaign.lock import locked
from rti_mpcc.simulation.campaign.runner import kept
from tests.rti_mpcc.simulation.campaign import drives
from tests.rti_mpcc.simulation.campaign.engines import Puppet

SETTINGS = CampaignSettings(count=8, level=Level.NOMINAL, seed=1)


def indices(folder: Path) -> list[int]:
    return [row["index"] for row in read_rows(folder)]


def outcomes(folder: Path) -> dict[int, str]:
    return {row["index"]: row["outcome"] for row in read_rows(folder)}


def whole(folder: Path) -> list[str]:
    """Sorted lines."""
    return sorted((folder / "rows.jsonl").read_text().splitlines(keepends=True))


@pytest.fixture
def expected(tmp_path: Path) -> list[str]:
    """What a campaign without any trouble keeps."""
    run_campaign(SETTINGS, tmp_path / "expected", engine=Puppet(1), drive=drives.made_up)
    return whole(tmp_path / "expected")


def test_every_case_is_driven_once_in_whatever_order(tmp_path: Path, expected: list[str]) -> None:
    engine, told = Puppet(3), []
    tally = run_campaign(
        SETTINGS,
        tmp_path / "new" / "folder",
        engine=engine,
        drive=drives.made_up,
        progress=lambda *counts: told.append(counts),
    )
    folder = tmp_path / "new" / "folder"
    assert sorted(engine.begun) == list(range(8))
    assert indices(folder) != list(range(8))
    assert whole(folder) == expected
    assert engine.together <= 3
    assert (tally.outcomes, tally.collisions) == ({CaseOutcome.DOCKED: 8}, 1)
    assert told == [(done, 8) for done in range(1, 9)]
    assert engine.left_by == [None]


def test_cases_are_made_as_they_are_begun() -> None:
    made: list[int] = []

    def cases() -> Iterator[CampaignCase]:
        for index in range(50):
            made.append(index)
            yield SETTINGS.case(index)

    for done, _ in enumerate(kept(cases(), drives.made_up, Puppet(4)), start=1):
        assert len(made) <= done + 4
    assert len(made) == 50


def test_a_campaign_that_ended_is_gone_on_with(tmp_path: Path, expected: list[str]) -> None:
    def enough(done: int, total: int) -> None:
        if done == 3:
            raise KeyboardInterrupt

    first, second, third = Puppet(), Puppet(), Puppet()
    with pytest.raises(KeyboardInterrupt):
        run_campaign(SETTINGS, tmp_path, engine=first, drive=drives.made_up, progress=enough)
    assert first.left_by == [KeyboardInterrupt]
    kept = indices(tmp_path)
    assert len(kept) == 3
    with (tmp_path / "rows.jsonl").open("a") as stream:
        stream.write('{"index":7,"torn')
    told: list[tuple[int, int]] = []
    run_campaign(
        SETTINGS,
        tmp_path,
        engine=second,
        drive=drives.made_up,
        progress=lambda *counts: told.append(counts),
    )
    assert sorted([*kept, *second.begun]) == list(range(8))
    assert told[-1] == (5, 5)
    assert whole(tmp_path) == expected
    tally = run_campaign(SETTINGS, tmp_path, engine=third, drive=drives.made_up)
    assert tally.cases == 8
    assert (third.begun, third.left_by) == ([], [])


def test_more_cases_are_driven_besides(tmp_path: Path, expected: list[str]) -> None:
    run_campaign(replace(SETTINGS, count=3), tmp_path, engine=Puppet(), drive=drives.made_up)
    engine = Puppet()
    run_campaign(SETTINGS, tmp_path, engine=engine, drive=drives.made_up)
    assert sorted(engine.begun) == [3, 4, 5, 6, 7]
    assert whole(tmp_path) == expected


def test_other_settings_and_other_processes_are_refused(tmp_path: Path) -> None:
    run_campaign(SETTINGS, tmp_path, engine=Puppet(), drive=drives.made_up)
    engine = Puppet()
    with pytest.raises(InputError, match="holds another campaign: seed was 1, not 2"):
        run_campaign(replace(SETTINGS, seed=2), tmp_path, engine=engine, drive=drives.made_up)
    with locked(tmp_path), pytest.raises(InputError, match="another process"):
        run_campaign(SETTINGS, tmp_path, engine=engine, drive=drives.made_up)
    assert engine.begun == []


def test_what_raises_is_a_row(tmp_path: Path) -> None:
    settings = replace(SETTINGS, count=2)
    tally = run_campaign(settings, tmp_path, engine=Puppet(), drive=drives.troubled)
    assert outcomes(tmp_path) == {0: "docked", 1: "raised"}
    assert tally.outcomes == {CaseOutcome.DOCKED: 1, CaseOutcome.RAISED: 1}


@pytest.mark.parametrize(
    "window",
    [pytest.param(1, marks=pytest.mark.acceptance), 3, pytest.param(20, marks=pytest.mark.acceptance)],
)
@pytest.mark.parametrize("undrawable", [False, True])
def test_a_case_that_ends_its_worker_is_a_row_and_the_others_are_driven(
    tmp_path: Path, window: int, undrawable: bool
) -> None:
    engine = Puppet(window)
    engine.deadly, engine.undrawable = {2, 5}, undrawable
    run_campaign(SETTINGS, tmp_path, engine=engine, drive=drives.made_up)
    found = outcomes(tmp_path)
    assert {index for index, outcome in found.items() if outcome == "worker_died"} == {2, 5}
    assert sorted(found) == list(range(8))
    assert all(engine.begun.count(index) == 1 for index in range(8) if index not in (2, 5))
    assert all(engine.begun.count(index) <= 2 for index in (2, 5))
    courses = {row["index"]: row["course"] for row in read_rows(tmp_path)}
    assert all((courses[index] is None) == undrawable for index in (2, 5))


def test_what_the_engine_drops_is_driven_again(tmp_path: Path, expected: list[str]) -> None:
    engine = Puppet()
    engine.dropped = {1, 6}
    run_campaign(SETTINGS, tmp_path, engine=engine, drive=drives.made_up)
    assert whole(tmp_path) == expected


def test_a_lost_engine_ends_it_and_keeps_what_is_done(tmp_path: Path) -> None:
    engine = Puppet()
    engine.lost_after = 2
    with pytest.raises(CampaignError, match="the engine is lost"):
        run_campaign(SETTINGS, tmp_path, engine=engine, drive=drives.made_up)
    assert len(indices(tmp_path)) == 2
    assert engine.left_by == [CampaignError]
