"""Rows of different campaigns are not mixed."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import geometry
from rti_mpcc.errors import InputError
from rti_mpcc.simulation.campaign import CampaignCase, CampaignSettings, Level, Problems, read_settings
from rti_mpcc.simulation.campaign.settings import keep_settings, source_digest, versions

SETTINGS = CampaignSettings(count=5, level=Level.NOISY, seed=3)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """With a row, and so something to mix up."""
    keep_settings(SETTINGS, tmp_path)
    (tmp_path / "rows.jsonl").write_text("{}\n")
    return tmp_path


def test_a_case_has_the_settings_of_its_campaign() -> None:
    settings = replace(SETTINGS, method="switched", preset="paper")
    expected = CampaignCase(seed=3, level=Level.NOISY, index=4, method="switched", preset="paper")
    assert settings.case(4) == expected
    scenes = replace(SETTINGS, problems=Problems.SCENES, deadline=0.02)
    assert scenes.case(4) == replace(SETTINGS.case(4), problems=Problems.SCENES, deadline=0.02)


def test_the_file_tells_what_was_asked_for_and_what_it_depends_on(folder: Path) -> None:
    table = read_settings(folder)
    assert table == SETTINGS.table()
    assert (table["count"], table["level"], table["seed"]) == (5, "noisy", 3)
    assert (table["method"], table["preset"]) == ("dynamic", "default")
    assert {"python", "numpy", "osqp", "rti-mpcc", "source"} <= set(table["versions"])
    assert all(table["versions"].values())


def test_the_same_or_more_is_gone_on_with(folder: Path) -> None:
    keep_settings(SETTINGS, folder)
    keep_settings(replace(SETTINGS, count=50), folder)
    assert read_settings(folder)["count"] == 50
    assert [file.name for file in folder.iterdir() if file.suffix == ".new"] == []


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"count": 4}, "count was 5 and must not be less, 4"),
        ({"seed": 4}, "seed was 3, not 4"),
        ({"level": Level.HARD}, "level was noisy, not hard"),
        ({"method": "switched"}, "method was dynamic, not switched"),
        ({"problems": Problems.SCENES}, "problems was courses, not scenes"),
        ({"deadline": 0.02}, "deadline was None, not 0.02"),
        ({"preset": "paper", "seed": 1}, "seed was 3, not 1; preset was default, not paper"),
    ],
)
def test_another_campaign_is_refused_in_one_sentence(
    folder: Path, change: dict[str, Any], message: str
) -> None:
    before = (folder / "campaign.json").read_text()
    with pytest.raises(InputError) as error:
        keep_settings(replace(SETTINGS, **change), folder)
    assert str(error.value) == f"{folder} holds another campaign: {message}. Choose another folder"
    assert (folder / "campaign.json").read_text() == before


@pytest.mark.parametrize(
    ("name", "message"),
    [("numpy", "numpy was 1.0, not "), ("source", "the program's own code was another")],
)
def test_another_program_is_refused(folder: Path, name: str, message: str) -> None:
    table = SETTINGS.table()
    (folder / "campaign.json").write_text(json.dumps(table | {"versions": table["versions"] | {name: "1.0"}}))
    with pytest.raises(InputError, match=message):
        keep_settings(SETTINGS, folder)


def test_files_from_before_there_were_scenes_are_of_courses(folder: Path) -> None:
    table = SETTINGS.table()
    for key in ("problems", "deadline"):
        del table[key]
    (folder / "campaign.json").write_text(json.dumps(table))
    assert read_settings(folder) == SETTINGS.table()
    keep_settings(SETTINGS, folder)


def test_without_rows_there_is_nothing_to_mix_up(folder: Path) -> None:
    (folder / "rows.jsonl").write_text("")
    keep_settings(replace(SETTINGS, seed=4), folder)
    assert read_settings(folder)["seed"] == 4


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (None, "is no campaign, it has no campaign.json"),
        ("{", "cannot be read"),
        ("[]", "is no campaign's"),
        ("{}", "is no campaign's"),
    ],
)
def test_rows_of_no_campaign_are_refused(folder: Path, text: str | None, message: str) -> None:
    (folder / "campaign.json").unlink()
    if text is not None:
        (folder / "campaign.json").write_text(text)
    with pytest.raises(InputError, match=message):
        keep_settings(SETTINGS, folder)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"count": 0}, "count = 0: must be >= 1"),
        ({"count": 1_000_001}, "count = 1000001: must be >= 1 and <= 1000000"),
        ({"seed": -1}, "seed = -1: must be >= 0"),
        ({"method": "best"}, "method = 'best': must be one of dynamic"),
        ({"preset": "best"}, "preset = 'best': must be one of default"),
        ({"deadline": 0.0}, "deadline"),
    ],
)
def test_settings_that_make_no_sense_are_refused(change: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        replace(SETTINGS, **change)


def test_the_digest_is_of_the_code(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    assert source_digest() == source_digest() == versions()["source"]
    for package in ("geometry", "estimation", "rti_mpcc"):
        (tmp_path / package).mkdir()
        (tmp_path / package / "__init__.py").write_text("")
    monkeypatch.setattr(geometry, "__file__", str(tmp_path / "geometry" / "__init__.py"))
    before = source_digest()
    (tmp_path / "rti_mpcc" / "report").mkdir()
    (tmp_path / "rti_mpcc" / "report" / "table.py").write_text("x = 1\n")
    assert source_digest() == before
    (tmp_path / "rti_mpcc" / "__init__.py").write_text("x = 1\n")
    assert source_digest() != before
