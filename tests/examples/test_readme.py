"""The Python code of README.md runs as typed, each block alone; that of docs/using.md block after block."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.rti_mpcc.own_code import python_blocks

ROOT = Path(__file__).parents[2]


def run_blocks(page: Path, count: int, *, alone: bool = False) -> None:
    """Run the Python blocks of a page one after the other, with the same names, or each `alone`."""
    blocks = python_blocks(page)
    assert len(blocks) == count
    names: dict[str, object] = {}
    for block in blocks:
        exec(compile(block, str(page), "exec"), {} if alone else names)


def test_the_blocks_of_the_readme_give_a_command_and_dock(capsys: pytest.CaptureFixture[str]) -> None:
    run_blocks(ROOT / "README.md", 3, alone=True)
    first, docked, mission = capsys.readouterr().out.splitlines()
    assert mission == "dock MissionResult.RUNNING"
    assert docked.startswith("docked after")
    status, acceleration, rate = first.split()
    assert status == "Status.ARRIVING"
    assert float(acceleration) < 0.0  # it reverses
    assert abs(float(rate)) <= 1.0


@pytest.mark.parametrize(
    ("page", "prints"),
    [
        ("missions.md", "0 dock MissionResult.RUNNING"),
        ("docks.md", "capsule_a capsule_b charger DockKind.CHARUCO -1.2"),
    ],
)
def test_the_block_of_a_page_runs_at_the_root_of_the_repository(
    page: str, prints: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(ROOT)
    run_blocks(ROOT / "docs" / page, 1)
    assert capsys.readouterr().out.splitlines() == [prints]


def test_the_python_blocks_run_as_typed_and_dock(elsewhere: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run_blocks(ROOT / "docs" / "using.md", 5)
    docked, replayed, log = capsys.readouterr().out.splitlines()
    assert docked.startswith("docked after")
    assert (replayed, log) == ("identical", "written")
