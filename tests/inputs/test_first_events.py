"""Nothing is loaded in a cycle: the controller has it all when it is made, and the process is prepared."""

from __future__ import annotations

import ast
import gc
import importlib.metadata
import json
import weakref
from collections.abc import Iterator
from pathlib import Path

import pytest

import rti_mpcc
from rti_mpcc.cli import main
from tests.processes import ROOT, printed

KINDS = (
    "first_detection",
    "first_obstacle",
    "first_change_of_direction",
    "first_replan",
    "first_refused_goal",
    "first_unusable_input",
    "first_steps",
    "first_steps_in_an_area",
    "first_plan_in_an_area",
    "first_plan_on_a_map",
    "first_recorded_detection",
)
BEFORE_A_CYCLE = {
    "estimation/actuator_fit.py": {"scipy.optimize"},  # a recording is fitted
    "estimation/charuco.py": {"cv2"},  # a detector is made
    "estimation/track.py": {"filterpy.kalman"},  # a filter is made: with each controller
    "geometry/area.py": {"geometry.map_file"},  # a map is read
    "geometry/interpolation.py": {"scipy.interpolate"},  # a path is drawn through points
    "rti_mpcc/docking.py": {
        "rti_mpcc.course.replanning",
        "rti_mpcc.route_planner.path_repair",
    },  # one is made
    "rti_mpcc/recording/mcap_log.py": {  # a log is made
        "foxglove_schemas_protobuf",
        "mcap.writer",
        "mcap_protobuf.schema",
    },
    "rti_mpcc/course/docking_time.py": {"scipy.optimize"},  # a configuration for a docking time is made
}
"""What functions of the packages import, and before which cycle that happens."""
AROUND_A_CYCLE = ("rti_mpcc/simulation/", "rti_mpcc/report/", "rti_mpcc/cli/", "rti_mpcc/__main__.py")
"""Cycles are called from there, and call nothing there."""


def test_the_first_event_of_a_kind_loads_nothing(tmp_path: Path) -> None:
    """One after the other in a process: what one loads, it has not loaded for those before."""
    found = json.loads(printed("-m", "tests.inputs.first_events", str(tmp_path), *KINDS))
    assert found == {kind: {"loaded": [], "happened": True} for kind in KINDS}


def imported_late(tree: ast.Module) -> Iterator[str]:
    """Modules that functions import."""
    for function in ast.walk(tree):
        if isinstance(function, ast.FunctionDef):
            for node in ast.walk(function):
                if isinstance(node, ast.Import):
                    yield from (alias.name for alias in node.names)
                elif isinstance(node, ast.ImportFrom):
                    yield str(node.module)


def test_functions_that_a_cycle_calls_import_nothing() -> None:
    found = {}
    for package in ("geometry", "estimation", "rti_mpcc"):
        for file in sorted((ROOT / package).rglob("*.py")):
            name = file.relative_to(ROOT).as_posix()
            late = set(imported_late(ast.parse(file.read_text(encoding="utf-8"))))
            if late and not name.startswith(AROUND_A_CYCLE):
                found[name] = late
    assert found == BEFORE_A_CYCLE


class Ring:
    """Refers to itself: garbage that a collection only finds."""

    def __init__(self) -> None:
        self.itself = self


@pytest.fixture
def thawed() -> Iterator[None]:
    yield
    gc.unfreeze()


def test_a_prepared_process_has_no_garbage_and_looks_through_nothing_old(thawed: None) -> None:
    gone, kept = Ring(), Ring()
    forgotten = weakref.ref(gone)
    del gone
    rti_mpcc.prepare_process()
    assert forgotten() is None
    assert gc.get_freeze_count() > 0
    assert not any(each is kept for each in gc.get_objects())
    assert gc.isenabled()


@pytest.mark.parametrize(
    "page",
    [
        *(ROOT / "examples").glob("*.py"),
        ROOT / "README.md",
        ROOT / "docs/using.md",
        ROOT / "docs/missions.md",
    ],
    ids=lambda page: page.name,
)
def test_loops_that_are_copied_prepare_their_process(page: Path) -> None:
    assert "prepare_process()" in page.read_text(encoding="utf-8")


def test_the_version_is_that_of_the_package(capsys: pytest.CaptureFixture[str]) -> None:
    assert rti_mpcc.__version__ == importlib.metadata.version("rti-mpcc")
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"rti-mpcc {rti_mpcc.__version__}\n"
