"""What controls and plans has no numbers of its own: what changes behaviour stands in the settings.

A setting has a unit, a meaning, a range, and can be changed for one controller (`rti_mpcc/config/`). What is
left in the modules is a table, a unit, or below what shows: the lists say which numbers, and why.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[2] / "rti_mpcc"
OPTIMAL_CONTROL = ("model", "ocp", "qp", "safety", "controller.py", "iteration.py")
"""Where no function has numbers of its own, either."""
DECISIONS = (
    "manoeuvre.py",
    "baselines.py",
    "planning",
    "behaviour",
    "scouting.py",
    "driving.py",
    "docking.py",
    "orders.py",
    "mission",
)

TABLE = "an index, or a table of indices"
UNIT = "what one scaled unit of a variable is: the QP stays the same"
RULE = "nodes and weights of a quadrature"
NEUTRAL = "nothing acts beside the commands, or is asked for"
COUNT = "what a count or a time begins with"
ROUNDING = "what rounding may leave of a number"
UNSET = "stands beside what uses it with its reason, and no user has had one to set it"
MODULES: dict[str, dict[str, str]] = {
    "manoeuvre.py": {NEUTRAL: "dwell", COUNT: "nearest nodes seconds"},
    "baselines.py": {"weights in the name of a method that the paper compares": "CONSTANT"},
    "planning/agenda.py": {COUNT: "attempt trouble_since came"},
    "planning/cusp.py": {"the grid of poses tried around a cusp, its size is a setting": "_STEPS"},
    "planning/goals.py": {COUNT: "excess changes", UNSET: "NOISE NOISE_HEADING NOISE_TIME"},
    "planning/obstacles.py": {ROUNDING: "ROUNDING"},
    "planning/plausibility.py": {COUNT: "at tries steering_gap since"},
    "planning/search.py": {
        "one iteration from a solution of the last cycle": "patience least unsolved settled"
    },
    "planning/state.py": {
        COUNT: "stood clear_of driving_since offset unsolved seen_to since changes ways seconds"
    },
    "planning/surroundings.py": {COUNT: "given_at changes"},
    "planning/timing.py": {UNSET: "MOST_STEPS"},
    "planning/schedule.py": {UNSET: "SOON"},
    "planning/pace.py": {"keeps a division by a curvature of 0 finite, far below any path's": "FLAT"},
    "safety/contact.py": {UNSET: "MOST_BODIES"},
    "safety/naming.py": {"for the words of reasons alone": "NEAR MOST_NAMED"},
    "model/layout.py": {
        TABLE: "X Y PHI POSE V DELTA THETA STATES A DELTA_DOT THETA_DOT CONTROLS",
    },
    "model/bicycle.py": {RULE: "_TIMES _TURNS _WAYS _TURNED_FOR", TABLE: "_TURNED_AT _DRIVEN_AT"},
    "model/disturbance.py": {NEUTRAL: "acceleration steering gain turn", UNSET: "ACROSS"},
    "model/footprint.py": {"a point of the vehicle, not a number of its own": "AXLE"},
    "ocp/frenet.py": {TABLE: "LAG CONTOURING HEADING"},
    "ocp/objectives.py": {NEUTRAL: "goal_wheels"},
    "ocp/targets.py": {NEUTRAL: "wheels_share"},
    "ocp/corridor_rows.py": {
        TABLE: "MEASURED",
        "in the place of minus infinity, in a row without slopes": "LOOSE",
    },
    "ocp/stage_cost.py": {
        "where a function has come down to a quarter of a percent of its scale": "NOTHING_LEFT"
    },
    "ocp/horizon.py": {"Newton's method ends by itself after some 10 steps": "MOST_STEPS"},
    "qp/pattern.py": {UNIT: "STATE_UNITS CONTROL_UNITS SLACK_UNIT"},
    "qp/filling.py": {TABLE: "_HEADING"},
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
    "safety/contact.py": {ROUNDING: (1e-9,)},
    "safety/decision.py": {"milliseconds": (1e3,)},
    "safety/fallback.py": {"of a motion with an even change of its acceleration": (3.0, 4.0, 6.0, 9.0)},
    "safety/stopping.py": {ROUNDING: (1e-9,)},
}
"""Floating-point numbers in functions, other than `PLAIN` ones."""
PLAIN = (0.0, 0.5, 1.0, 2.0)
NAMES = ("pi", "tau", "e", "inf")
"""Names of numbers that a constant may be made from."""


def files(rooms: tuple[str, ...]) -> list[Path]:
    paths = (PACKAGE / room for room in rooms)
    return [file for path in paths for file in (sorted(path.rglob("*.py")) if path.is_dir() else [path])]


def name(file: Path) -> str:
    return file.relative_to(PACKAGE).as_posix()


def is_number(node: ast.AST) -> bool:
    if isinstance(node, ast.Name):
        return node.id in NAMES
    return isinstance(node, ast.Constant) and type(node.value) in (int, float, complex)


def evaluated(node: ast.AST) -> Iterator[ast.AST]:
    """All of an expression but what only a later call evaluates, and places in a sequence."""
    if isinstance(node, ast.Lambda):
        return
    yield node
    for child in ast.iter_child_nodes(node):
        if not (isinstance(node, ast.Subscript) and child is node.slice):
            yield from evaluated(child)


def constants(source: str) -> set[str]:
    """Names that are assigned at the level of a module or a class, and hold a number in some way."""
    blocks = [
        node.body for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Module | ast.ClassDef)
    ]
    found: set[str] = set()
    for statement in (each for block in blocks for each in block):
        if isinstance(statement, ast.Assign):
            targets = statement.targets
        elif isinstance(statement, ast.AnnAssign | ast.AugAssign):
            targets = [statement.target]
        else:
            continue
        if statement.value is not None and any(map(is_number, evaluated(statement.value))):
            found |= {each.id for each in ast.walk(ast.Tuple(targets)) if isinstance(each, ast.Name)}
    return found


def numbers(source: str) -> set[float]:
    """Floating-point numbers in functions."""
    functions = (node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.FunctionDef))
    nodes = (node for function in functions for node in ast.walk(function))
    return {node.value for node in nodes if isinstance(node, ast.Constant) and type(node.value) is float}


@pytest.mark.parametrize("file", files((*OPTIMAL_CONTROL, *DECISIONS)), ids=name)
def test_what_decides_is_a_setting(file: Path) -> None:
    allowed = {each for names in MODULES.get(name(file), {}).values() for each in names.split()}
    assert constants(file.read_text(encoding="utf-8")) == allowed


@pytest.mark.parametrize("file", files(OPTIMAL_CONTROL), ids=name)
def test_no_function_has_a_number_of_its_own(file: Path) -> None:
    allowed = {each for some in FUNCTIONS.get(name(file), {}).values() for each in some}
    assert numbers(file.read_text(encoding="utf-8")) - set(PLAIN) == allowed


def test_every_file_of_the_lists_is_there() -> None:
    assert {*MODULES, *FUNCTIONS} <= {name(file) for file in files((*OPTIMAL_CONTROL, *DECISIONS))}


@pytest.mark.parametrize("room", [*OPTIMAL_CONTROL, *DECISIONS])
def test_there_is_something_to_look_through(room: str) -> None:
    assert files((room,))
    assert all(file.exists() for file in files((room,)))


@pytest.mark.parametrize(
    ("source", "found"),
    [
        ("A = 0.5", {"A"}),
        ("_a: float = -3", {"_a"}),
        ("A, B = (0.3, 1.0), radians(2.0)", {"A", "B"}),
        ("A = 0.5 * pi", {"A"}),
        ("A = tau", {"A"}),
        ("A = {'x': [1.0]}", {"A"}),
        ("A = np.array([1, 2])", {"A"}),
        ("A = Thing(least=3)", {"A"}),
        ("class Guard:\n    least: float = 0.1", {"least"}),
        ("A = 'text'\nB = True\nC: float", set()),
        ("A = (Phase.ONE, Phase.TWO)", set()),
        ("A = LISTED[0]", set()),
        ("A = lambda x: x + 1.0", set()),
        ("def f():\n    a = 0.5", set()),
    ],
)
def test_constants_are_found(source: str, found: set[str]) -> None:
    assert constants(source) == found


def test_numbers_of_functions_are_found() -> None:
    assert numbers("def f(x=0.2):\n    return 3 * x + 0.7\nNEAR = 0.3") == {0.2, 0.7}
