"""The optimal control problem, its QP and the safety layer hold no numbers of their own: they are settings.

What stays in a module is a table, a unit, or below what shows: the lists say which numbers, and why.
"""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[2] / "rti_mpcc"
ROOMS = ("ocp", "qp", "safety", "model", "controller.py")

TABLE = "an index, or a table of indices"
UNIT = "what one scaled unit of a variable is: the QP stays the same"
RULE = "nodes and weights of a quadrature"
NEUTRAL = "nothing acts beside the commands"
ROUNDING = "what rounding may leave of a number"
MODULES: dict[str, dict[str, str]] = {
    "model/layout.py": {
        TABLE: "X Y PHI POSE V DELTA THETA STATES A DELTA_DOT THETA_DOT CONTROLS",
    },
    "model/bicycle.py": {RULE: "_TIMES _SIMPSON _PARTS _TURNED_FOR", TABLE: "_TURNED_AT _DRIVEN_AT"},
    "model/disturbance.py": {NEUTRAL: "acceleration steering gain"},
    "ocp/frenet.py": {TABLE: "LAG CONTOURING HEADING"},
    "ocp/corridor_rows.py": {
        TABLE: "MEASURED",
        "in the place of minus infinity, in a row without slopes": "LOOSE",
    },
    "ocp/separating_planes.py": {ROUNDING: "_TINY"},
    "ocp/stage_cost.py": {
        "where a function has come down to a quarter of a percent of its scale": "NOTHING_LEFT"
    },
    "ocp/horizon.py": {"Newton's method ends by itself after some 10 steps": "MOST_STEPS"},
    "qp/pattern.py": {UNIT: "STATE_UNITS CONTROL_UNITS SLACK_UNIT"},
    "qp/filling.py": {TABLE: "_DIAGONAL _DAMPED _IDLE _HEADING"},
    "safety/contact.py": {"an error bound of geometry's samples; by it an exact check is left out": "UNSURE"},
}
"""Numbers at the level of a module or a class: file, why they are no settings, names."""

FUNCTIONS: dict[str, dict[str, tuple[float, ...]]] = {
    "model/bicycle.py": {RULE: (4.0, 6.0)},
    "ocp/corridor_rows.py": {"of (H4), 3/2": (1.5,)},
    "ocp/horizon.py": {
        ROUNDING: (1e-6, 1e-15),
        "first stages at least; no plan is as short": (3.0,),
    },
    "ocp/stage_cost.py": {ROUNDING: (1e-12,)},
    "safety/contact.py": {"of (S1), 4/27 + 1/8": (4.0, 27.0, 0.125), ROUNDING: (1e-9,)},
    "safety/decision.py": {"milliseconds": (1e3,)},
    "safety/stopping.py": {ROUNDING: (1e-9,)},
}
"""Floating-point numbers in functions, other than `PLAIN` ones."""
PLAIN = (0.0, 0.5, 1.0, 2.0)


def files() -> list[Path]:
    paths = (PACKAGE / room for room in ROOMS)
    return [file for path in paths for file in (sorted(path.rglob("*.py")) if path.is_dir() else [path])]


def name(file: Path) -> str:
    return file.relative_to(PACKAGE).as_posix()


def holds_a_number(node: ast.AST) -> bool:
    return any(isinstance(each, ast.Constant) and type(each.value) in (int, float) for each in ast.walk(node))


def constants(source: str) -> set[str]:
    """Names that are assigned at the level of a module or a class, and hold a number in some way."""
    blocks = [
        node.body for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Module | ast.ClassDef)
    ]
    found: set[str] = set()
    for statement in (each for block in blocks for each in block):
        if isinstance(statement, ast.Assign):
            targets, value = statement.targets, statement.value
        elif isinstance(statement, ast.AnnAssign) and statement.value is not None:
            targets, value = [statement.target], statement.value
        else:
            continue
        if holds_a_number(value):
            found |= {each.id for each in ast.walk(ast.Tuple(targets)) if isinstance(each, ast.Name)}
    return found


def numbers(source: str) -> set[float]:
    """Floating-point numbers in functions."""
    functions = (node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.FunctionDef))
    nodes = (node for function in functions for node in ast.walk(function))
    return {node.value for node in nodes if isinstance(node, ast.Constant) and type(node.value) is float}


@pytest.mark.parametrize("file", files(), ids=name)
def test_what_decides_is_a_setting(file: Path) -> None:
    allowed = {each for names in MODULES.get(name(file), {}).values() for each in names.split()}
    assert constants(file.read_text(encoding="utf-8")) == allowed


@pytest.mark.parametrize("file", files(), ids=name)
def test_no_function_has_a_number_of_its_own(file: Path) -> None:
    allowed = {each for some in FUNCTIONS.get(name(file), {}).values() for each in some}
    assert numbers(file.read_text(encoding="utf-8")) - set(PLAIN) == allowed


def test_every_file_of_the_lists_is_there() -> None:
    assert {*MODULES, *FUNCTIONS} <= {name(file) for file in files()}


@pytest.mark.parametrize(
    ("source", "found"),
    [
        ("NEAR = 0.3", {"NEAR"}),
        ("NEAR: Final = -3", {"NEAR"}),
        ("NEAR, FAR = (0.3, 1.0), radians(2.0)", {"NEAR", "FAR"}),
        ("class Guard:\n    least: float = 0.1", {"least"}),
        ("NAME = 'a'\nON = True\ndef f() -> float:\n    x = 0.1\n    return x", set()),
    ],
)
def test_constants_are_found(source: str, found: set[str]) -> None:
    assert constants(source) == found


def test_numbers_of_functions_are_found() -> None:
    assert numbers("def f(x=0.2):\n    return 3 * x + 0.7\nNEAR = 0.3") == {0.2, 0.7}
