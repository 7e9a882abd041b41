"""Fresh processes of this interpreter, with this checkout on their path."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]


def fresh(
    *arguments: str, folder: Path = ROOT, path: str = str(ROOT), **environment: str
) -> subprocess.CompletedProcess[str]:
    """What a fresh interpreter did with these arguments, run in a folder."""
    return subprocess.run(
        [sys.executable, *arguments],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": path} | environment,
        capture_output=True,
        text=True,
    )


def printed(*arguments: str, **options: Any) -> str:
    """What it prints, without an error."""
    done = fresh(*arguments, **options)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout.strip()
