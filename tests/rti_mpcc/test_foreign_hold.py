"""A foreign vehicle stays where it docked: with slope, lag, creep torque, dead band, in any size."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import nan, pi
from typing import Any

import numpy as np
import pytest
import shapely

from benchmarks.encounters import on_lane
from benchmarks.foreign import Car, Event, drive, state_of
from benchmarks.foreign_sensors import NOISE, Faulty, healthy
from rti_mpcc import (
    Area,
    Command,
    ControllerConfig,
    Dock,
    DockingController,
    DockingMission,
    Pose2,
    ReferencePath,
    Status,
    Vehicle,
    VehicleState,
    Wait,
)
from rti_mpcc.types import Array
from tests.lists import acceptance
from tests.rti_mpcc.hold_draws import GOAL, Draw, draws, stay_of

PLAIN = Draw(wheelbase=2.875, tolerance=0.05, dead_band=0.0, actuators={})
UPHILL: dict[str, object] = {"slope": 0.05, "uphill": GOAL[2]}
CREEPING: dict[str, object] = {"creep": 0.3, "uphill": GOAL[2]}
SWINGING: dict[str, object] = {"drive_lag": 0.495, "slope": -0.046, "uphill": 3.3, "creep": 0.3}


@pytest.mark.parametrize(
    "draw",
    [
        acceptance(replace(PLAIN, actuators=UPHILL)),
        acceptance(replace(PLAIN, actuators={"drive_lag": 0.3})),
        acceptance(replace(PLAIN, actuators={"creep": 0.3})),
        replace(PLAIN, actuators={"drive_lag": 0.3}, cycle=0.03),
        acceptance(replace(PLAIN, dead_band=0.1)),
        replace(PLAIN, tolerance=0.005),
        replace(PLAIN, wheelbase=0.5, tolerance=0.02, actuators=UPHILL),
        # The speed that is measured says that it stands, and so that the commands balance what acts.
        replace(
            PLAIN, wheelbase=2.24, tolerance=0.016, dead_band=0.1, actuators={**CREEPING, "slope": -0.032}
        ),
        # Its swing has not ended yet where its speed goes through zero.
        replace(PLAIN, wheelbase=2.21, tolerance=0.0286, dead_band=0.1, actuators=SWINGING),
    ],
    ids=["slope", "lag", "creep", "0.03 s", "dead band", "5 mm", "small", "creep and dead band", "swing"],
)
def test_a_foreign_vehicle_stays_where_it_docked(draw: Draw) -> None:
    stay = stay_of(draw, draw.drive(after=20.0))
    assert stay.good, stay
    assert stay.lost == 0


def noisy(seed: int, index: int) -> Draw:
    """A random vehicle whose poses are noisy, by 1/16 to 1/4 of its tolerance."""
    draw = list(draws(10, seed))[index]
    return replace(draw, noise=min(draw.tolerance / 0.04, 1.0) * (0.25, 0.5, 1.0)[index % 3])


@pytest.mark.parametrize(
    ("seed", "index"), [(82005, 5), (81005, 5), *(acceptance(83003, index) for index in range(10))]
)
def test_below_the_dead_band_noisy_poses_hold_a_vehicle_inside_its_tolerance(seed: int, index: int) -> None:
    """The first one swung out of its dock, the second one does where a second is proof that it stands."""
    stay = stay_of(noisy(seed, index), noisy(seed, index).drive(after=40.0))
    assert stay.docked_at is not None
    assert max(stay.share, stay.worst) <= 1.0, stay


def test_below_the_dead_band_a_noisy_pose_that_moves_is_right() -> None:
    """It was blamed, for its noise to the side: the vehicle rolled on at 0.09 m/s, for minutes."""
    draw = replace(next(draws(1, 81_011)), noise=0.179)
    stay = stay_of(draw, draw.drive(after=20.0))
    assert stay.docked_at is not None
    assert stay.docked_at < 60.0
    assert stay.worst <= 1.0
    assert stay.lost == 0


def test_a_speed_that_leaps_into_its_dead_band_leads_no_vehicle_past_its_dock() -> None:
    actuators: dict[str, object] = {"slope": -0.043, "uphill": 2.344, "creep": 0.3, "drive_lag": 0.06}
    draw = replace(PLAIN, wheelbase=0.32, tolerance=0.027, dead_band=0.1, actuators=actuators)
    docked_at = draw.drive(after=0.0).docked_at
    assert docked_at is not None
    assert docked_at < 20.0, "it came back"


def test_a_brake_is_set_once_the_vehicle_is_docked() -> None:
    draw = replace(PLAIN, actuators={**UPHILL, "brake": True})
    ride = draw.drive(after=40.0)
    stay = stay_of(draw, ride)
    assert stay.good, stay
    assert stay.lost <= 1
    held = [command.hold for command in ride.commands]
    docked = [command.docked for command in ride.commands]
    assert held.index(True) == docked.index(True)
    assert all(held[held.index(True) + 1 :])


@dataclass
class Jumps:
    """A pose that jumps by 0.6 m once the vehicle has been slow for 0.6 s."""

    slow: int = 0
    jumped: bool = False

    def __call__(self, history: Array, rng: np.random.Generator) -> VehicleState:
        state = state_of(history[-1])
        self.slow = self.slow + 1 if history[-1, 0] > 5.0 and abs(state.v) < 0.02 else 0
        self.jumped = self.jumped or self.slow >= 12
        return replace(state, x=state.x + 0.6) if self.jumped else state


def test_a_brake_is_set_where_a_vehicle_that_is_not_docked_yet_stands_in_doubt() -> None:
    start = Pose2(0.0, 0.0, pi / 2)
    controller = on_lane(ReferencePath.from_segments(start=start, segments=[(1, 0.0, 6.0)]), 4.0)
    car, sensor = Car(brake=True, drive_lag=0.4, creep=0.3), Jumps()
    ride = drive(controller.step, car, start, cycle=0.05, seconds=18.0, sensor=sensor)
    assert sensor.jumped
    assert not any(command.docked for command in ride.commands)
    for command in ride.commands[-10:]:
        assert command.status is Status.FAILED
        assert command.hold


@pytest.mark.parametrize(
    ("shift", "unread", "corrected"), [(0.0, 0.0, 0.0), (0.5, 0.0, 0.0), (0.0, 0.4, 0.0), (0.0, 0.0, 0.09)]
)
def test_a_vehicle_that_waits_at_its_dock_stays_there(shift: float, unread: float, corrected: float) -> None:
    """Also where it is after a `shift` [m], after states that are not read, or after a map is corrected."""
    controller = DockingController.in_area(Area(), ControllerConfig(deadline=None))
    mission = DockingMission(controller, [Dock(Pose2(0.0, 6.0, pi / 2)), Wait(70.0)])

    def step(state: VehicleState, *, now: float, **given: Any) -> Command:
        x = nan if 40.0 <= now < 40.0 + unread else state.x
        return mission.step(replace(state, x=x, y=state.y + corrected * (now >= 40.0)), now=now, **given)

    car = Car(drive_lag=0.26, drive_dead_time=0.29, slope=-0.04, creep=0.3 * (unread > 0.0))
    moved = [Event("moved", 40.0, shift=(shift, 0.0, 0.0))] * (shift > 0.0)
    sensor = Faulty(healthy, noise=None if corrected else NOISE)
    start, most = Pose2(0.0, 0.0, pi / 2), 0.1 if moved else controller.config.goal_tolerance[0] / 3.0
    ride = drive(step, car, start, cycle=0.05, seconds=80.0, sensor=sensor, events=moved)
    waits = [command.mission is not None and command.mission.kind == "wait" for command in ride.commands]
    assert ride.moved_after(41.0 if moved else ride.stamps[waits.index(True)]) <= most


def test_a_vehicle_that_is_moved_out_of_its_dock_is_docked_no_more() -> None:
    start = Pose2(0.0, 0.0, pi / 2)
    controller = on_lane(ReferencePath.from_segments(start=start, segments=[(1, 0.0, 6.0)]), 4.0)
    moved = Event("moved", 25.0, shift=(0.25, 0.0, 0.0))
    ride = drive(controller.step, Car(), start, cycle=0.05, seconds=60.0, events=[moved])
    docked = {round(float(t), 2): c.docked for t, c in zip(ride.stamps, ride.commands, strict=True)}
    assert docked[24.9]
    assert not docked[25.1]
    ended = "no longer docked: the vehicle is 0.251 m and 0.0 deg from the goal"
    (said,) = (k for k, c in enumerate(ride.commands) if "no longer docked" in c.diagnostics.reason)
    assert ride.commands[said - 1].docked
    assert not ride.commands[said].docked
    assert ended in ride.commands[said].diagnostics.reason
    assert ride.commands[-1].status is Status.DOCKED


def test_a_car_of_forty_centimetres_docks_in_a_slot_with_the_default_settings() -> None:
    share = 0.4 / 4.689

    def scaled(corners: list[tuple[float, float]]) -> np.ndarray:
        return share * np.array(corners)

    def parked(x: float) -> np.ndarray:
        return scaled([(x, 0.2), (x + 4.7, 0.2), (x + 4.7, 2.1), (x, 2.1)])

    cars = [parked(-4.7), parked(0.7 / share)]
    area = Area(boundary=scaled([(-14.0, 0.0), (20.0, 0.0), (20.0, 8.0), (-14.0, 8.0)]), obstacles=cars)
    size: dict[str, Any] = {"wheelbase": 2.8, "width": 1.942, "front": 3.76, "rear": 0.929}
    vehicle = Vehicle(**{name: share * value for name, value in size.items()})
    controller = DockingController.in_area(area, ControllerConfig(vehicle=vehicle))
    goal = Pose2(0.5 * (0.7 - 0.4) + 0.929 * share, 1.25 * share, 0.0)
    start = Pose2(-7.0 * share, 4.2 * share, 0.0)
    car = Car.of(vehicle)
    ride = drive(controller.step, car, start, cycle=0.05, seconds=60.0, goal=goal, after_docked=2.0)
    assert ride.docked_at is not None
    assert ride.docked_at < 30.0
    assert not ride.touches(shapely.union_all([shapely.Polygon(each) for each in cars]))
