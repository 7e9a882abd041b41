"""Base libraries are enough for a control loop; where an extra is missing, one sentence names it."""

from __future__ import annotations

import ast
import os
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest

from tests.rti_mpcc.test_layers import PACKAGES, imported, module_name, sources

ROOT = Path(__file__).parents[2]
BASE = ("rti_mpcc", "rti_mpcc.mission", "rti_mpcc.recording", "rti_mpcc.simulation")
"""What a control loop imports, and the plant and the closed loop that stand for a vehicle."""
SIM = ("rti_mpcc.report", "rti_mpcc.cli")
"""Packages that say which extra is missing when they are imported."""
PART_OF = {"pydantic_core": "pydantic", "markupsafe": "jinja2"}
"""Imported libraries that come with another one, in the version that it needs."""
REFUSED = ("matplotlib", "pandas", "rich", "tomlkit", "joblib", "cv2", "mcap", "mcap_protobuf")
REFUSED += ("foxglove_schemas_protobuf", "distributed", "dask")
"""Libraries of the extras; jinja2 is none of them, as osqp imports it."""


def normal(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def listed() -> dict[str, set[str]]:
    """Distributions of pyproject.toml by their extra, those of the base by ""."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    lists = {"": project["dependencies"], **project["optional-dependencies"]}
    return {
        extra: {normal(re.split(r"[\[<>=~;]", line)[0]) for line in lines} - {"rti-mpcc"}
        for extra, lines in lists.items()
    }


def distributions(names: set[str]) -> set[str]:
    """What has to be installed for these full names of modules."""
    known = packages_distributions()
    tops = {name.partition(".")[0] for name in names} - set(sys.stdlib_module_names) - set(PACKAGES)
    return {normal(PART_OF.get(top) or known[top][0]) for top in tops}


def guarded(file: Path) -> dict[str, set[str]]:
    """Imports by the extra that the function around them checks; "" where none is checked."""
    found: dict[str, set[str]] = {}
    for function in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if not isinstance(function, ast.FunctionDef):
            continue
        nodes = list(ast.walk(function))
        for call in nodes:
            if isinstance(call, ast.Call) and getattr(call.func, "id", "") == "check_extra":
                assert isinstance(call.args[0], ast.Constant)
                names = found.setdefault(str(call.args[0].value), set())
                names.update(alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names)
                names.update(str(node.module) for node in nodes if isinstance(node, ast.ImportFrom))
    found[""] = {
        name for name in imported(file, ROOT) if not any(name.startswith(tuple(each)) for each in found.values())
    }
    return found


def reached(files: dict[str, Path], start: tuple[str, ...]) -> set[str]:
    """Modules of this project that are imported at last, by their names."""
    left, found = list(start), set[str]()
    while left:
        parts = left.pop().split(".")
        for length in range(1, len(parts) + 1):
            name = ".".join(parts[:length])
            if name in files and name not in found:
                found.add(name)
                left += imported(files[name], ROOT)
    return found


def test_pyproject_lists_what_is_imported_and_nothing_else() -> None:
    files = {module_name(file, ROOT): file for file in sources(ROOT)}
    base = reached(files, BASE)
    assert not {name for name in base if name.startswith(SIM)}
    needed: dict[str, set[str]] = {extra: set() for extra in listed()}
    for name, file in files.items():
        for extra, names in guarded(file).items():
            needed[extra or ("" if name in base else "sim")] |= distributions(names)
    needed["sim"] -= needed[""]
    del needed["docs"], needed["test"]
    assert needed == {extra: names for extra, names in listed().items() if extra in needed}
