"""A foreign `geometry` or `estimation` is refused by name before it does harm."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from types import ModuleType

import pytest

from rti_mpcc._shadow import check_packages
from tests.processes import ROOT, fresh

PACKAGES = ("geometry", "estimation")


def test_the_own_packages_pass() -> None:
    check_packages()


def test_a_module_made_in_memory_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "geometry", ModuleType("geometry"))
    with pytest.raises(ImportError, match="<memory> shadows it"):
        check_packages()


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
    assert str(file) in str(caught.value)


def test_a_missing_package_is_said_to_be_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rti_mpcc._shadow.find_spec", lambda name: None)
    with pytest.raises(ImportError, match="'geometry', which is missing from"):
        check_packages()


@pytest.mark.parametrize("package", PACKAGES)
def test_importing_the_package_beside_a_foreign_file_names_it(tmp_path: Path, package: str) -> None:
    (tmp_path / f"{package}.py").write_text("", encoding="utf-8")
    path = os.pathsep.join([str(tmp_path), str(ROOT)])
    done = fresh("-c", "import rti_mpcc", folder=tmp_path, path=path)
    assert done.returncode == 1
    last = done.stderr.strip().splitlines()[-1]
    assert last.startswith(f"ImportError: rti_mpcc needs its own package '{package}'")
    assert str(tmp_path / f"{package}.py") in last
