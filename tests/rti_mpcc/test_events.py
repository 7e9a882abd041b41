"""Whatever happens on the way, the vehicle docks where it was asked to, or stands and says why."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import pytest

from benchmarks.encounters import on_lane
from geometry import Area, Pose2, ReferencePath
from rti_mpcc import ControllerConfig, Status
from rti_mpcc.simulation.plant import PlantState
from rti_mpcc.world.surroundings import GOAL_REACH
from tests.lists import acceptance, in_fast_suite, some_of
from tests.rti_mpcc.events import PLACES, Ride
from tests.rti_mpcc.yards import Driver, block

SEED = 44


RIDES = [(0, 1), acceptance(1, 2), *(acceptance(first, 15) for first in range(3, 303, 15))]
"""The first ride, and how many."""


@pytest.mark.parametrize(("first", "count"), RIDES)
@pytest.mark.parametrize("place", PLACES)
def test_rides_with_random_events_keep_the_invariants(
    place: str, first: int, count: int, capfd: pytest.CaptureFixture[str]
) -> None:
    rides = [Ride(place=place, seed=SEED, index=first + k).drive() for k in range(count)]
    assert not {ride.name: ride.problems for ride in rides if ride.problems}
    assert sum(ride.docked or ride.refused for ride in rides) >= count - 1
    assert capfd.readouterr().out == ""


# -- a goal at or behind a vehicle that drives --------------------------------------------------------------

LANE = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 20.0)])
CONFIG = ControllerConfig(cycle=0.05)


def test_a_goal_that_jumps_behind_the_vehicle_is_come_back_to() -> None:
    controller, far, behind = on_lane(LANE, 5.0, CONFIG), Pose2(20.0, 0.0, 0.0), Pose2(16.7, 0.5, 0.0)
    jumped: list[float] = []

    def goal_at(now: float) -> Pose2:
        if controller.state.start_state is not None and controller.state.start_state[0] >= 17.0:
            jumped.append(now)
        return behind if jumped else far

    driver = Driver(area=_open(), controller=controller, config=CONFIG, goal_at=goal_at)
    drive = driver.drive(60.0)
    assert drive.docked
    assert drive.times[-1] <= 45.0
    assert drive.error(behind).within(CONFIG.goal_tolerance)
    assert drive.states[:, 0].max() < 24.0
    assert Status.GOAL_BEHIND in drive.statuses
    # It is braked for in comfort, and the reason says how far it lies behind.
    stopping = [command for command in drive.commands if command.status is Status.GOAL_BEHIND]
    assert max(abs(command.acceleration) for command in stopping) <= 1.05 * CONFIG.comfort_acceleration
    assert "behind where the vehicle stops: a new route is needed" in stopping[0].diagnostics.reason


def test_a_goal_that_will_be_out_of_reach_is_braked_for_in_comfort() -> None:
    controller, asked = on_lane(60.0, 5.0, CONFIG), [Pose2(60.0, 0.0, 0.0)]

    def goal_at(now: float) -> Pose2:
        if controller.state.start_state is not None and controller.state.start_state[0] >= 35.0:
            asked.append(asked[-1] if len(asked) > 1 else Pose2(35.0 - GOAL_REACH + 0.3, 0.0, 0.0))
        return asked[-1]

    drive = Driver(area=_open(), controller=controller, config=CONFIG, goal_at=goal_at).drive(90.0)
    stopping = [command for command in drive.commands if command.status is Status.GOAL_BEHIND]
    assert drive.docked
    assert stopping
    assert max(abs(command.acceleration) for command in stopping) <= 1.05 * CONFIG.comfort_acceleration


TOO_FAST = [("smooth", 3.0), ("smooth", 6.0), ("smooth", 9.0), ("brisk", 6.0)]


@pytest.mark.parametrize(
    ("ride", "speed"), in_fast_suite(TOO_FAST, product(["smooth", "brisk"], [3.0, 6.0, 9.0]))
)
def test_one_that_begins_too_fast_for_its_goal_docks_all_the_same(speed: float, ride: str) -> None:
    """Up to the firm deceleration it is stopped in time, beyond that it comes back."""
    config = ControllerConfig(cycle=0.05, ride="brisk" if ride == "brisk" else "smooth")
    first: list[bool] = []

    def moved(plant: PlantState) -> PlantState:
        if first:
            return plant
        first.append(True)
        return replace(plant, v=speed)

    driver = Driver(
        area=_open(),
        controller=on_lane(40.0, 5.0, config),
        config=config,
        start=Pose2(28.0, 0.0, 0.0),
        moved=moved,
        goal_at=lambda now: Pose2(40.0, 0.0, 0.0),
    )
    drive = driver.drive(60.0)
    assert drive.docked
    firm = config.firm_deceleration
    reach = 0.0 if speed**2 / (2.0 * firm) <= 12.0 else GOAL_REACH
    assert drive.states[:, 0].max() - 40.0 <= reach + 0.6


def along_lane(lane: ReferencePath = LANE, **happens: Any) -> Driver:
    """To the end of the lane, whatever happens."""
    controller = on_lane(lane, 5.0, CONFIG)
    return Driver(area=_open(), controller=controller, config=CONFIG, goal_at=lambda now: lane.end, **happens)


def _open() -> Area:
    return Area(boundary=[(-40.0, -5.0), (90.0, -5.0), (90.0, 5.0), (-40.0, 5.0)])


# -- beside an obstacle ------------------------------------------------------------------------------------


OTHER_GAPS = (0.03, 0.05, 0.052, 0.07, 0.1)
SHORT_LANE = ReferencePath.from_segments(LANE.start, [(1, 0.0, 10.0)])


@pytest.mark.parametrize("along", some_of([0.3, 1.4, 3.0]))
@pytest.mark.parametrize("gap", [0.003, 0.0499, 0.0501, *map(acceptance, OTHER_GAPS)])
def test_a_start_beside_an_obstacle_is_left_without_a_swerve(gap: float, along: float) -> None:
    beside = 0.5 * CONFIG.vehicle.width + gap
    outline = block(along - 0.5, beside, along + 0.5, beside + 1.0)
    drive = along_lane(SHORT_LANE, obstacles_at=lambda now: [outline]).drive(30.0)
    assert drive.docked
    assert drive.clearance.min() > 0.0
    assert np.abs(drive.commanded()[:, 0]).max() <= 1.1 * CONFIG.comfort_acceleration
    assert np.abs(drive.states[:, 1]).max() <= 0.25


# -- who else drives -------------------------------------------------------------------------------------


@pytest.mark.parametrize("seconds", [0.95, 2.0, *map(acceptance, (0.5, 0.8))])
def test_one_that_a_watchdog_braked_while_it_was_not_called_goes_on(seconds: float) -> None:
    """Its speed is another one than its commands make: that is no reason to doubt it, or to drive back."""

    def is_lost(now: float) -> bool:
        return 6.0 <= now < 6.0 + seconds

    def braked(plant: PlantState) -> PlantState:
        return replace(plant, v=max(plant.v - 0.1, 0.0)) if is_lost(plant.time) else plant

    drive = along_lane(lost=is_lost, moved=braked).drive(60.0)
    assert drive.docked
    assert Status.FAILED not in drive.statuses
    assert drive.states[:, 3].min() > -0.1
    assert drive.error(LANE.end).within(CONFIG.goal_tolerance)
