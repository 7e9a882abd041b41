"""`rti-mpcc compare`: tables, JSON, animations, refusals."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from PIL import Image

from rti_mpcc.cli import main
from tests.rti_mpcc.cli_runs import write_short


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    write_short(0.3)


def test_every_method_and_preset_is_run_and_told(capsys: pytest.CaptureFixture[str]) -> None:
    asked = ["--methods", "dynamic", "constant_50", "--presets", "paper", "default"]
    assert main(["compare", "short.toml", *asked, "--jobs", "1", "--out", "there"]) == 0
    said = capsys.readouterr()
    assert said.err == ""
    found = json.loads(Path("there/comparison.json").read_text())
    assert [(run["preset"], run["method"]) for run in found] == [
        ("paper", "dynamic"),
        ("paper", "constant_50"),
        ("default", "dynamic"),
        ("default", "constant_50"),
    ]
    assert all(run["scenario"] == "short" for run in found)
    assert found[0]["ratios"]["energy.acceleration"] == 1.0
    for name in ("dynamic", "(paper)", "constant_50", "energy acceleration, ratio"):
        assert name in said.out
    assert "there/comparison.json" in said.out


def test_two_scenarios_of_one_name_are_refused(capsys: pytest.CaptureFixture[str]) -> None:
    Path("other.toml").write_text(Path("short.toml").read_text())
    assert main(["compare", "short.toml", "other.toml"]) == 2
    said = capsys.readouterr()
    told = "short.toml and other.toml have the same name, 'short': give each its own"
    assert said.err == f"rti-mpcc: error: {told}\n"
    assert not Path("runs").exists()


def test_animations_show_the_runs_side_by_side(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["compare", "short.toml", "--methods", "dynamic", "switched", "--animate"]) == 0
    (file,) = (file for file in Path("runs/compare").iterdir() if file.stem == "short")
    assert str(file) in capsys.readouterr().out
    if file.suffix == ".gif":
        with Image.open(file) as picture:
            picture.seek(1)  # raises where there is one frame only
    assert file.stat().st_size > 1000


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["nowhere"], "nowhere"),
        (["short.toml", "--methods", "best"], "invalid choice: 'best'"),
        (["short.toml", "--presets", "best"], "invalid choice: 'best'"),
        (["short.toml", "--jobs", "0"], "'0' must be an integer >= 1"),
        (["short.toml", "--jobs", "two"], "'two' must be an integer >= 1"),
        ([], "required: SCENARIO"),
    ],
)
def test_what_cannot_be_compared_is_refused(
    capsys: pytest.CaptureFixture[str], arguments: list[str], message: str
) -> None:
    assert main(["compare", *arguments]) == 2
    said = capsys.readouterr()
    assert message in said.err
    assert said.out == ""
    assert not Path("runs").exists()
