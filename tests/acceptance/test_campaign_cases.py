"""Campaign cases that were not docked once, or touched something: see docs/campaigns.md."""

from __future__ import annotations

from math import inf
from typing import Any

import pytest

from benchmarks.problems.case import CampaignCase
from benchmarks.problems.levels import Level
from rti_mpcc.simulation.campaign import CaseOutcome, drive_case

LOST = [44, 45, 48, 75, 77, 122, 128, 190, 675, 707, 851, 932, 965]
"""Of seed 1: out of reach onward, beside corners of a boundary, an obstacle to be passed on one side only."""
CASES = [
    *((1, Level.NOMINAL, index, inf) for index in LOST),
    (2311, Level.HARD, 345, inf),  # beside its goal, where each route back into it passes a wall
    (2311, Level.HARD, 236, inf),  # plans pass the corner of a narrowing between two stages
    (2777, Level.HARD, 49, inf),
    (2777, Level.HARD, 144, inf),
    (3001, Level.NOMINAL, 196, inf),  # a first guess faster than its passage allows
    (3001, Level.MISMATCHED, 196, inf),
    (3301, Level.NOMINAL, 15, 4.0),  # behind an obstacle two seconds were left for 5 m
    (52717, Level.NOMINAL, 490, 1.3),  # a cruise turned to an arrival that ended 5.4 m from the target
    (52717, Level.NOMINAL, 241, 1.1),  # a route was joined that had to be braked hard on
    (66140, Level.HARD, 58, 1.3),  # it braked in the one cycle that had no plan
]
"""Seed, level and index; the acceleration may be so many times comfort."""


@pytest.mark.parametrize(("seed", "level", "index", "over"), CASES)
def test_a_case_that_was_lost_docks(
    seed: int, level: Level, index: int, over: float, figures: dict[str, Any]
) -> None:
    row = drive_case(CampaignCase(seed=seed, level=level, index=index))
    assert row.outcome is CaseOutcome.DOCKED
    assert row.figures is not None
    figures["time_to_dock_s"] = row.figures["time_to_dock_s"]
    figures["min_clearance_m"] = row.figures["min_clearance_m"]
    assert row.figures["min_clearance_m"] > (0.03 if seed == 1 else 0.0)
    assert row.figures["peak"]["acceleration"] < over * row.figures["comfort"]["acceleration"]
