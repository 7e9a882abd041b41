"""Every change of behaviour in benchmarks/mutations.toml is noticed by a test of the fast suite."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.mutate import NO_PLACE, NO_TESTS, SURVIVED, Edit, edits, noticed_by, place_of
from benchmarks.tables import ROOT

EDIT = Edit(
    what="what it adds is subtracted",
    file="rti_mpcc/adding.py",
    old="one + other",
    new="one - other",
    tests=("test_adding.py",),
)


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """A small tree with one function and a test of it."""
    for folder in ("geometry", "estimation", "rti_mpcc", "tests"):
        (tmp_path / folder).mkdir()
    (tmp_path / "rti_mpcc" / "__init__.py").touch()
    (tmp_path / "rti_mpcc" / "adding.py").write_text("def add(one, other):\n    return one + other\n")
    test = "from rti_mpcc.adding import add\n\n\ndef test_it():\n    assert add(2, {}) == {}\n"
    (tmp_path / "tests" / "test_adding.py").write_text(test.format(2, 4))
    (tmp_path / "tests" / "test_more.py").write_text(test.format(0, 2))
    return tmp_path


def test_an_edit_is_noticed_by_the_test_that_fails(tree: Path) -> None:
    assert noticed_by(EDIT, tree) == "tests/test_adding.py::test_it"


def test_an_edit_that_no_test_notices_survives(tree: Path) -> None:
    (tree / "tests" / "test_adding.py").write_text("def test_it():\n    pass\n")
    assert noticed_by(EDIT, tree) == SURVIVED
    assert (tree / "rti_mpcc" / "adding.py").read_text().endswith("one + other\n")


def test_survivors_meet_the_whole_suite_where_that_is_asked_for(tree: Path) -> None:
    (tree / "tests" / "test_adding.py").unlink()
    (tree / "tests" / "test_more.py").write_text(
        "from rti_mpcc.adding import add\n\n\ndef test_it():\n    assert add(1, 2) == 3\n"
    )
    assert noticed_by(EDIT, tree) == SURVIVED
    assert noticed_by(EDIT, tree, everything=True) == "tests/test_more.py::test_it"


def test_code_that_has_moved_is_found(tree: Path) -> None:
    moved = tree / "geometry" / "sums.py"
    (tree / "rti_mpcc" / "adding.py").rename(moved)
    assert place_of(EDIT, tree) == moved


@pytest.mark.parametrize("text", ["", "one + other\n" * 2])
def test_code_that_is_gone_or_there_twice_is_no_place(tree: Path, text: str) -> None:
    (tree / "rti_mpcc" / "adding.py").write_text(text)
    assert noticed_by(EDIT, tree) == NO_PLACE


def test_each_edit_changes_something_in_code_that_is_named() -> None:
    assert len({edit.what for edit in edits()}) == len(edits()) >= 60
    assert all(edit.old != edit.new and edit.tests for edit in edits())
    assert [edit.what for edit in edits() if place_of(edit, ROOT) is None] == []


@pytest.mark.acceptance
@pytest.mark.parametrize("edit", edits(), ids=lambda edit: edit.what)
def test_every_edit_is_noticed(edit: Edit) -> None:
    assert noticed_by(edit) not in (SURVIVED, NO_PLACE, NO_TESTS)
