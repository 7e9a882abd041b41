"""Campaigns of all levels, in parts: nothing is touched, no refused result is driven, hardly a case is lost.

`nominal` has all its 1,000 cases here, the others their first hundred.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import pytest

from benchmarks.problems.case import CampaignCase
from benchmarks.problems.levels import Level
from rti_mpcc.simulation.campaign import CaseOutcome, drive_case

PART = 50
PARTS = [
    *((Level.NOMINAL, part) for part in range(20)),
    *((level, part) for level in (Level.NOISY, Level.MISMATCHED, Level.HARD) for part in range(2)),
]
MAY_BE_LOST = 1
"""Of a part."""


def lost_of(cases: Sequence[CampaignCase], figures: dict[str, Any]) -> int:
    """How many of the cases do not dock; none touches anything."""
    rows = [drive_case(case) for case in cases]
    told = [row.figures for row in rows if row.figures is not None]
    figures["lost"] = [row.index for row in rows if row.outcome is not CaseOutcome.DOCKED]
    figures["min_clearance_m"] = min(each["min_clearance_m"] for each in told)
    figures["refused_results_driven"] = sum(each["failures_driven"] for each in told)
    assert len(told) == len(cases)
    assert figures["min_clearance_m"] > 0.0
    return len(figures["lost"])


@pytest.mark.parametrize(("level", "part"), PARTS)
def test_cases_dock_and_touch_nothing(level: Level, part: int, figures: dict[str, Any]) -> None:
    indices = range(part * PART, (part + 1) * PART)
    cases = [CampaignCase(seed=1, level=level, index=index) for index in indices]
    assert lost_of(cases, figures) <= MAY_BE_LOST
    assert figures["refused_results_driven"] == 0
