"""From a Scenario back to a scenario file."""

from __future__ import annotations

from pathlib import Path

import tomlkit

from rti_mpcc.simulation.scenario import Scenario


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
