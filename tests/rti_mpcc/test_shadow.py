"""A foreign `geometry` or `estimation` is refused by name before it does harm."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

from rti_mpcc._shadow import check_packages

ROOT = Path(__file__).parents[2]
PACKAGES = ("geometry", "estimation")


def test_the_own_packages_pass() -> None:
    check_packages()


@pytest.mark.parametrize("package", PACKAGES)
def test_a_module_loaded_already_is_named(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, package: str
) -> None:
    foreign = ModuleType(package)
    foreign.__file__ = str(tmp_path / f"{package}.py")
    monkeypatch.setitem(sys.modules, package, foreign)
    with pytest.raises(ImportError, match=rf"{package}\.py shadows it") as caught:
        check_packages()
    assert caught.value.name == package
    assert caught.value.path == str(tmp_path / f"{package}.py")


@pytest.mark.parametrize("package", PACKAGES)
@pytest.mark.parametrize("name", ["{}.py", "{}/__init__.py"])
def test_a_file_earlier_on_the_path_is_named_and_not_run(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, package: str, name: str
) -> None:
    file = tmp_path / name.format(package)
    file.parent.mkdir(exist_ok=True)
    file.write_text("raise AssertionError('run')", encoding="utf-8")
    monkeypatch.delitem(sys.modules, package, raising=False)
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(ImportError, match="shadows it") as caught:
        check_packages()
    assert caught.value.path == str(file)


@pytest.mark.parametrize("package", PACKAGES)
def test_importing_the_package_beside_a_foreign_file_names_it(tmp_path: Path, package: str) -> None:
    (tmp_path / f"{package}.py").write_text("", encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-c", "import rti_mpcc"],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": os.pathsep.join([str(tmp_path), str(ROOT)])},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 1
    last = done.stderr.strip().splitlines()[-1]
    assert last.startswith(f"ImportError: rti_mpcc needs its own package '{package}'")
    assert str(tmp_path / f"{package}.py") in last
