"""From a Scenario back to a scenario file."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rti_mpcc.simulation.scenario import Scenario


def scenario_text(scenario: Scenario) -> str:
    """The scenario file (TOML): only what was set, so that defaults stay defaults. It is read back as equal.

    A path.file is written as an absolute path: the text may be put anywhere.
    """
    data = scenario.model_dump(by_alias=True, exclude_unset=True)
    if scenario.path.file is not None:
        data["path"]["file"] = str(Path(scenario.path.file).absolute())
    return "\n".join(_table("", data)).lstrip("\n") + "\n"


def save_scenario(scenario: Scenario, folder: Path) -> Path:
    """Write FOLDER/<name>.toml, making the folder where it is missing, and return that file."""
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / f"{scenario.name}.toml"
    file.write_text(scenario_text(scenario), encoding="utf-8")
    return file


def _table(name: str, data: Mapping[str, Any]) -> list[str]:
    """Lines of a table: its values first, then the tables in it."""
    inner = {key: value for key, value in data.items() if isinstance(value, Mapping)}
    values = {key: value for key, value in data.items() if key not in inner and value is not None}
    lines = ["", f"[{name}]"] if name and (values or not inner) else []
    lines += [f"{key} = {_list(value)}" for key, value in values.items()]
    for key, value in inner.items():
        lines += _table(f"{name}.{key}" if name else key, value)
    return lines


def _list(value: Any) -> str:
    """A value; lists of tables and of polygons with a line for each."""
    if isinstance(value, (list, tuple)) and any(isinstance(item, (Mapping, list, tuple)) for item in value):
        return "[\n" + "".join(f"  {_value(item)},\n" for item in value) + "]"
    return _value(value)


def _value(value: Any) -> str:
    """A value on one line; Python's shortest form of a float is read back as the same float."""
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{k} = {_value(v)}" for k, v in value.items() if v is not None) + " }"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(_value, value)) + "]"
    if isinstance(value, bool):
        return "true" if value else "false"
    # JSON's escapes are TOML's but for one character.
    return (
        json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
        if isinstance(value, str)
        else repr(value)
    )
