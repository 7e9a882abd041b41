"""What a campaign is asked for, and campaign.json, which keeps rows of different ones apart."""

from __future__ import annotations

import json
import os
import platform
from collections.abc import Iterator
from dataclasses import dataclass
from hashlib import sha256
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import geometry
from geometry.files import from_json, text
from rti_mpcc.config import ControllerConfig
from rti_mpcc.errors import InputError
from rti_mpcc.paper import METHODS
from rti_mpcc.simulation.campaign.case import MOST, CampaignCase, Problems
from rti_mpcc.simulation.campaign.levels import Level
from rti_mpcc.simulation.campaign.rows_file import FILE as ROWS
from rti_mpcc.simulation.scenario import PRESETS

FILE = "campaign.json"
LIBRARIES = ("rti-mpcc", "numpy", "scipy", "shapely", "osqp", "filterpy", "numba")
"""Those whose versions a row may depend on."""
_BEFORE = {"problems": Problems.COURSES.value, "deadline": None}
"""What files mean that were written before these were asked for."""
_PACKAGES = ("geometry", "estimation", "rti_mpcc")
_ONLY_SHOWS = ("rti_mpcc/cli", "rti_mpcc/report")


@dataclass(frozen=True, slots=True, kw_only=True)
class CampaignSettings:
    """Cases 0 ... count - 1 of a level and seed, driven by a method and preset.

    `deadline` is that of the controllers [s], or None.

    Raises InputError for a count that is not in 1 ... MOST, a negative seed, an unknown method or preset, or
    a deadline that a controller cannot have.
    """

    count: int
    level: Level
    seed: int
    method: str = "dynamic"
    preset: str = "default"
    problems: Problems = Problems.COURSES
    deadline: float | None = None

    def __post_init__(self) -> None:
        if not 1 <= self.count <= MOST:
            raise InputError(f"count = {self.count}: must be >= 1 and <= {MOST}")
        if self.method not in METHODS:
            raise InputError(f"method = {self.method!r}: must be one of {', '.join(METHODS)}")
        if self.preset not in PRESETS:
            raise InputError(f"preset = {self.preset!r}: must be one of {', '.join(PRESETS)}")
        ControllerConfig(deadline=self.deadline)
        self.case(0)

    def case(self, index: int) -> CampaignCase:
        """Case number `index`. Raises InputError for one that cannot be."""
        return CampaignCase(
            seed=self.seed,
            level=self.level,
            index=index,
            method=self.method,
            preset=self.preset,
            problems=self.problems,
            deadline=self.deadline,
        )

    def table(self) -> dict[str, Any]:
        """What campaign.json says."""
        return {
            "count": self.count,
            "level": self.level.value,
            "seed": self.seed,
            "method": self.method,
            "preset": self.preset,
            "problems": self.problems.value,
            "deadline": self.deadline,
            "versions": versions(),
        }


def versions() -> dict[str, str]:
    """Of all that a row may depend on; `source` is a digest of this program's own code."""
    found = {name: _version(name) for name in LIBRARIES}
    return {"python": platform.python_version(), **found, "source": source_digest()}


def source_digest() -> str:
    """Sixteen digits that change with any line of the packages, but for what only shows what was driven."""
    digest = sha256()
    root = Path(geometry.__file__).parents[1]
    shown = [root / folder for folder in _ONLY_SHOWS]
    for package in _PACKAGES:
        for file in sorted((root / package).rglob("*.py")):
            if any(folder in file.parents for folder in shown):
                continue
            digest.update(file.relative_to(root).as_posix().encode() + b"\0" + file.read_bytes() + b"\0")
    return digest.hexdigest()[:16]


def keep_settings(settings: CampaignSettings, folder: Path) -> None:
    """Write campaign.json; where there are rows compare with it first: only the count may have grown.

    Raises InputError, with one sentence, where rows of different campaigns would be mixed.
    """
    file, rows, table = folder / FILE, folder / ROWS, settings.table()
    if rows.exists() and rows.stat().st_size:
        before = read_settings(folder)
        if before == table:
            return
        told = "; ".join(_differences(before, table))
        if told:
            raise InputError(f"{folder} holds another campaign: {told}. Choose another folder")
    new = file.with_suffix(".new")
    new.write_text(json.dumps(table, indent=2) + "\n", encoding="utf-8")
    os.replace(new, file)  # whole or not at all


def read_settings(folder: Path) -> dict[str, Any]:
    """What campaign.json says. Raises InputError where it is missing or none."""
    file = folder / FILE
    try:
        table = from_json(text(file))
    except FileNotFoundError:
        raise InputError(f"{folder}: is no campaign, it has no {FILE}") from None
    except (ValueError, OSError) as error:
        raise InputError(f"{file}: cannot be read, {error}") from error
    if not isinstance(table, dict) or not isinstance(table.get("count"), int):
        raise InputError(f"{file}: is no campaign's")
    return {**_BEFORE, **table}


def _differences(before: dict[str, Any], now: dict[str, Any]) -> Iterator[str]:
    """What must not be another than it was, in words."""
    if now["count"] < before["count"]:
        yield f"count was {before['count']} and must not be less, {now['count']}"
    for key in ("problems", "level", "seed", "method", "preset", "deadline"):
        if now[key] != before.get(key):
            yield f"{key} was {before.get(key)}, not {now[key]}"
    known = before.get("versions")
    versions_before = known if isinstance(known, dict) else {}
    for key, value in now["versions"].items():
        if value != (was := versions_before.get(key)):
            yield "the program's own code was another" if key == "source" else f"{key} was {was}, not {value}"


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "not installed"
