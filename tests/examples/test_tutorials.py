"""The pages of docs/tutorials run as typed, block after block, and do what they say."""

from __future__ import annotations

import re
import shlex
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

from rti_mpcc import Status
from rti_mpcc.cli import main
from rti_mpcc.config import CostTerm, DockingObjective
from tests.lists import acceptance

FOLDER = Path(__file__).parents[2] / "docs" / "tutorials"
PRINTED = {
    "dock": r"docked after \d\d\.\d s at \(11\.\d+, -15\.\d+, 1\.\d+\)\n.*min clearance",
    "vehicle": r"2\.6 m long, 1\.2 m wide\n.*drive: dead time 0\.\d+",
    "map": r"^PlanOutcome.FOUND \d\d\.\d m, \d segments, 0\.\d\d m clear\ndocked after \d\d s\n$",
    "detector": r"^docked -?0\.0\d\d m, -?0\.0\d\d m, -?0\.0\d+ rad off the true dock\n$",
    "statuses": r"^CALL goal rejected: .*\nlog  arriving: .*\nlog  docked: ",
    "comfort": r"smooth: docks after about \d\d\.\d s\nbrisk: docks .*\nComfort\(.*page\.html",
    "missions": r"^dock: SUCCEEDED .*\nstraight: SUCCEEDED .*\nundock: SUCCEEDED .*\nMissionResult.SUCCEEDED",
    "reproduce": r"method dynamic, preset paper.*method separated, preset paper",
    "own_objective": r"^0: docks after \d\d\.\d s, .*\n1: docks after \d\d\.\d s",
    "compare": r"\nseparated .*\nswitched .*\nmine +True +\d\d\.\d\d ",
}
"""What each page prints."""
LONG = ("compare", "reproduce")
"""Pages that drive many rides."""
PAGES = [acceptance(name, name) if name in LONG else (name, name) for name in PRINTED]
CALLED_BY_HAND = ("make ",)
"""Commands that take too long for a test, or are no part of the package."""


@pytest.fixture
def tutorial(request: pytest.FixtureRequest) -> Iterator[ModuleType]:
    """The module in which a page is typed; the classes that it adds are unknown again afterwards."""
    terms, objectives = set(CostTerm.KINDS), set(DockingObjective.KINDS)
    module = ModuleType(f"tutorial_{request.param}")
    sys.modules[module.__name__] = module
    yield module
    del sys.modules[module.__name__]
    for term in set(CostTerm.KINDS) - terms:
        del CostTerm.KINDS[term]
    for objective in set(DockingObjective.KINDS) - objectives:
        del DockingObjective.KINDS[objective]


def run_shell(block: str) -> None:
    for line in block.splitlines():
        if line.startswith(CALLED_BY_HAND):
            continue
        program, *arguments = shlex.split(line, comments=True)
        assert program == "rti-mpcc"
        assert main(arguments) == 0


def test_there_are_no_other_tutorials() -> None:
    assert sorted(page.stem for page in FOLDER.glob("*.md")) == sorted(PRINTED)


@pytest.mark.parametrize(("name", "tutorial"), PAGES, indirect=["tutorial"])
def test_a_tutorial_runs_as_typed(
    name: str, tutorial: ModuleType, elsewhere: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page = FOLDER / f"{name}.md"
    for language, block in re.findall(
        r"```(\w+)\n(.*?)```", page.read_text(encoding="utf-8"), flags=re.DOTALL
    ):
        if language == "python":
            exec(compile(block, str(page), "exec"), vars(tutorial))
        else:
            assert language == "sh"
            run_shell(block)
    assert re.search(PRINTED[name], capsys.readouterr().out, flags=re.DOTALL)


@pytest.mark.parametrize("name", PRINTED)
def test_a_tutorial_is_short(name: str) -> None:
    text = (FOLDER / f"{name}.md").read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 60
    prose = re.sub(r"```.*?```|^[|#].*?$", "", text, flags=re.DOTALL | re.MULTILINE)
    assert len(prose.split()) <= 150


def test_each_status_is_in_the_table() -> None:
    page = (FOLDER / "statuses.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `([A-Z_]+)` \|", page, flags=re.MULTILINE)
    assert sorted(rows) == sorted(each.name for each in Status)
