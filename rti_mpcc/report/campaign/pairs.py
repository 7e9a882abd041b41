"""Two campaigns case by case: which of them docks, and how times, clearance and energies compare."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import pandas as pd

from rti_mpcc.errors import InputError
from rti_mpcc.report.campaign.figures import ENERGIES, known, spread
from rti_mpcc.report.campaign.rows import Campaign
from rti_mpcc.report.numbers import number

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
    """The cases that two campaigns have in common.

    Attributes:
        names: of the first and the second.
        first, second: their rows of these cases, line by line the same case.
        left: how many cases of each have no pair.
        differences: settings that differ, with both values; None for what one does not have.
    """

    names: tuple[str, str]
    first: pd.DataFrame
    second: pd.DataFrame
    left: tuple[int, int]
    differences: Mapping[str, tuple[Any, Any]]


def paired(first: Campaign, second: Campaign) -> Pairs:
    """Cases of the same index and course. Raises InputError where there are none, or the seeds differ."""
    seeds = [campaign.asked.seed for campaign in (first, second)]
    if seeds[0] != seeds[1]:
        raise InputError(
            f"{first.name} and {second.name}: seed = {seeds[0]} and {seeds[1]}: campaigns of different seeds "
            "have no case in common"
        )
    both = first.rows.index.intersection(second.rows.index)
    index = both[first.rows.loc[both, "course"] == second.rows.loc[both, "course"]]
    if index.empty:
        why = "of one is in the other" if both.empty else "of the same index is on the same course"
        raise InputError(f"{first.name} and {second.name}: have no case in common: none {why}")
    return Pairs(
        names=_names(first, second),
        first=first.rows.loc[index],
        second=second.rows.loc[index],
        left=(len(first.rows) - len(index), len(second.rows) - len(index)),
        differences=differences(first.settings, second.settings),
    )


def compared(pairs: Pairs) -> dict[str, Any]:
    """All figures of a comparison; ratios are first / second, on the cases that both dock."""
    one, other = pairs.first, pairs.second
    first, second = one["docked"], other["docked"]
    both, none = first & second, ~first & ~second
    # What is divided by zero has no ratio.
    ratios = {name: one[name][both] / other[name][both].where(other[name] != 0.0) for name in RATIOS}
    clearance = one["min_clearance_m"] - other["min_clearance_m"]
    return {
        "first": pairs.names[0],
        "second": pairs.names[1],
        "settings_differ": {name: list(values) for name, values in pairs.differences.items()},
        "common": len(one),
        "only_in_first": pairs.left[0],
        "only_in_second": pairs.left[1],
        "disturbed_differently": int((one["disturbances"] != other["disturbances"]).sum()),
        "docked": [int(first.sum()), int(second.sum())],
        "docked_both": int(both.sum()),
        "docked_first_only": int((first & ~second).sum()),
        "docked_second_only": int((second & ~first).sum()),
        "docked_none": int(none.sum()),
        "lost_by_first": one.index[second & ~first].tolist(),
        "lost_by_second": one.index[first & ~second].tolist(),
        "lost_by_both": one.index[none].tolist(),
        "collisions": [int(rows["crossed"].sum()) for rows in (one, other)],
        "min_clearance_m": [known(rows["min_clearance_m"].min()) for rows in (one, other)],
        "ratios": {name: spread(values, *QUARTILES, largest=False) for name, values in ratios.items()},
        "clearance_difference_m": spread(clearance[both], *QUARTILES, largest=False),
        "first_faster": int((ratios["time_to_dock_s"] < 1.0).sum()),
    }


def sentences(pairs: Pairs, told: dict[str, Any]) -> list[str]:
    """What the comparison comes to."""
    one, other = pairs.names
    said = [
        f"{told['common']} cases in common: {told['docked_both']} dock in both, "
        f"{told['docked_first_only']} in `{one}` only, {told['docked_second_only']} in `{other}` only, "
        f"{told['docked_none']} in neither."
    ]
    time = told["ratios"]["time_to_dock_s"]
    if time["p50"] is not None:
        said.append(
            f"On those that both dock `{one}` takes {number(time['p50'], 3)} times the time to dock of "
            f"`{other}` (median; quartiles {number(time['p25'], 3)} and {number(time['p75'], 3)}), and is "
            f"the faster one in {told['first_faster']} of {told['docked_both']}."
        )
    if any(pairs.left):
        said.append(
            f"Not compared: {pairs.left[0]} cases of `{one}` and {pairs.left[1]} of `{other}` have no pair."
        )
    if told["disturbed_differently"]:
        said.append(
            f"{told['disturbed_differently']} of the common cases are the same course disturbed differently."
        )
    differ = ", ".join(f"{name} ({mine} and {others})" for name, (mine, others) in pairs.differences.items())
    return [*said, f"Settings that differ: {differ}." if differ else "No settings differ."]


def differences(first: Mapping[str, Any], second: Mapping[str, Any]) -> dict[str, tuple[Any, Any]]:
    """Settings that differ, those within settings by their path; what one does not have is None."""
    mine, others = (pd.json_normalize(dict(one)).to_dict("records")[0] for one in (first, second))
    return {
        str(name): (mine.get(name), others.get(name))
        for name in dict.fromkeys([*mine, *others])
        if mine.get(name) != others.get(name)
    }


def _names(first: Campaign, second: Campaign) -> tuple[str, str]:
    """By what tells them apart: method, preset or level; where these are the same their folders."""
    told = [name for name in ("method", "preset", "level") if first.settings[name] != second.settings[name]]
    if not told and first.name != second.name:
        return first.name, second.name
    if not told:
        return f"{first.name}, the first", f"{second.name}, the second"
    one, other = (" ".join(campaign.settings[name] for name in told) for campaign in (first, second))
    return one, other
