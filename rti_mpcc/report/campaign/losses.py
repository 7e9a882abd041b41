"""Why cases did not dock, or collided: grouped by what was told of them."""

from __future__ import annotations

from typing import Any

import pandas as pd

from rti_mpcc.report.campaign.figures import spread
from rti_mpcc.report.campaign.rows import Campaign

COLLISION = "collision"
_NUMBER = r"-?\d+(?:\.\d+)?(?:e-?\d+)?"


def losses(campaign: Campaign) -> list[dict[str, Any]]:
    """Groups of cases that ended alike, the largest first; those with a collision once more as the last.

    Each with outcome, what was told (its numbers left out), the index of each case, and how far from the goal
    they ended: p50 and max of the distance [m] and of the heading [rad].
    """
    rows = campaign.rows
    lost = rows[~rows["docked"]]
    told = lost["detail"].str.replace(_NUMBER, "#", regex=True)
    groups = [
        _group(str(outcome), str(words), group)
        for (outcome, words), group in lost.groupby([lost["outcome"], told], observed=True, sort=False)
    ]
    groups.sort(key=lambda group: -group["cases"])
    crossed = rows[rows["crossed"]]
    return groups if crossed.empty else [*groups, _group(COLLISION, "", crossed)]


def _group(outcome: str, told: str, rows: pd.DataFrame) -> dict[str, Any]:
    off = (rows["final_error.longitudinal_m"] ** 2 + rows["final_error.lateral_m"] ** 2) ** 0.5
    return {
        "outcome": outcome,
        "told": told,
        "cases": len(rows),
        "index": rows.index.tolist(),
        "off_m": spread(off, 50),
        "off_rad": spread(rows["final_error.heading_rad"].abs(), 50),
    }
