"""Every way of getting a scenario or a file of docks wrong: a line of TOML, and the line that refuses it."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import pytest
import tomlkit

from rti_mpcc.errors import ScenarioError
from rti_mpcc.simulation import load_docks, scenario_from_dict
from tests.rti_mpcc.dock_files import FIRST, SECOND, written
from tests.rti_mpcc.simulation.conftest import area_tables, camera_tables, straight_tables, write_yard

CASES = (Path(__file__).parent / "wrong_files.txt").read_text(encoding="utf-8")


def wrong(title: str) -> list[Any]:
    """Line and answer of the cases under a title."""
    lines = CASES.partition(f"\n## {title}\n")[2].partition("\n\n")[0].splitlines()
    return [pytest.param(*line.split(" -> "), id=line[:60]) for line in lines]


def written_over(tables: dict[str, Any], line: str) -> dict[str, Any]:
    """The tables with one key as in a line of TOML, or taken out."""
    key, _, value = line.removeprefix("no ").partition(" = ")
    *names, last = key.split(".")
    table: Any = tables
    for name in names:
        table = table[int(name)] if name.isdigit() else table.setdefault(name, {})
    if line.startswith("no "):
        del table[last]
    else:
        table[last] = tomllib.loads(f"value = {value}")["value"]
    return tables


def refused(tables: dict[str, Any], line: str, folder: Path | None = None) -> list[str]:
    """The lines on a scenario with a line of TOML written over it."""
    with pytest.raises(ScenarioError) as caught:
        scenario_from_dict(written_over(tables, line), source="bad.toml", folder=folder)
    lines = str(caught.value).splitlines()
    assert all(each.startswith("bad.toml: ") for each in lines)
    return lines


@pytest.mark.parametrize(("line", "said"), wrong("on a path"))
def test_on_a_path(line: str, said: str) -> None:
    lines = refused(straight_tables(), line)
    assert said in lines[0]
    # Nothing else is wrong, save what follows from it in a pair of keys or the entries of a list.
    assert len(lines) <= 2


@pytest.mark.parametrize(("line", "said"), wrong("in an area"))
def test_in_an_area(line: str, said: str) -> None:
    lines = refused(area_tables(), line)
    assert said in "\n".join(lines)
    assert len(lines) <= 2


@pytest.mark.parametrize(("line", "said"), wrong("with a camera"))
def test_with_a_camera(line: str, said: str) -> None:
    (answer,) = refused(camera_tables(), line)
    assert said in answer


@pytest.mark.parametrize(("line", "said"), wrong("docks"))
def test_of_docks(tmp_path: Path, line: str, said: str) -> None:
    file = written(tmp_path, tomlkit.dumps(written_over(tomllib.loads(FIRST), line)))
    with pytest.raises(ScenarioError) as caught:
        load_docks(file)
    answer = str(caught.value)
    assert answer.startswith(f"{file}: ")
    assert said in answer
    assert "\n" not in answer


def test_each_mistake_in_docks_has_a_line(tmp_path: Path) -> None:
    text = FIRST.replace("2.0, direction = -1", "0.0, direction = 2") + SECOND.replace("20", "nan")
    with pytest.raises(ScenarioError) as caught:
        load_docks(written(tmp_path, text))
    keys = [line.partition(": ")[2].partition(" = ")[0] for line in str(caught.value).splitlines()]
    assert keys == ["dock[0].approach.length", "dock[0].approach.direction", "dock[1].pose[0]"]


@pytest.mark.parametrize("key", ["approach = {length = 2.0, direction = -1}", "tolerance = [0.1, 0.1, 0.1]"])
def test_along_a_path_the_dock_has_no_approach(key: str) -> None:
    (line,) = refused(straight_tables(), f'mission = [{{kind = "dock", {key}}}]')
    assert line.endswith(": only of a dock with a pose, to which a route is planned")


def test_each_problem_has_a_line() -> None:
    tables = straight_tables() | {"goal": {"tolerance": [0.05, -1.0, 0.03]}}
    assert refused(tables, "simulation.cycle = 9.0") == [
        "bad.toml: goal.tolerance[1] = -1.0: must be > 0",
        "bad.toml: simulation.cycle = 9.0: must be <= 0.2",
    ]


def test_bad_path_files_are_named(tmp_path: Path) -> None:
    assert "path.file = " in refused(straight_tables(), 'path = {file = "way.csv"}', tmp_path)[0]
    (tmp_path / "way.csv").write_text("x,y,heading,direction\n0,0,0,1\n2,zero,0,1\n")
    tables = straight_tables()
    del tables["path"]
    assert "way.csv" in refused(tables, 'path.file = "way.csv"', tmp_path)[0]


@pytest.mark.parametrize(
    ("file", "old", "new", "said"),
    [
        ("yard.yaml", "", None, "yard.yaml: cannot be read"),
        ("yard.pgm", "", None, "yard.pgm cannot be read"),
        ("yard.pgm", "", "P5", "yard.pgm"),
        ("yard.yaml", "1.0", "x", "resolution = 'x': must be"),
    ],
)
def test_bad_maps_are_named(tmp_path: Path, file: str, old: str, new: str | None, said: str) -> None:
    write_yard(tmp_path)
    if new is None:
        (tmp_path / file).unlink()
    else:
        (tmp_path / file).write_text((tmp_path / file).read_text().replace(old, new) if old else new)
    tables = area_tables()
    del tables["area"]
    (line,) = refused(tables, 'area.map = "yard.yaml"', tmp_path)
    assert line.startswith("bad.toml: area.map = '")
    assert said in line
