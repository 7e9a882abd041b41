"""Drawn scenes without a path, and public parking cases, in full: planned, driven, docked, nothing touched.

Each scene is proven to have a way (`benchmarks.problems.scenes.proven`). What is lost is counted over all
parts of a level, by the last one of it.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from benchmarks.problems.case import CampaignCase, Problems
from benchmarks.problems.levels import Level
from rti_mpcc.simulation import load_scenario, simulate, summary
from rti_mpcc.simulation.campaign import CaseOutcome, drive_case
from tests.acceptance.test_campaigns import lost_of

PART = 25
PARTS = [(level, part) for level in (Level.NOMINAL, Level.NOISY) for part in range(20)]
MAY_BE_LOST = {Level.NOMINAL: 1, Level.NOISY: 2}
"""Of a part: 500 scenes have 1 % and 2 %, and a part may have bad luck."""
SEED = 60872
PARKING = sorted((Path(__file__).parents[3] / "shared" / "parking").glob("*.toml"))


def indices(part: int) -> range:
    return range(part * PART, (part + 1) * PART)


def scene(level: Level, index: int, deadline: float | None = None) -> CampaignCase:
    return CampaignCase(seed=SEED, level=level, index=index, problems=Problems.SCENES, deadline=deadline)


@pytest.mark.parametrize(("level", "part"), PARTS)
def test_scenes_dock_and_touch_nothing(level: Level, part: int, figures: dict[str, Any]) -> None:
    assert lost_of([scene(level, index) for index in indices(part)], figures) <= MAY_BE_LOST[level]


@pytest.mark.parametrize("part", range(4))
def test_with_a_deadline_no_command_is_late_because_of_planning(part: int, figures: dict[str, Any]) -> None:
    late, docked = 0, 0
    for index in indices(part):
        row = drive_case(scene(Level.NOMINAL, index, deadline=0.02))
        docked += row.outcome is CaseOutcome.DOCKED
        assert row.timed is not None
        late += int(row.timed["misses"].get("planning", 0))
    figures["late_while_planning"] = late
    assert docked >= PART - 1


@pytest.mark.skipif(not PARKING, reason="the public parking cases are not beside the repository (../shared)")
def test_nine_of_ten_public_parking_cases_are_docked(figures: dict[str, Any]) -> None:
    told = {file.stem: summary(simulate(load_scenario(str(file)))) for file in PARKING}
    figures["docked_s"] = {name: each["time_to_dock_s"] for name, each in told.items()}
    assert sum(each["docked"] for each in told.values()) >= 0.9 * len(PARKING)
    assert all(each["min_clearance_m"] >= 0.0 for each in told.values())
