"""Scenario files: read and checked, changed, written back."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any

import tomlkit

from rti_mpcc.errors import ScenarioError
from rti_mpcc.simulation.scenario import Scenario
from rti_mpcc.simulation.sections.base import read_toml, validated

_LOG = logging.getLogger(__name__)
_BUILT_IN = files("rti_mpcc.simulation") / "scenarios"


def builtin_names() -> tuple[str, ...]:
    """Names of the scenarios that come with the package, sorted."""
    names = (Path(entry.name) for entry in _BUILT_IN.iterdir())
    return tuple(sorted(name.stem for name in names if name.suffix == ".toml"))


def load_scenario(name_or_file: str | Path) -> Scenario:
    """A built-in scenario by name, or a .toml file; logs warnings.

    Raises ScenarioError with one line a problem: `file: key = value: what is allowed`.
    """
    name, file = str(name_or_file), Path(name_or_file)
    if name in builtin_names():
        file = Path(str(_BUILT_IN / f"{name}.toml"))
        return _remarked(read_toml(Scenario, file, file.name), file.name)
    if file.suffix != ".toml":
        raise ScenarioError(f"{name}: must be a .toml file or one of {', '.join(builtin_names())}")
    return _remarked(read_toml(Scenario, file, name), name)


def scenario_from_dict(
    data: Mapping[str, Any], *, source: str = "scenario", folder: Path | None = None
) -> Scenario:
    """A scenario from the tables of a file as dicts and lists. Raises ScenarioError as `load_scenario`.

    `source` stands in front of error messages; a relative path.file or area.map lies in `folder`, by default
    in the working directory.
    """
    return _remarked(validated(Scenario, data, source=source, folder=folder), source)


def _remarked(scenario: Scenario, source: str) -> Scenario:
    for remark in scenario.remarks():
        _LOG.warning("%s: %s", source, remark)
    return scenario


def changed(scenario: Scenario, changes: Mapping[str, Any]) -> Scenario:
    """The scenario with other values, checked anew: changed(s, {"goal.offset": [1, 3, 0]}).

    A key is dotted as in the file (lists are replaced whole); the value None takes the key out.
    """
    data = scenario.model_dump(by_alias=True, exclude_unset=True)
    for key, value in changes.items():
        *tables, last = key.split(".")
        table = data
        for name in tables:
            table = table.setdefault(name, {})
        if value is None:
            table.pop(last, None)
        else:
            table[last] = value
    return scenario_from_dict(data, source=scenario.name)


def scenario_text(scenario: Scenario) -> str:
    """The scenario file (TOML): only what was set, so that defaults stay defaults. It is read back as equal.

    A path.file or area.map is written as an absolute path: the text may be put anywhere.
    """
    data = scenario.model_dump(by_alias=True, exclude_unset=True, exclude_none=True)
    for table, key in (("path", "file"), ("area", "map")):
        if key in data.get(table, {}):
            data[table][key] = str(Path(data[table][key]).absolute())
    return tomlkit.dumps(data)


def save_scenario(scenario: Scenario, folder: Path) -> Path:
    """Write FOLDER/<name>.toml, making the folder where it is missing, and return that file."""
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / f"{scenario.name}.toml"
    file.write_text(scenario_text(scenario), encoding="utf-8")
    return file
