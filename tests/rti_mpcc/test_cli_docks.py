"""`rti-mpcc docks`: what it prints and writes, its exit status, and what it refuses."""

from __future__ import annotations

from pathlib import Path

import pytest

from rti_mpcc.cli import main
from tests.rti_mpcc.dock_files import FIRST, SECOND, written


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    written(tmp_path, FIRST + SECOND)


def refusal(capsys: pytest.CaptureFixture[str], *arguments: str) -> list[str]:
    """The lines on stderr of a call that must be refused."""
    assert main(["docks", *arguments]) == 2
    said = capsys.readouterr()
    assert "Traceback" not in said.out + said.err
    assert said.out == ""
    return said.err.splitlines()


def test_it_lists_the_docks_and_draws_them(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["docks", "yard.toml"]) == 0
    said = capsys.readouterr()
    assert said.err == ""
    for word in ("yard.toml", "heading [deg]", "first", "10.00, 5.00, 90.0", "2 in reverse", "second"):
        assert word in said.out
    picture = Path("runs/yard/docks.png")
    assert str(picture) in said.out
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_out_says_where_the_picture_goes() -> None:
    assert main(["docks", "yard.toml", "--out", "here/there"]) == 0
    assert [file.name for file in Path("here/there").iterdir()] == ["docks.png"]
    assert not Path("runs").exists()


def test_names_are_shown_as_they_are(capsys: pytest.CaptureFixture[str]) -> None:
    # Neither markup of the terminal nor a formula of matplotlib.
    Path("[red] $x.toml").write_text(SECOND.replace("second", r"[red] $\\frac$ bay"))
    assert main(["docks", "[red] $x.toml"]) == 0
    said = capsys.readouterr().out
    assert r"[red] $\frac$ bay" in said
    assert "[red] $x.toml" in said


def test_a_long_name_takes_nothing_from_the_other_columns(capsys: pytest.CaptureFixture[str]) -> None:
    written(Path(), FIRST.replace("first", "capsule_" * 12, 1))
    assert main(["docks", "yard.toml"]) == 0
    said = capsys.readouterr().out
    for word in ("charuco", "10.00, 5.00, 90.0", "2 in reverse", "0.05, 0.02, 0.57", "-1.3"):
        assert word in said


def test_a_line_for_each_mistake(capsys: pytest.CaptureFixture[str]) -> None:
    written(Path(), FIRST.replace("length = 2.0", "length = 0") + SECOND.replace("20", '"far"'))
    first, second = refusal(capsys, "yard.toml")
    assert first == "rti-mpcc: error: yard.toml: dock[0].approach.length = 0: must be > 0"
    assert second == "rti-mpcc: error: yard.toml: dock[1].pose[0] = 'far': must be a number"
    assert not Path("runs").exists()


def test_files_and_folders_that_are_none(capsys: pytest.CaptureFixture[str]) -> None:
    (line,) = refusal(capsys, "none.toml")
    assert line.startswith("rti-mpcc: error: none.toml: cannot be read, ")
    (line,) = refusal(capsys, "yard.toml", "--out", "yard.toml")
    assert "yard.toml: " in line
    assert "required: FILE" in refusal(capsys)[-1]
