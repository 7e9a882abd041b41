"""A foreign `geometry` or `estimation` is refused by name before it does harm."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest

from rti_mpcc._shadow import check_packages
from tests.processes import ROOT, fresh

PACKAGES = ("geometry", "estimation")


def refused(*arguments: str, folder: Path, path: str) -> str:
    """The last line of an interpreter in a folder that runs these arguments, and fails."""
    done = fresh(*arguments, folder=folder, path=path)
    assert done.returncode == 1
    return done.stderr.strip().splitlines()[-1]


def test_the_own_packages_pass() -> None:
    check_packages()


def test_a_module_made_in_memory_is_refused(tmp_path: Path) -> None:
    made = "import sys, types; sys.modules['geometry'] = types.ModuleType('geometry'); import rti_mpcc"
    assert "<memory> shadows it" in refused("-c", made, folder=tmp_path, path=str(ROOT))


def test_a_missing_package_is_said_to_be_missing(tmp_path: Path) -> None:
    (tmp_path / "rti_mpcc").mkdir()
    for name in ("__init__.py", "_shadow.py"):
        shutil.copy(ROOT / "rti_mpcc" / name, tmp_path / "rti_mpcc")
    # Without site-packages (-S): an installed one would be found there.
    said = refused("-S", "-c", "import rti_mpcc", folder=tmp_path, path=str(tmp_path))
    assert "'geometry', which is missing from" in said


@pytest.mark.parametrize("package", PACKAGES)
@pytest.mark.parametrize("name", ["{}.py", "{}/__init__.py"])
def test_a_file_earlier_on_the_path_is_named_and_not_run(tmp_path: Path, package: str, name: str) -> None:
    file = tmp_path / name.format(package)
    file.parent.mkdir(exist_ok=True)
    file.write_text("raise AssertionError('run')", encoding="utf-8")
    path = os.pathsep.join([str(tmp_path), str(ROOT)])
    said = refused("-c", "import rti_mpcc", folder=tmp_path, path=path)
    assert said.startswith(f"ImportError: rti_mpcc needs its own package '{package}'")
    assert str(file) in said
