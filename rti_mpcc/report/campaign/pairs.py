"""Two campaigns case by case: which of them docks, and how times, clearance and energies compare."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rti_mpcc.errors import InputError
from rti_mpcc.report.campaign.columns import Campaign
from rti_mpcc.report.campaign.figures import ENERGIES, spread
from rti_mpcc.types import Array

RATIOS = {
    "time_to_dock_s": "time to dock",
    "time_to_tolerance_s": "time to tolerance",
    **{f"energy_to_dock.{name}": f"energy of {name.replace('_', ' ')}, to dock" for name in ENERGIES},
    "distance_m": "distance",
}
"""Columns whose ratios are told, with their names for people."""
QUARTILES = (25, 50, 75)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Pairs:
    """The k cases that two campaigns have in common.

    Attributes:
        names: of the first and the second.
        first, second: the campaigns; rows: (k, 2) of each case in them.
        differences: settings that differ, with both values.
        disturbed_differently: how many of the k are, in the two.
    """

    names: tuple[str, str]
    first: Campaign
    second: Campaign
    rows: NDArray[np.int64]
    differences: Mapping[str, tuple[Any, Any]]
    disturbed_differently: int

    @property
    def docked(self) -> NDArray[np.bool_]:
        """(k, 2)."""
        return np.stack([self.first.docked[self.rows[:, 0]], self.second.docked[self.rows[:, 1]]], axis=-1)

    def of(self, column: str) -> Array:
        """(k, 2) a column of both."""
        return np.stack([self.first[column][self.rows[:, 0]], self.second[column][self.rows[:, 1]]], axis=-1)

    def index(self, wanted: NDArray[np.bool_]) -> list[int]:
        """Of the wanted cases (k,)."""
        found: list[int] = self.first.index[self.rows[wanted, 0]].tolist()
        return found


def paired(first: Campaign, second: Campaign) -> Pairs:
    """Cases of the same index and course. Raises InputError where there are none, or the seeds differ."""
    seeds = [campaign.asked.seed for campaign in (first, second)]
    if seeds[0] != seeds[1]:
        raise InputError(
            f"{first.name} and {second.name}: seed = {seeds[0]} and {seeds[1]}: campaigns of different seeds "
            "have no case in common"
        )
    _, mine, others = np.intersect1d(first.index, second.index, assume_unique=True, return_indices=True)
    same = first.course[mine] == second.course[others]
    rows = np.stack([mine[same], others[same]], axis=-1).astype(np.int64)
    if not len(rows):
        why = "of the same index is on the same course" if len(mine) else "of one is in the other"
        raise InputError(f"{first.name} and {second.name}: have no case in common: none {why}")
    return Pairs(
        names=_names(first, second),
        first=first,
        second=second,
        rows=rows,
        differences=differences(first.settings, second.settings),
        disturbed_differently=int(
            np.count_nonzero(first.disturbed[rows[:, 0]] != second.disturbed[rows[:, 1]])
        ),
    )


def compared(pairs: Pairs) -> dict[str, Any]:
    """All figures of a comparison; ratios are first / second, on the cases that both dock."""
    docked = pairs.docked
    both = docked.all(axis=1)
    clearance = pairs.of("min_clearance_m")
    return {
        "first": pairs.names[0],
        "second": pairs.names[1],
        "settings_differ": {name: list(values) for name, values in pairs.differences.items()},
        "common": len(pairs.rows),
        "only_in_first": len(pairs.first) - len(pairs.rows),
        "only_in_second": len(pairs.second) - len(pairs.rows),
        "disturbed_differently": pairs.disturbed_differently,
        "docked": docked.sum(axis=0).tolist(),
        "docked_both": int(both.sum()),
        "docked_first_only": int((docked[:, 0] & ~docked[:, 1]).sum()),
        "docked_second_only": int((~docked[:, 0] & docked[:, 1]).sum()),
        "docked_none": int((~docked.any(axis=1)).sum()),
        "lost_by_first": pairs.index(~docked[:, 0] & docked[:, 1]),
        "lost_by_second": pairs.index(docked[:, 0] & ~docked[:, 1]),
        "lost_by_both": pairs.index(~(docked[:, 0] | docked[:, 1])),
        "collisions": np.count_nonzero(clearance < 0.0, axis=0).tolist(),
        "min_clearance_m": [_least(column) for column in clearance.T],
        "ratios": {name: spread(ratios(pairs, name)[both], QUARTILES, largest=False) for name in RATIOS},
        "clearance_difference_m": spread(clearance[both, 0] - clearance[both, 1], QUARTILES, largest=False),
        "first_faster": int(np.count_nonzero(ratios(pairs, "time_to_dock_s")[both] < 1.0)),
    }


def ratios(pairs: Pairs, column: str) -> Array:
    """(k,) first / second; NaN where one of the two has no figure, or the second is 0."""
    one, other = pairs.of(column).T
    found: Array = np.divide(one, other, out=np.full(len(one), np.nan), where=other != 0.0)
    return found


def differences(first: Mapping[str, Any], second: Mapping[str, Any]) -> dict[str, tuple[Any, Any]]:
    """Settings that differ, those within settings by their path; what one does not have is None."""
    mine, others = _flat(first), _flat(second)
    return {
        name: (mine.get(name), others.get(name))
        for name in dict.fromkeys([*mine, *others])
        if mine.get(name) != others.get(name)
    }


def _flat(settings: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    found: dict[str, Any] = {}
    for name, value in settings.items():
        if isinstance(value, Mapping):
            found |= _flat(value, f"{prefix}{name}.")
        else:
            found[f"{prefix}{name}"] = value
    return found


def _names(first: Campaign, second: Campaign) -> tuple[str, str]:
    """By what tells them apart: method, preset or level; where these are the same their folders."""
    told = [name for name in ("method", "preset", "level") if first.settings[name] != second.settings[name]]
    if not told and first.name != second.name:
        return first.name, second.name
    if not told:
        return f"{first.name}, the first", f"{second.name}, the second"
    one, other = (" ".join(campaign.settings[name] for name in told) for campaign in (first, second))
    return one, other


def _least(values: Array) -> float | None:
    finite = values[np.isfinite(values)]
    return float(finite.min()) if finite.size else None
