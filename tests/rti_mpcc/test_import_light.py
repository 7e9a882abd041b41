"""`import rti_mpcc` stays light enough for a control loop: no drawing, no filter library."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
CODE = (
    "import sys, rti_mpcc; rti_mpcc.DockingController; print(*sorted({n.split('.')[0] for n in sys.modules}))"
)


@pytest.fixture(scope="module")
def loaded() -> set[str]:
    done = subprocess.run(
        [sys.executable, "-c", CODE],
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return set(done.stdout.split())


@pytest.mark.parametrize("library", ["matplotlib", "filterpy", "rich", "cv2"])
def test_import_does_not_load(loaded: set[str], library: str) -> None:
    assert library not in loaded
