"""The built wheel, installed outside the checkout, is complete: the snippet of the README runs from it."""

from __future__ import annotations

import shutil
import zipfile
from collections.abc import Sequence
from pathlib import Path

import pytest

from tests.processes import ROOT, printed

PACKAGES = ("geometry", "estimation", "rti_mpcc")


def run(arguments: Sequence[str | Path], directory: Path, search: Path | None = None) -> str:
    """Standard output of this interpreter run in `directory`, with only `search` as PYTHONPATH."""
    return printed(*map(str, arguments), folder=directory, path=str(search or ""))


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Built from a copy: a build leaves files in the tree, and left-over ones would get into the wheel."""
    tree = tmp_path_factory.mktemp("tree")
    for name in ("pyproject.toml", "LICENSE", "README.md"):
        if (ROOT / name).is_file():
            shutil.copy(ROOT / name, tree)
    for name in PACKAGES:
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, tree / name, ignore=shutil.ignore_patterns("__pycache__"))
    run(["-m", "build", "--wheel", "--no-isolation", "--outdir", tree / "dist"], tree)
    (built,) = (tree / "dist").glob("*.whl")
    return built


@pytest.fixture(scope="module")
def site(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    directory = tmp_path_factory.mktemp("installed") / "site"
    pip = ["-m", "pip", "--disable-pip-version-check", "install", "--quiet", "--no-deps", "--no-index"]
    run([*pip, "--target", directory, wheel], directory.parent)
    return directory


def test_wheel_holds_the_packages_their_data_and_nothing_else(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
    present = {name for name in PACKAGES if (ROOT / name / "__init__.py").is_file()}
    assert {name.partition("/")[0] for name in names if ".dist-info/" not in name} == present
    for package in present:
        expected = {
            file.relative_to(ROOT).as_posix()
            for file in (ROOT / package).rglob("*")
            if file.suffix in (".py", ".toml", ".yaml", ".pgm", ".csv", ".html", ".css")
            or file.name == "py.typed"
        }
        assert f"{package}/py.typed" in expected
        assert package != "rti_mpcc" or "rti_mpcc/report/templates/campaign.html" in expected
        assert expected <= names


@pytest.mark.acceptance
def test_console_script_finds_the_built_in_scenarios(site: Path, tmp_path: Path) -> None:
    listing = run([site / "bin" / "rti-mpcc", "scenarios"], tmp_path, search=site)
    assert {"docking_inside", "path_following", "docking_mission"} <= set(listing.split())
