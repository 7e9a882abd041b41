"""Starts nearer to something than the hard minimum: the vehicle leaves as it came to stand there."""

from __future__ import annotations

from itertools import product
from math import pi
from typing import Any

import numpy as np
import pytest

from geometry import Area, Pose2
from rti_mpcc import Clearance, ControllerConfig, DockingController, Status, Vehicle, plan_manoeuvre
from rti_mpcc.manoeuvre import Manoeuvre, PlanOutcome
from rti_mpcc.model.footprint import body_of
from tests.lists import in_fast_suite, some_of
from tests.rti_mpcc.yards import BRISK, START, YARD, Driver, block

VEHICLE = Vehicle()
SIDE = 0.5 * VEHICLE.width
ASIDE = Pose2(14.0, 2.0, 0.0)
HARD = BRISK.clearance.least


def before(gap: float) -> Any:
    """A wall ahead."""
    return block(VEHICLE.front + gap, -3.0, VEHICLE.front + gap + 0.5, 3.0)


def behind(gap: float) -> Any:
    return block(-VEHICLE.rear - gap - 0.5, -3.0, -VEHICLE.rear - gap, 3.0)


def beside(gap: float) -> Any:
    """A box to the left, as long as the body."""
    return block(-1.0, SIDE + gap, 3.0, SIDE + gap + 1.0)


def along(gap: float) -> Any:
    """A wall to the right, as long as the yard."""
    return [(-8.0, -SIDE - gap), (20.0, -SIDE - gap)]


PLACES = {"before": before, "behind": behind, "beside": beside, "along": along}


def clearances(manoeuvre: Manoeuvre, area: Area, spacing: float = 0.005) -> Any:
    """Of the body along a manoeuvre [m]."""
    at = manoeuvre.path.sample(spacing)
    poses = np.concatenate([np.column_stack([part.x, part.y, part.phi]) for part in at])
    return area.signed_distances(body_of(VEHICLE), poses)


@pytest.mark.parametrize("gap", [0.01, 0.03, 0.049])
@pytest.mark.parametrize("place", PLACES)
def test_a_route_leads_away_and_never_nearer(place: str, gap: float) -> None:
    area = YARD.with_obstacles([PLACES[place](gap)])
    found = plan_manoeuvre(START, ASIDE, area)
    assert found.found, found.reason
    apart = clearances(found, area)
    assert apart.min() >= gap - 0.0011
    assert found.clearance == pytest.approx(apart.min(), abs=1e-4)
    # Once it has left it keeps the hard minimum.
    left = int(np.argmax(apart >= HARD))
    assert apart[left:].min() >= HARD - 1e-3


FAST = [("before", "step"), ("behind", "area"), ("beside", "step"), ("along", "area")]


@pytest.mark.parametrize("gap", some_of([0.01, 0.03]))
@pytest.mark.parametrize(("place", "given"), in_fast_suite(FAST, product(PLACES, ("area", "step"))))
def test_it_drives_off_and_docks(place: str, given: str, gap: float) -> None:
    thing = np.array(PLACES[place](gap))
    area = YARD.with_obstacles([thing]) if given == "area" else YARD
    driver = Driver(
        area=YARD.with_obstacles([thing]),
        controller=DockingController.in_area(area, BRISK),
        goal_at=lambda now: ASIDE,
        obstacles_at=None if given == "area" else lambda now: [thing],
    )
    drive = driver.drive(60.0)
    assert drive.docked, drive.reasons[-1]
    assert drive.clearance.min() >= gap - 0.005


def test_between_two_walls_there_is_no_leaving() -> None:
    area = YARD.with_obstacles([before(0.03), behind(0.03)])
    found = plan_manoeuvre(START, ASIDE, area)
    assert found.outcome is PlanOutcome.START_IN_COLLISION
    assert "a clearance of 0.030 m, at least 0.05 m is required, and no arc leads away" in found.reason


# -- one setting says how near the body may come: to planner, plans, the last check and the goal test --------

GAP, DEPTH = 0.03, 2.0
"""Of a bay on either side of the body, and its depth [m]."""
HALF = SIDE + GAP
BAY = Area(
    boundary=block(-25.0, -12.0, 10.0, 12.0),
    obstacles=[block(0.0, HALF, DEPTH, HALF + 3.0), block(0.0, -HALF - 3.0, DEPTH, -HALF)],
)


@pytest.mark.parametrize(("clearance", "docks"), [({"least": GAP}, True), ({}, False)])
def test_who_allows_three_centimetres_docks_with_three_at_either_side(
    clearance: dict[str, float], docks: bool
) -> None:
    config = ControllerConfig(clearance=Clearance(**clearance))
    goal = Pose2(DEPTH - config.vehicle.rear, 0.0, pi)
    driver = Driver(
        area=BAY,
        config=config,
        controller=DockingController.in_area(BAY, config),
        start=Pose2(-14.0, 3.0, pi),
        goal_at=lambda now: goal,
    )
    drive = driver.drive(60.0 if docks else 3.0)
    assert drive.docked == docks, drive.reasons[-1]
    assert drive.clearance.min() > 0.01
    if not docks:
        assert Status.DOCKED not in drive.statuses
        assert "a clearance of 0.030 m, at least 0.05 m is required" in drive.reasons[-1]
