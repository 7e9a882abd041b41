"""Vehicles with dead time and lag that the controller is not told of, obeying rates or set-points."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from benchmarks.foreign import Car, Interface, Ride, drive
from rti_mpcc import ActuatorModel, Area, DockingController, Pose2
from tests.lists import acceptance, in_fast_suite, some_of
from tests.rti_mpcc.actuator_draws import Case, case, driven

EXACT = dict.fromkeys(("drive_dead_time", "steering_dead_time", "drive_lag", "steering_lag"), 0.0)


def vehicle(interface: Interface, noise: float = 0.0, seed: int = 0, **actuators: float) -> Case:
    """A vehicle that reverses to its goal."""
    return Case("docking_behind", interface, EXACT | actuators, noise, seed)


def corrections(ride: Ride) -> list[str]:
    """What is said of actuators that are corrected."""
    return [c.diagnostics.reason for c in ride.commands if "answers" in c.diagnostics.reason]


UNKNOWN = (
    vehicle("rates", 0.5, drive_lag=0.5, drive_dead_time=0.1),
    vehicle("rates", 0.5, steering_lag=0.5, steering_dead_time=0.3),
    vehicle("setpoints", 0.5, drive_lag=0.3, steering_lag=0.1),
    vehicle("setpoints", 0.5, drive_lag=0.5, drive_dead_time=0.2, steering_lag=0.3),
)


@pytest.mark.parametrize("unknown", some_of(UNKNOWN))
def test_a_vehicle_of_unknown_lag_docks_and_stays(unknown: Case) -> None:
    found, known = driven(unknown), driven(unknown, unknown.told)
    assert found.docked
    assert found.moved <= 0.025
    assert found.peak <= 1.25
    assert found.seconds <= 1.15 * known.seconds


def test_what_was_corrected_is_said_once() -> None:
    said = [each for each in corrections(driven(vehicle("rates", drive_lag=0.5)).ride) if "the drive" in each]
    assert 1 <= len(said) <= 2
    assert said[-1].count("corrected") == 1


@pytest.mark.parametrize(
    ("interface", "noise"),
    in_fast_suite([("rates", 2.0), ("setpoints", 0.0)], product(["rates", "setpoints"], [0.0, 2.0])),
)
def test_nothing_is_corrected_where_the_model_is_right(interface: Interface, noise: float) -> None:
    """Neither exact measurements nor noise are taken for lag."""
    found = driven(vehicle(interface, noise))
    assert found.docked or noise > 1.0
    assert not corrections(found.ride)


@pytest.mark.parametrize(
    ("cycle", "late", "told"), [(0.15, 0.0, True), (0.2, 0.18, False), acceptance(0.02, 0.18, False)]
)
def test_a_vehicle_docks_and_stays_whatever_its_cycle(cycle: float, late: float, told: bool) -> None:
    slow = {"drive_lag": 0.3, "steering_lag": 0.3, "steering_dead_time": late}
    draw = Case("bay_perpendicular", "rates", EXACT | slow, 0.3 if late else 0.0, 320)
    found = driven(draw, draw.told if told else None, cycle=cycle)
    assert found.docked
    assert found.moved <= 0.025
    assert not any("sensor" in command.diagnostics.reason for command in found.ride.commands)


def test_a_drive_is_found_whose_vehicle_only_tries_to_stand() -> None:
    """On a slope, before a route is planned; its wheels are still, so nothing is learnt of the steering."""
    here = Pose2(0.0, 0.0, 0.0)
    controller = DockingController.in_area(Area(boundary=[(-9, -9), (9, -9), (9, 9), (-9, 9)]))
    car = Car(drive_dead_time=0.3, drive_lag=0.5, slope=0.03)
    done = drive(controller.step, car, here, cycle=0.05, seconds=4.0)
    assert "the drive answers" in corrections(done)[0]
    assert np.abs(done.truth[-200:, 4]).max() <= 0.02


def test_the_end_of_a_creep_torque_is_no_lag() -> None:
    """In the last braking a lag would explain it as well; the ride before speaks against one."""
    acts = {"slope": -0.0354, "uphill": -3.14, "creep": 0.3}
    found = driven(Case("docking_behind", "rates", acts, noise=0.5, seed=86))
    assert not corrections(found.ride)
    assert found.peak <= 1.25


def test_a_drive_that_waits_is_told_to_stay_as_it_is() -> None:
    late = vehicle("setpoints", steering_dead_time=0.2)
    waits = driven(late, ActuatorModel(steering_dead_time=0.2), seconds=0.2).ride.commands
    assert [(command.acceleration, command.speed) for command in waits] == [(0.0, 0.0)] * 4


def test_set_points_are_continuous() -> None:
    """From one cycle to the next they change by what the commanded rates change them."""
    done = driven(vehicle("setpoints", 1.0, drive_lag=0.3)).ride
    speeds, steering = np.array([(c.speed, c.steering) for c in done.commands]).T
    asked = np.array([(c.acceleration, c.steering_rate) for c in done.commands]).T * 0.05
    assert np.abs(np.diff(speeds) - asked[0, 1:]).max() <= 0.02
    assert np.abs(np.diff(steering) - asked[1, 1:]).max() <= 0.02


@pytest.mark.parametrize(
    ("seed", "told"),
    [
        (4_700_003, False),  # what is learnt of the drive while it swings at rest
        (4_700_024, False),  # commands under way when the steering is found to lag are counted once
        (4_700_029, False),  # set-points that are held: what lag left in the disturbance is not in them
        (4_700_066, False),  # a drive later by 0.15 s, seen in a gentle ride only
        (4_700_077, True),  # a steering that waits for the drive, from the first command on
        acceptance(4_700_143, False),  # the same, once the drive is found to be later
        (4_700_083, False),  # a speed that lags behind the commands has not leapt
        (4_700_105, False),  # given as they are, nothing is corrected, from the first command on
        (4_700_037, False),  # a smooth ride by set-points: rates would need a slope and a drag to explain it
    ],
)
def test_a_vehicle_docks_in_one_go_whatever_its_lag(seed: int, told: bool) -> None:
    drawn = case(seed)
    found, known = driven(drawn, drawn.told if told else None), driven(drawn, drawn.told)
    assert (found.docked, found.touched) == (True, False)
    assert found.seconds <= 1.15 * known.seconds
    said = "; ".join(command.diagnostics.reason for command in found.ride.commands)
    assert not any(words in said for words in ("does not follow", "leapt"))
    assert not corrections(known.ride)
