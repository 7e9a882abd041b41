"""A foreign `geometry` is refused by name before it does harm."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

from rti_mpcc._shadow import check_packages

ROOT = Path(__file__).parents[2]


def test_the_own_package_passes() -> None:
    check_packages()


def test_a_module_loaded_already_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    foreign = ModuleType("geometry")
    foreign.__file__ = str(tmp_path / "geometry.py")
    monkeypatch.setitem(sys.modules, "geometry", foreign)
    with pytest.raises(ImportError, match=r"geometry\.py shadows it") as caught:
        check_packages()
    assert caught.value.path == str(tmp_path / "geometry.py")


def test_a_module_without_a_file_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "geometry", ModuleType("geometry"))
    with pytest.raises(ImportError, match="<memory> shadows it"):
        check_packages()


@pytest.mark.parametrize("name", ["geometry.py", "geometry/__init__.py"])
def test_a_file_earlier_on_the_path_is_named_and_not_run(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, name: str
) -> None:
    file = tmp_path / name
    file.parent.mkdir(exist_ok=True)
    file.write_text("raise AssertionError('run')", encoding="utf-8")
    monkeypatch.delitem(sys.modules, "geometry", raising=False)
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(ImportError, match="shadows it") as caught:
        check_packages()
    assert caught.value.path == str(file)


def test_a_missing_package_is_said_to_be_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(sys.modules, "geometry", raising=False)
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(ImportError, match="which is missing from"):
        check_packages()


def test_importing_the_package_beside_a_foreign_file_names_it(tmp_path: Path) -> None:
    (tmp_path / "geometry.py").write_text("", encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-c", "import rti_mpcc"],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": os.pathsep.join([str(tmp_path), str(ROOT)])},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 1
    last = done.stderr.strip().splitlines()[-1]
    assert last.startswith("ImportError: rti_mpcc needs its own package 'geometry'")
    assert str(tmp_path / "geometry.py") in last
