"""`import rti_mpcc` stays light enough for a control loop: no drawing, no filter library."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def packages_after(statements: str) -> set[str]:
    """What a fresh interpreter has loaded after these."""
    code = f"import sys; {statements}; print(*sorted({{name.split('.')[0] for name in sys.modules}}))"
    done = subprocess.run(
        [sys.executable, "-c", code],
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return set(done.stdout.split())


@pytest.fixture(scope="module")
def loaded() -> set[str]:
    return packages_after("import rti_mpcc; rti_mpcc.DockingController")


@pytest.mark.parametrize("library", ["matplotlib", "filterpy", "rich", "cv2", "pandas"])
def test_import_does_not_load(loaded: set[str], library: str) -> None:
    assert library not in loaded


def test_the_command_line_loads_what_only_some_commands_need_where_one_is_asked_for() -> None:
    heavy = {"distributed", "dask", "matplotlib", "pandas"}
    assert not heavy & packages_after("import rti_mpcc.cli")


def test_estimation_loads_filterpy_with_the_first_filter() -> None:
    assert "filterpy" not in packages_after("import estimation; estimation.GoalFilterConfig()")
    assert "filterpy" in packages_after("import estimation; estimation.GoalPoseFilter()")


@pytest.mark.acceptance
def test_estimation_loads_opencv_with_the_first_detector() -> None:
    assert "cv2" not in packages_after("import estimation; estimation.Camera(), estimation.CharucoBoard()")
    made = "estimation.CharucoGoalDetector(estimation.Camera(), estimation.CharucoBoard())"
    assert "cv2" in packages_after(f"import estimation; {made}")
