"""The rows of a campaign as columns, read line by line: 10,000 of them take little memory."""

from __future__ import annotations

import json
from array import array
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from hashlib import blake2b
from math import hypot, nan
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from rti_mpcc.errors import InputError
from rti_mpcc.types import Array

SETTINGS, ROWS = "campaign.json", "rows.jsonl"
ASKED = ("count", "level", "seed", "method", "preset")
"""What settings have to tell."""
DOCKED = "docked"
OUTCOMES = ("worker_died", "raised", "failed", "stalled", "unfinished", DOCKED)
"""What may become of a case, the worst first."""
COURSE = (
    *("direction", "pieces", "cusps", "length_m", "curvature", "room_m", "narrowings", "obstacles"),
    *("goal_behind_m", "goal_beside_m", "goal_turned_rad"),
)
"""Columns from `course` of a row."""
DISTURBANCES = (
    *("position_std_m", "heading_std_rad", "dropout", "outlier", "delay_s"),
    *("wheelbase_error", "steering_offset_rad", "acceleration_gain", "dead_time_s"),
)
"""Columns from `disturbances` of a row; those of the lists in it are `OFFSETS` and `NOISES`."""
OFFSETS = ("initial_offset_m", "initial_turned_rad")
NOISES = ("noise_x_m", "noise_y_m", "noise_phi_rad", "noise_v_m_s", "noise_delta_rad")
FIGURES = {
    name: tuple(name.split("."))
    for name in (
        *("time_to_tolerance_s", "time_to_dock_s", "min_clearance_m", "direction_changes", "distance_m"),
        *("final_error.longitudinal_m", "final_error.lateral_m", "final_error.heading_rad"),
        *("energy_to_dock.acceleration", "energy_to_dock.steering_rate"),
        *("energy_to_dock.lateral_acceleration", "comfort.acceleration", "expected_time_s"),
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
        settings: what campaign.json says.
        index: (n,) of the cases.
        outcome: (n,) places in `OUTCOMES`.
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
        found: NDArray[np.bool_] = self.outcome == OUTCOMES.index(DOCKED)
        return found

    @property
    def crossed(self) -> NDArray[np.bool_]:
        """(n,) whether the body left the corridor or met an obstacle; False where that is not known."""
        found: NDArray[np.bool_] = self["min_clearance_m"] < 0.0
        return found

    def outcome_of(self, row: int) -> str:
        """What became of a case."""
        return OUTCOMES[self.outcome[row]]


def read_campaign(folder: Path) -> Campaign:
    """What is in the folder of a campaign. Raises InputError where there is none, or it has no whole row."""
    if not folder.is_dir():
        raise InputError(f"{folder}: there is no such folder")
    settings = _settings(folder / SETTINGS)
    reading = _Reading(folder / ROWS)
    for number, row in reading:
        reading.add(number, row)
    if not reading.rows:
        raise InputError(f"{folder / ROWS}: has no whole row, so there is nothing to report")
    return reading.campaign(folder.resolve().name, settings)


def _settings(file: Path) -> dict[str, Any]:
    try:
        settings = json.loads(file.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise InputError(f"{file}: there is no such file, so this is not the folder of a campaign") from None
    except ValueError as error:
        raise InputError(f"{file}: is not JSON ({error})") from None
    missing = [name for name in ASKED if not isinstance(settings, dict) or name not in settings]
    if missing:
        raise InputError(f"{file}: does not tell {', '.join(missing)} of the campaign")
    return dict(settings)


class _Reading:
    """Columns that grow with each row of a file."""

    def __init__(self, file: Path) -> None:
        self.file = file
        self.torn = False
        self.repeated = 0
        self.rows: dict[int, int] = {}  # index of the case to its row
        self.outcome, self.course, self.disturbed = array("q"), array("Q"), array("Q")
        self.columns = {name: array("d") for name in _NAMES}
        self.scenarios: list[str] = []
        self.details: dict[int, str] = {}
        self.statuses: Counter[str] = Counter()

    def __iter__(self) -> Iterator[tuple[int, dict[str, Any]]]:
        """The number of each line and its row. A last line that is not whole is left out."""
        try:
            stream = self.file.open(encoding="utf-8", errors="replace")
        except FileNotFoundError:
            raise InputError(f"{self.file}: there is no such file: nothing has been driven yet") from None
        with stream:
            for number, line in enumerate(stream, start=1):
                try:
                    row = json.loads(line)
                except ValueError:
                    if line.endswith("\n"):
                        raise InputError(f"{self.file}, line {number}: is not JSON") from None
                    self.torn = True
                    return
                yield number, row

    def add(self, number: int, row: Any) -> None:
        """Take a row in. Raises InputError where it is none."""
        try:
            index, outcome = int(row["index"]), OUTCOMES.index(row["outcome"])
            course, disturbances, figures = row["course"], row["disturbances"], row["figures"] or {}
            values = [*_course(course), *_disturbances(disturbances), *_figures(figures)]
            scenario, detail = str(row["scenario"]), str(row.get("detail") or "")
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

    def campaign(self, name: str, settings: dict[str, Any]) -> Campaign:
        """What was read, in the order of the cases."""
        index = np.array(list(self.rows), dtype=np.int64)
        order = np.argsort(index)
        index = index[order]
        return Campaign(
            name=name,
            settings=settings,
            index=_kept(index),
            outcome=_kept(np.frombuffer(self.outcome, dtype=np.int64)[order]),
            course=_kept(np.frombuffer(self.course, dtype=np.uint64)[order]),
            disturbed=_kept(np.frombuffer(self.disturbed, dtype=np.uint64)[order]),
            columns={key: _kept(np.frombuffer(values)[order]) for key, values in self.columns.items()},
            scenarios=tuple(self.scenarios[row] for row in order),
            details={row: self.details[at] for row, at in enumerate(index.tolist()) if at in self.details},
            statuses=dict(self.statuses.most_common()),
            torn=self.torn,
            repeated=self.repeated,
        )


def _course(course: dict[str, Any]) -> Iterable[float]:
    return (float(course[name]) for name in COURSE)


def _disturbances(disturbances: dict[str, Any]) -> Iterable[float]:
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


def _key(value: Any) -> int:
    """The same for equal values; of 10,000 different ones two are equal by chance in 3 of 10^12 campaigns."""
    text = json.dumps(value, sort_keys=True).encode()
    return int.from_bytes(blake2b(text, digest_size=8).digest(), "little")


def _kept(values: NDArray[Kind]) -> NDArray[Kind]:
    values.setflags(write=False)
    return values
