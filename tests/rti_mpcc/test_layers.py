"""Imports run one way: the layers of the design, read from the syntax trees of all source files."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = ("geometry", "estimation", "rti_mpcc")

# Each layer may import itself and those before it.
LAYERS = (
    "model",
    "ocp",
    "objectives",
    "qp",
    "iteration",
    "controller",
    "manoeuvre",
    "steps",
    "paper",
    "route_planner",
    "clock",
    "mission_state",
    "world",
    "state",
    "course",
    "drive",
    "orders",
    "docking",
    "mission",
    "recording",
    "simulation",
    "report",
    "cli",
)
# Every layer may import these; they import geometry and one another only.
FOUNDATION = ("config", "types", "errors", "kernels", "version", "_shadow")
RANK = (
    {"geometry": 0}
    | dict.fromkeys(FOUNDATION, 1)
    | {name: 2 + place for place, name in enumerate(LAYERS)}
    # The package itself re-exports what a control loop needs, up to missions.
    | {"rti_mpcc": 2 + LAYERS.index("mission"), "__main__": 2 + LAYERS.index("cli")}
)


def sources(root: Path) -> Iterator[Path]:
    for package in PACKAGES:
        yield from sorted((root / package).rglob("*.py"))


def module_name(file: Path, root: Path) -> str:
    parts = file.relative_to(root).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


@cache
def imported(file: Path, root: Path) -> set[str]:
    """Full names of all that a file imports, at whatever place and for whatever purpose."""
    name = module_name(file, root)
    package = name if file.name == "__init__.py" else name.rpartition(".")[0]
    names: set[str] = set()
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            above = package.split(".")[: len(package.split(".")) - node.level + 1] if node.level else []
            base = ".".join([*above, *([node.module] if node.module else [])])
            names.update(f"{base}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.Call) and node.args and isinstance(node.args[0], ast.Constant):
            called = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            if called in ("import_module", "__import__"):
                names.add(str(node.args[0].value))
    return names


def layer(name: str) -> str:
    """Layer of a full name: 'rti_mpcc.qp.pattern' -> 'qp', 'rti_mpcc.RtiMpcc' -> 'rti_mpcc'."""
    package, _, rest = name.partition(".")
    if package != "rti_mpcc":
        return package
    head = rest.partition(".")[0]
    return head if head in RANK else "rti_mpcc"


def may_import(importer: str, target: str) -> bool:
    if importer == target or target == "geometry":
        return True
    if importer == "geometry" or importer == "estimation":
        return False
    if target == "estimation":
        # Settings and values name what it estimates; the optimal control problem knows no detections.
        return importer in ("config", "types") or (
            importer == "steps" or RANK[importer] >= RANK["mission_state"]
        )
    if importer in FOUNDATION:
        return target in FOUNDATION
    return RANK[target] <= RANK[importer]


def violations(root: Path) -> list[str]:
    found = []
    for file in sources(root):
        name = module_name(file, root)
        importer = layer(name)
        if importer == "rti_mpcc" and name != "rti_mpcc":
            found.append(f"{name} belongs to no layer")
            continue
        for target in sorted(imported(file, root)):
            if target.partition(".")[0] in PACKAGES and not may_import(importer, layer(target)):
                found.append(f"{name} imports {target}")
    return found


def importers(root: Path, library: str) -> list[str]:
    return [
        file.relative_to(root).as_posix()
        for file in sources(root)
        if any(name.partition(".")[0] == library for name in imported(file, root))
    ]


def test_imports_run_one_way() -> None:
    assert violations(ROOT) == []


@pytest.mark.parametrize(
    ("library", "where"),
    [
        ("matplotlib", r"rti_mpcc/report/.*"),
        ("osqp", r"rti_mpcc/qp/\w+\.py"),
        ("filterpy", r"estimation/track\.py"),
        ("cv2", r"estimation/charuco\.py"),
    ],
)
def test_a_library_is_imported_in_its_place_only(library: str, where: str) -> None:
    files = importers(ROOT, library)
    assert files
    assert all(re.fullmatch(where, file) for file in files), files
    assert library == "matplotlib" or len(files) == 1


@pytest.mark.parametrize(
    ("file", "statement"),
    [
        ("geometry/pose.py", "import rti_mpcc"),
        ("estimation/filter.py", "from rti_mpcc.types import Command"),
        ("rti_mpcc/config.py", "from rti_mpcc.model import bicycle"),
        ("rti_mpcc/controller.py", "import estimation"),
        ("rti_mpcc/model/bicycle.py", "from rti_mpcc import ocp"),
        ("rti_mpcc/model/bicycle.py", "from ..ocp.layout import X"),
        ("rti_mpcc/qp/door.py", "def late():\n    import rti_mpcc.controller"),
        (
            "rti_mpcc/course/route_start.py",
            "from importlib import import_module\nimport_module('rti_mpcc.docking')",
        ),
        ("rti_mpcc/ocp/objectives.py", "from estimation import GoalEstimate"),
        ("rti_mpcc/__init__.py", "from .simulation import simulate"),
        ("rti_mpcc/simulation/plant.py", "from ..report import table"),
        ("rti_mpcc/stray.py", ""),
    ],
)
def test_the_wrong_way_is_found(tmp_path: Path, file: str, statement: str) -> None:
    path = tmp_path / file
    path.parent.mkdir(parents=True)
    path.write_text(statement, encoding="utf-8")
    assert len(violations(tmp_path)) == 1
