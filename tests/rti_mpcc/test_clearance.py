"""One setting says how near the body may come: to planner, plans, the last check and the goal test."""

from __future__ import annotations

from math import pi

import pytest

from geometry import Area, Pose2
from rti_mpcc import Clearance, ControllerConfig, DockingController
from rti_mpcc.types import Status
from tests.rti_mpcc.yards import Driver, block

GAP, DEPTH = 0.03, 2.0
"""Of a bay on either side of the body, and its depth [m]."""
HALF = 0.5 * ControllerConfig().vehicle.width + GAP
BAY = Area(
    boundary=[(-25.0, -12.0), (10.0, -12.0), (10.0, 12.0), (-25.0, 12.0)],
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
        assert drive.statuses[-1] is not Status.DOCKED
        assert "a clearance of 0.030 m, at least 0.05 m is required" in drive.reasons[-1]
