"""`rti-mpcc campaign` and `campaign-case`: rows, a table, refusals, one case once more."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from rti_mpcc.cli import campaign, main
from rti_mpcc.errors import CampaignError
from rti_mpcc.simulation import load_scenario
from rti_mpcc.simulation.campaign import CampaignCase, CampaignSettings, Level, Problems, Tally, read_rows
from rti_mpcc.simulation.campaign.runner import run_campaign
from tests.rti_mpcc.simulation.campaign import drives
from tests.rti_mpcc.simulation.campaign.engines import Puppet


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def _made_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """Rows without any run, in this process."""

    def run(settings: CampaignSettings, folder: Path, **others: object) -> Tally:
        return run_campaign(settings, folder, engine=Puppet(), drive=drives.troubled)

    monkeypatch.setattr(campaign, "run_campaign", run)


@pytest.mark.usefixtures("_made_up")
def test_rows_are_kept_and_told(capsys: pytest.CaptureFixture[str]) -> None:
    asked = ["campaign", "--count", "2", "--level", "noisy", "--seed", "3", "--out", "there"]
    assert main([*asked, "--preset", "paper"]) == 0
    said = capsys.readouterr()
    assert said.err == ""
    assert [row["index"] for row in read_rows(Path("there"))] != []
    for told in ("noisy, seed 3, dynamic, paper", "docked", "raised", "50.0 %", "there/rows.jsonl"):
        assert told in said.out
    settings = json.loads(Path("there/campaign.json").read_text())
    assert (settings["count"], settings["seed"], settings["preset"]) == (2, 3, "paper")
    assert main([*asked, "--method", "switched"]) == 2
    said = capsys.readouterr()
    assert said.err.startswith(
        "rti-mpcc: error: there holds another campaign: method was dynamic, not switched"
    )
    assert said.out == ""


@pytest.mark.acceptance
def test_one_real_case_on_a_process(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def run(settings: CampaignSettings, folder: Path, **others: object) -> Tally:
        return run_campaign(settings, folder, drive=drives.short, **others)  # type: ignore[arg-type]

    monkeypatch.setattr(campaign, "run_campaign", run)
    assert main(["campaign", "--count", "1", "--seed", "11", "--out", "there", "--jobs", "1"]) == 0
    case = CampaignCase(seed=11, level=Level.NOMINAL, index=0)
    assert Path("there/rows.jsonl").read_text() == drives.short(case).line()
    assert "unfinished" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("ending", "status", "message"),
    [
        (KeyboardInterrupt, 130, "rti-mpcc: error: interrupted\n"),
        (CampaignError("the engine is lost"), 2, "rti-mpcc: error: the engine is lost\n"),
    ],
)
def test_what_ends_a_campaign_is_told(
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    ending: BaseException,
    status: int,
    message: str,
) -> None:
    def run(*arguments: object, **others: object) -> Tally:
        raise ending

    monkeypatch.setattr(campaign, "run_campaign", run)
    assert main(["campaign", "--count", "1", "--out", "there"]) == status
    said = capsys.readouterr()
    assert said.err == message
    assert "The rows so far are kept in there; the same command goes on behind them." in said.out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--count", "0", "--out", "there"], "'0' must be an integer >= 1"),
        (["--count", "2000000", "--out", "there"], "count = 2000000: must be >= 1 and <= 1000000"),
        (["--count", "2"], "required: --out"),
        (["--out", "there"], "required: --count"),
        (["--count", "2", "--out", "there", "--level", "easy"], "invalid choice: 'easy'"),
        (
            ["--count", "2", "--out", "there", "--jobs", "2", "--dask", "tcp://a:1"],
            "not allowed with argument",
        ),
        (["--count", "2", "--out", "there", "--seed", "-1"], "'-1' must be an integer >= 0"),
        (["--count", "2", "--out", "there", "--deadline", "soon"], "invalid float value: 'soon'"),
        (["--count", "2", "--out", "there", "--deadline", "0"], "deadline"),
    ],
)
def test_what_is_no_campaign_is_refused(
    capsys: pytest.CaptureFixture[str], arguments: list[str], message: str
) -> None:
    assert main(["campaign", *arguments]) == 2
    said = capsys.readouterr()
    assert message in said.err
    assert said.out == ""
    assert not Path("there").exists()


def test_a_case_is_written_as_a_scenario(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["campaign-case", "--level", "hard", "--seed", "11", "--index", "3", "--no-run"]) == 0
    file = "runs/campaign_11_03_hard/campaign_11_03_hard.toml"
    assert load_scenario(file) == CampaignCase(seed=11, level=Level.HARD, index=3).scenario()
    said = capsys.readouterr()
    assert said.err == ""
    assert f"written: {file}" in said.out
    assert f"rti-mpcc run {file} --method dynamic --preset default --seed 11000003\n" in said.out
    assert len(list(Path("runs").rglob("*.*"))) == 1


def test_a_case_may_be_a_scene_with_a_deadline(capsys: pytest.CaptureFixture[str]) -> None:
    asked = ["campaign-case", "--scenes", "--deadline", "0.02", "--seed", "11", "--index", "3", "--no-run"]
    assert main(asked) == 0
    case = CampaignCase(seed=11, level=Level.NOMINAL, index=3, problems=Problems.SCENES, deadline=0.02)
    file = "runs/clutter_11_3_nominal/clutter_11_3_nominal.toml"
    assert load_scenario(file) == case.scenario()
    assert (
        f"rti-mpcc run {file} --method dynamic --preset default --seed 11000003\n" in capsys.readouterr().out
    )


@pytest.mark.usefixtures("_made_up")
def test_a_campaign_may_be_of_scenes(capsys: pytest.CaptureFixture[str]) -> None:
    asked = ["campaign", "--scenes", "--count", "2", "--seed", "3", "--out", "there"]
    assert main(asked) == 0
    assert "scenes, nominal, seed 3, dynamic, default" in capsys.readouterr().out
    settings = json.loads(Path("there/campaign.json").read_text())
    assert (settings["problems"], settings["deadline"]) == ("scenes", None)
    assert {row["scenario"] for row in read_rows(Path("there"))} == {"bay_3_0_nominal", "slot_3_1_nominal"}
    assert main(asked[:1] + asked[2:]) == 2
    assert "problems was scenes, not courses" in capsys.readouterr().err


def test_a_case_is_run_with_its_own_noise(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    short = drives.shortened(CampaignCase(seed=11, level=Level.NOISY, index=3))
    monkeypatch.setattr(CampaignCase, "scenario", lambda case: short)
    asked = ["campaign-case", "--level", "noisy", "--seed", "11", "--index", "3", "--out", "there"]
    assert main([*asked, "--no-plots"]) == 1
    found = json.loads(Path("there/summary.json").read_text())
    assert (found["seed"], found["scenario"]) == (11000003, "campaign_11_03_noisy")
    line = json.loads(drives.short(CampaignCase(seed=11, level=Level.NOISY, index=3)).line())
    assert line["figures"]["distance_m"] == found["distance_m"]


def test_no_case_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["campaign-case", "--index", "1000000"]) == 2
    assert "index = 1000000: must be >= 0 and < 1000000" in capsys.readouterr().err
    assert not Path("runs").exists()
