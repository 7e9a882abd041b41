"""Why cases did not dock, or collided: grouped by what was told of them."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Sequence
from math import degrees
from typing import Any

import numpy as np

from rti_mpcc.report.campaign.columns import Campaign
from rti_mpcc.report.campaign.figures import spread
from rti_mpcc.report.content import Table
from rti_mpcc.report.numbers import number

COLLISION = "collision"
_NAMED = 12
"""So many cases of a group are named in the page; all of them are in the JSON file."""
_NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e-?\d+)?")


def losses(campaign: Campaign) -> list[dict[str, Any]]:
    """Groups of cases that ended alike, the largest first; those with a collision once more as the last.

    Each with outcome, what was told (its numbers left out), the index of each case, and how far from the goal
    they ended: p50 and max of the distance [m] and of the heading [rad].
    """
    groups: dict[tuple[str, str], list[int]] = defaultdict(list)
    for row in np.flatnonzero(~campaign.docked).tolist():
        told = _NUMBER.sub("#", campaign.details.get(row, ""))
        groups[campaign.outcome_of(row).value, told].append(row)
    found = [
        _group(campaign, outcome, told, rows)
        for (outcome, told), rows in sorted(groups.items(), key=lambda group: -len(group[1]))
    ]
    crossed = np.flatnonzero(campaign.crossed).tolist()
    return [*found, *([_group(campaign, COLLISION, "", crossed)] if crossed else [])]


def _group(campaign: Campaign, outcome: str, told: str, rows: Sequence[int]) -> dict[str, Any]:
    at = np.array(rows)
    off = np.hypot(campaign["final_error.longitudinal_m"][at], campaign["final_error.lateral_m"][at])
    return {
        "outcome": outcome,
        "told": told,
        "cases": len(rows),
        "index": campaign.index[at].tolist(),
        "off_m": spread(off, (50,)),
        "off_rad": spread(np.abs(campaign["final_error.heading_rad"][at]), (50,)),
    }


def losses_table(groups: Sequence[dict[str, Any]]) -> Table:
    """The groups, one a row."""
    return Table(
        caption="Cases that did not dock, by outcome and what was told of them (numbers in it as #), and "
        "those with a collision, docked or not. How far off: distance and heading to the goal at the end.",
        heads=("outcome", "what was told", "cases", "off p50 / most [m]", "[deg]", "which"),
        rows=[
            [
                group["outcome"].replace("_", " "),
                group["told"],
                str(group["cases"]),
                _two(group["off_m"], 1.0),
                _two(group["off_rad"], degrees(1.0)),
                _named(group["index"]),
            ]
            for group in groups
        ],
        worded=(1, 5),
        sentences=(1, 5),
    )


def _two(values: dict[str, float | None], factor: float) -> str:
    return " / ".join(
        number(None if values[key] is None else factor * (values[key] or 0.0), 2) for key in ("p50", "max")
    )


def _named(index: Sequence[int]) -> str:
    rest = len(index) - _NAMED
    return ", ".join(map(str, index[:_NAMED])) + (f" and {rest} more" if rest > 0 else "")
