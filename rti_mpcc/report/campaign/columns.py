"""The rows of a campaign as columns, read line by line: 10,000 of them take little memory."""

from __future__ import annotations

import json
from array import array
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from hashlib import blake2b
from math import hypot, nan
from os import SEEK_END
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from rti_mpcc.errors import InputError
from rti_mpcc.simulation.campaign import (
    CampaignSettings,
    CaseOutcome,
    CourseFigures,
    DisturbanceFigures,
    Level,
    read_rows,
    read_settings,
)
from rti_mpcc.simulation.campaign.rows_file import FILE as ROWS
from rti_mpcc.simulation.campaign.settings import FILE as SETTINGS
from rti_mpcc.types import Array

SEVERITY = (
    CaseOutcome.WORKER_DIED,
    CaseOutcome.RAISED,
    CaseOutcome.FAILED,
    CaseOutcome.STALLED,
    CaseOutcome.UNFINISHED,
    CaseOutcome.UNCONFIRMED,
    CaseOutcome.DOCKED,
)
"""What may become of a case, the worst first."""
COURSE = tuple(field.name for field in fields(CourseFigures))
"""Columns from `course` of a row."""
LISTS = ("initial_offset", "state_noise")
"""What of `disturbances` is a list: `OFFSETS` and `NOISES` are columns from these."""
DISTURBANCES = tuple(field.name for field in fields(DisturbanceFigures) if field.name not in LISTS)
"""Columns from what else is in it."""
OFFSETS = ("initial_offset_m", "initial_turned_rad")
NOISES = ("noise_x_m", "noise_y_m", "noise_phi_rad", "noise_v_m_s", "noise_delta_rad")
FIGURES = {
    name: tuple(name.split("."))
    for name in (
        *("time_to_tolerance_s", "time_to_dock_s", "min_clearance_m", "direction_changes", "distance_m"),
        *("final_error.longitudinal_m", "final_error.lateral_m", "final_error.heading_rad"),
        *("energy_to_dock.acceleration", "energy_to_dock.steering_rate"),
        *("energy_to_dock.lateral_acceleration", "comfort.acceleration"),
        *("solver.failures", "failures_driven", "fallback_cycles"),
    )
}
"""Columns from `figures` of a row, by their path in it."""
Kind = TypeVar("Kind", bound=np.generic)
_NAMES = (*COURSE, *DISTURBANCES, *OFFSETS, *NOISES, *FIGURES)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Campaign:
    """A campaign as far as it is driven, its n rows in the order of their index. Arrays are read-only.

    Attributes:
        name: of its folder.
        settings: what campaign.json says; asked: the same, checked, without the versions.
        index: (n,) of the cases.
        outcome: (n,) places in `SEVERITY`.
        course, disturbed: (n,) keys of what a course is and of what disturbs it, equal where these are.
        columns: (n,) each, by name; NaN where a row has no such figure.
        scenarios: names of the scenarios.
        details: by row, what is told of those that have something told of them.
        statuses: how many cycles of all cases had which status.
        torn: the last line is not whole, and left out; repeated: lines left out because their case was
            there already.
    """

    name: str
    settings: dict[str, Any]
    asked: CampaignSettings
    index: NDArray[np.int64]
    outcome: NDArray[np.int64]
    course: NDArray[np.uint64]
    disturbed: NDArray[np.uint64]
    columns: Mapping[str, Array]
    scenarios: tuple[str, ...]
    details: Mapping[int, str]
    statuses: Mapping[str, int]
    torn: bool
    repeated: int

    def __getitem__(self, name: str) -> Array:
        """A column."""
        return self.columns[name]

    def __len__(self) -> int:
        """How many rows there are."""
        return len(self.index)

    @property
    def docked(self) -> NDArray[np.bool_]:
        """(n,)."""
        found: NDArray[np.bool_] = self.outcome == SEVERITY.index(CaseOutcome.DOCKED)
        return found

    @property
    def crossed(self) -> NDArray[np.bool_]:
        """(n,) whether the body left the corridor or met an obstacle; False where that is not known."""
        found: NDArray[np.bool_] = self["min_clearance_m"] < 0.0
        return found

    def outcome_of(self, row: int) -> CaseOutcome:
        """What became of a case."""
        return SEVERITY[self.outcome[row]]


def read_campaign(folder: Path) -> Campaign:
    """What is in the folder of a campaign. Raises InputError where there is none, or it has no whole row."""
    settings = read_settings(folder)
    asked = _asked(settings, folder / SETTINGS)
    reading = _Reading(folder / ROWS)
    for number, row in enumerate(read_rows(folder), start=1):
        reading.add(number, row)
    if not reading.rows:
        raise InputError(f"{folder / ROWS}: has no whole row, so there is nothing to report yet")
    return reading.campaign(folder.resolve().name, settings, asked, torn=_torn(folder / ROWS))


def _asked(settings: Mapping[str, Any], file: Path) -> CampaignSettings:
    try:
        return CampaignSettings(
            count=settings["count"],
            level=Level(settings["level"]),
            seed=settings["seed"],
            method=settings["method"],
            preset=settings["preset"],
        )
    except (KeyError, TypeError, ValueError) as error:
        told = f"does not tell {error}" if isinstance(error, KeyError) else str(error)
        raise InputError(f"{file}: {told}") from None


def _torn(file: Path) -> bool:
    """Whether the last line has no end."""
    with file.open("rb") as stream:
        stream.seek(-1, SEEK_END)
        return stream.read() != b"\n"


def in_words(outcome: CaseOutcome) -> str:
    """An outcome for people."""
    return outcome.value.replace("_", " ")


class _Reading:
    """Columns that grow with each row of a file."""

    def __init__(self, file: Path) -> None:
        self.file = file
        self.repeated = 0
        self.rows: dict[int, int] = {}  # index of the case to its row
        self.outcome, self.course, self.disturbed = array("q"), array("Q"), array("Q")
        self.columns = {name: array("d") for name in _NAMES}
        self.scenarios: list[str] = []
        self.details: dict[int, str] = {}
        self.statuses: Counter[str] = Counter()

    def add(self, number: int, row: Any) -> None:
        """Take a row in. Raises InputError where it is none."""
        try:
            index, outcome = int(row["index"]), SEVERITY.index(CaseOutcome(row["outcome"]))
            course, disturbances, figures = row["course"], row["disturbances"], row["figures"] or {}
            values = [*_course(course), *_disturbances(disturbances), *_figures(figures)]
            scenario, detail = str(row["scenario"]), _plain(str(row.get("detail") or ""))
            statuses = {str(name): int(count) for name, count in figures.get("cycles_by_status", {}).items()}
        except (KeyError, TypeError, ValueError, AttributeError, IndexError) as error:
            raise InputError(
                f"{self.file}, line {number}: is not the row of a case ({type(error).__name__}: {error})"
            ) from None
        if index in self.rows:
            self.repeated += 1
            return
        if detail:
            self.details[index] = detail
        self.rows[index] = len(self.scenarios)
        self.scenarios.append(scenario)
        self.outcome.append(outcome)
        self.course.append(_key(course))
        self.disturbed.append(_key(disturbances))
        for name, value in zip(_NAMES, values, strict=True):
            self.columns[name].append(value)
        self.statuses.update(statuses)

    def campaign(
        self, name: str, settings: dict[str, Any], asked: CampaignSettings, *, torn: bool
    ) -> Campaign:
        """What was read, in the order of the cases."""
        index = np.array(list(self.rows), dtype=np.int64)
        order = np.argsort(index)
        index = index[order]
        return Campaign(
            name=name,
            settings=settings,
            asked=asked,
            index=_kept(index),
            outcome=_kept(np.frombuffer(self.outcome, dtype=np.int64)[order]),
            course=_kept(np.frombuffer(self.course, dtype=np.uint64)[order]),
            disturbed=_kept(np.frombuffer(self.disturbed, dtype=np.uint64)[order]),
            columns={key: _kept(np.frombuffer(values)[order]) for key, values in self.columns.items()},
            scenarios=tuple(self.scenarios[row] for row in order),
            details={row: self.details[at] for row, at in enumerate(index.tolist()) if at in self.details},
            statuses=dict(self.statuses.most_common()),
            torn=torn,
            repeated=self.repeated,
        )


def _course(course: dict[str, Any] | None) -> Iterable[float]:
    """NaN for a course that could not be drawn; the same below for what disturbs it."""
    if course is None:
        return (nan for _ in COURSE)
    return (float(course[name]) for name in COURSE)


def _disturbances(disturbances: dict[str, Any] | None) -> Iterable[float]:
    if disturbances is None:
        return (nan for _ in (*DISTURBANCES, *OFFSETS, *NOISES))
    x, y, phi = (float(value) for value in disturbances["initial_offset"])
    noises = [float(value) for value in disturbances["state_noise"]]
    if len(noises) != len(NOISES):
        raise ValueError(f"state_noise has {len(noises)} values, not {len(NOISES)}")
    return (*(float(disturbances[name]) for name in DISTURBANCES), hypot(x, y), abs(phi), *noises)


def _figures(figures: dict[str, Any]) -> Iterable[float]:
    """NaN for what is null or not there."""
    for path in FIGURES.values():
        value: Any = figures
        for name in path:
            value = value.get(name) if value is not None else None
        yield nan if value is None else float(value)


def _plain(text: str) -> str:
    """On one line; a backtick would begin code in a page."""
    return " ".join(text.replace("`", "'").split())


def _key(value: Any) -> int:
    """The same for equal values; of 10,000 different ones two are equal by chance in 3 of 10^12 campaigns."""
    text = json.dumps(value, sort_keys=True).encode()
    return int.from_bytes(blake2b(text, digest_size=8).digest(), "little")


def _kept(values: NDArray[Kind]) -> NDArray[Kind]:
    values.setflags(write=False)
    return values
