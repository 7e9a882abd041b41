"""Campaign cases that were not docked once, or touched something: docs/campaigns.md tells what was mended."""

from __future__ import annotations

from collections.abc import MutableMapping
from typing import Any

import pytest

from benchmarks.problems.case import CampaignCase
from benchmarks.problems.levels import Level
from rti_mpcc.simulation.campaign import drive_case
from rti_mpcc.simulation.campaign_row import CaseOutcome

ONWARD_ONLY = [44, 45, 48, 75, 77, 128, 190]
"""Out of reach onward, or with a cusp beside a boundary of the next part."""
CORNERS = [122, 675, 707, 851, 932]
"""With a corner of a boundary close to one of the body at the goal."""
ON_THE_PATH = [965]
"""With an obstacle on the path that can be passed on one side only."""


def test_beside_a_wall_and_far_from_an_obstacle_nothing_fills_the_way() -> None:
    """Standing 0.15 m beside its goal, where each way back into it leads past a wall."""
    row = drive_case(CampaignCase(seed=2311, level=Level.HARD, index=345))
    assert row.outcome is CaseOutcome.DOCKED


@pytest.mark.parametrize(("seed", "index"), [(2311, 236), (2777, 49), (2777, 144)])
def test_with_noise_beside_a_corner_of_a_boundary_it_does_not_wait_for_ever(seed: int, index: int) -> None:
    """Its plans pass the corner of a narrowing by about the hard minimum, between two stages."""
    row = drive_case(CampaignCase(seed=seed, level=Level.HARD, index=index))
    assert row.outcome is CaseOutcome.DOCKED
    assert row.figures is not None
    assert row.figures["min_clearance_m"] > 0.0


@pytest.mark.parametrize("level", [Level.NOMINAL, Level.MISMATCHED])
def test_a_narrow_bend_on_the_way_is_known_to_the_first_guess(level: Level) -> None:
    """A first guess faster than its passage allows: no first QP was solved."""
    row = drive_case(CampaignCase(seed=3001, level=level, index=196))
    assert row.outcome is CaseOutcome.DOCKED


def test_an_arrival_that_was_slowed_on_its_way_does_not_catch_up_at_any_price() -> None:
    """Behind an obstacle two seconds were left for 5 m: it drove them at 4.4 m/s and 5 m/s²."""
    row = drive_case(CampaignCase(seed=3301, level=Level.NOMINAL, index=15))
    assert row.outcome is CaseOutcome.DOCKED
    assert row.figures is not None
    assert row.figures["peak"]["acceleration"] < 4.0 * row.figures["comfort"]["acceleration"]


def test_a_cruise_does_not_turn_to_an_arrival_that_ends_elsewhere() -> None:
    """Its first plan ended 5.4 m from the target, with 5 m/s²: 42 s, and 8 times the least energy."""
    row = drive_case(CampaignCase(seed=52717, level=Level.NOMINAL, index=490))
    assert row.outcome is CaseOutcome.DOCKED
    assert row.figures is not None
    assert row.figures["energy_ratio"] < 1.2
    assert row.figures["time_to_dock_s"] < 1.05 * row.figures["expected_time_s"]


def test_no_way_is_joined_that_would_have_to_be_braked_hard_on() -> None:
    """Its first stretch was 0.8 m long, at 0.9 m/s: 2.5 times the comfort acceleration."""
    row = drive_case(CampaignCase(seed=52717, level=Level.NOMINAL, index=241))
    assert row.outcome is CaseOutcome.DOCKED
    assert row.figures is not None
    assert row.figures["peak"]["acceleration"] < 1.1 * row.figures["comfort"]["acceleration"]


def test_a_way_is_joined_on_the_move_without_braking_though_a_first_plan_takes_a_cycle_more() -> None:
    """It braked with 1.6 m/s² in the one cycle that had no plan."""
    row = drive_case(CampaignCase(seed=66140, level=Level.HARD, index=58))
    assert row.outcome is CaseOutcome.DOCKED
    assert row.figures is not None
    assert row.figures["peak"]["acceleration"] < 1.3 * row.figures["comfort"]["acceleration"]


@pytest.mark.parametrize("index", [*ONWARD_ONLY, *CORNERS, *ON_THE_PATH])
def test_a_case_that_was_lost_docks(index: int, figures: MutableMapping[str, Any]) -> None:
    row = drive_case(CampaignCase(seed=1, level=Level.NOMINAL, index=index))
    assert row.figures is not None
    figures["time_to_dock_s"] = row.figures["time_to_dock_s"]
    figures["min_clearance_m"] = row.figures["min_clearance_m"]
    assert row.outcome is CaseOutcome.DOCKED
    # The hard minimum less what measurements may tremble by: 44 begins beside a corner.
    assert row.figures["min_clearance_m"] > 0.03
