"""Random docks by cameras with faults, own plant and check: `python -m benchmarks.foreign_goals`."""

from __future__ import annotations

from functools import cache

import pytest

from benchmarks.foreign_goals import MOTIONS, PLACES, Outcome, Place, case_of, judged, ride
from rti_mpcc import Status

SEEDS = range(47_000, 47_010)
IN_TIME = ("flips 10 %", "flips 30 %", "flips 50 %", "flips 30 % about a marker 2.6 m behind")
BURSTS = ("bursts", "bursts from 1.5 s on", "bursts of 0.2 m")
NEVER = ("flips 100 %", "stamps in ms", "stamps 2 s old")
LATENCY = 1.5
"""So long [s] a vehicle may still be said to be docked at a dock that has started to move: detections have to
agree for a second, and the dock has to leave the tolerance."""


@cache
def clean(place: Place, seed: int) -> float:
    """When the vehicle docks without any fault [s]."""
    case = case_of("clean", place, seed)
    outcome = judged(case, ride(case))
    assert outcome.docked_at is not None
    assert_right(outcome)
    return outcome.docked_at


def assert_right(outcome: Outcome) -> None:
    assert outcome.wrong == 0.0
    assert not outcome.touched


@pytest.mark.parametrize("fault", [*IN_TIME, *BURSTS])
@pytest.mark.parametrize("place", PLACES)
def test_it_docks_where_the_dock_is_in_time(place: Place, fault: str) -> None:
    for seed in SEEDS:
        case = case_of(fault, place, seed)
        outcome = judged(case, ride(case))
        assert_right(outcome)
        assert outcome.docked_at is not None, (seed, outcome)
        assert outcome.docked_at <= 1.15 * clean(place, seed), (seed, outcome)


@pytest.mark.parametrize("fault", NEVER)
@pytest.mark.parametrize("place", PLACES)
def test_it_stands_and_says_why_where_no_detection_can_be_right(place: Place, fault: str) -> None:
    said = {"flips 100 %": "turned by", "stamps in ms": "in milliseconds?", "stamps 2 s old": "older than"}
    for seed in SEEDS[:5]:
        case = case_of(fault, place, seed)
        done = ride(case)
        outcome = judged(case, done)
        assert_right(outcome)
        assert outcome.docked_at is None
        assert outcome.stands
        assert any(said[fault] in each.diagnostics.reason for each in done.commands)


@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("place", PLACES)
def test_a_dock_that_moves_is_docked_at_where_it_stands(place: Place, motion: str) -> None:
    for seed in SEEDS[:5]:
        case = case_of(motion, place, seed)
        done = ride(case)
        outcome = judged(case, done)
        assert not outcome.touched
        if place == "mission":  # once it is over, detections no longer reach the controller
            assert outcome.docked_at is not None
            continue
        assert outcome.wrong <= LATENCY, (seed, outcome)
        assert done.commands[-1].status is Status.DOCKED, (seed, outcome)
