"""No module that decides or plans has numbers of its own: what changes behaviour stands in the settings.

A setting has a unit, a meaning, a range, and can be changed for one controller (`rti_mpcc/config/`). What is
left in the modules changes nothing that a vehicle does, and is listed here with the reason.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2] / "rti_mpcc"
PLACES = ("behaviour", "planning", "scouting.py", "driving.py", "docking.py")
"""Folders and files of the package that are looked through."""
ALLOWED = {
    "planning/cusp.py: _STEPS": "a table: the grid of poses tried around a cusp, its size is a setting",
    "planning/pace.py: FLAT": "keeps a division by a curvature of 0 finite, far below any path's",
}
NUMBERS = ("pi", "tau", "e", "inf")
"""Names of numbers that a constant may be made from."""


def files(places: tuple[str, ...], root: Path) -> Iterator[Path]:
    for place in places:
        found = root / place
        yield from sorted(found.rglob("*.py")) if found.is_dir() else [found]


def is_number(node: ast.AST) -> bool:
    if isinstance(node, ast.Name):
        return node.id in NUMBERS
    return isinstance(node, ast.Constant) and type(node.value) in (int, float, complex)


def evaluated(node: ast.AST) -> Iterator[ast.AST]:
    """All of an expression but what only a later call evaluates, and places in a sequence."""
    if isinstance(node, ast.Lambda):
        return
    yield node
    for child in ast.iter_child_nodes(node):
        if not (isinstance(node, ast.Subscript) and child is node.slice):
            yield from evaluated(child)


def numeric_constants(source: str) -> list[str]:
    """Names that a module gives to values with numbers in them."""
    found: list[str] = []
    for node in ast.parse(source).body:
        if isinstance(node, ast.Assign):
            targets = node.targets
        elif isinstance(node, ast.AnnAssign | ast.AugAssign):
            targets = [node.target]
        else:
            continue
        if node.value is not None and any(map(is_number, evaluated(node.value))):
            names = (each for target in targets for each in ast.walk(target))
            found += [each.id for each in names if isinstance(each, ast.Name)]
    return found


def constants(places: tuple[str, ...], root: Path) -> list[str]:
    return [
        f"{file.relative_to(root).as_posix()}: {name}"
        for file in files(places, root)
        for name in numeric_constants(file.read_text(encoding="utf-8"))
    ]


@pytest.mark.parametrize("place", PLACES)
def test_there_is_something_to_look_through(place: str) -> None:
    assert list(files((place,), ROOT))
    assert all(file.exists() for file in files((place,), ROOT))


def test_numbers_that_change_behaviour_are_settings() -> None:
    assert [name for name in constants(PLACES, ROOT) if name not in ALLOWED] == []


def test_what_is_allowed_is_still_there() -> None:
    assert set(ALLOWED) <= set(constants(PLACES, ROOT))


@pytest.mark.parametrize(
    ("source", "names"),
    [
        ("A = 0.5", ["A"]),
        ("_a: float = -3", ["_a"]),
        ("A, B = 0.2, 0.1", ["A", "B"]),
        ("A = 0.5 * pi", ["A"]),
        ("A = tau", ["A"]),
        ("A = radians(2.0)", ["A"]),
        ("A = {'x': [1.0]}", ["A"]),
        ("A = np.array([1, 2])", ["A"]),
        ("A = Thing(least=3)", ["A"]),
    ],
)
def test_a_constant_with_a_number_is_found(source: str, names: list[str]) -> None:
    assert numeric_constants(source) == names


@pytest.mark.parametrize(
    "source",
    [
        "A = 'text'",
        "A = True",
        "A = (Phase.ONE, Phase.TWO)",
        "A = LISTED[0]",
        "A = lambda x: x + 1.0",
        "def f():\n    a = 0.5",
        "class A:\n    a: float = 0.5",
        "A: float",
    ],
)
def test_what_is_no_constant_with_a_number_is_not(source: str) -> None:
    assert numeric_constants(source) == []
