"""Never into what is there: promises over drawn obstacles and walkers; longer lists in tests/acceptance."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.collisions import check_chatter, check_overlaps, keep_promises, meet
from benchmarks.encounters import Car, Drive, drive, on_lane, square
from geometry import Pose2
from rti_mpcc import ControllerConfig, Source, Status
from tests.lists import some_of
from tests.rti_mpcc.yards import block

START = Pose2(0.0, 0.0, 0.0)


@pytest.mark.parametrize("seed", some_of(range(10)))
def test_the_promises_hold_for_what_appears_anywhere(seed: int) -> None:
    keep_promises(seed)


@pytest.mark.parametrize("number", some_of([1, 0]))
@pytest.mark.parametrize("lag", some_of([0.2, 0.0]))
def test_nobody_who_walks_in_plain_sight_is_run_into(number: int, lag: float) -> None:
    _, found = meet(number, 31, lag=lag)
    assert not any(contact.front for contact in found.collisions)
    check_chatter(found)


def appearing_inside(ahead: float, size: float) -> Drive:
    """A box appears inside the outline of a vehicle that drives at 2 m/s."""
    config = ControllerConfig(dead_time=0.18)
    return drive(
        on_lane(40.0, 3.0, config),
        Car(config=config),
        START,
        14.0,
        obstacles_at=lambda now: [square(8.05 + ahead, 0.0, size)] if now >= 8.0 else [],
    )


@pytest.mark.parametrize("ahead", some_of([2.0, 1.2, 3.0], 3))
def test_what_appears_inside_the_outline_stops_the_vehicle_and_is_named(ahead: float) -> None:
    found = appearing_inside(ahead, 0.5)
    config = ControllerConfig(dead_time=0.18)
    told = found.commands[found.overlaps.index(True)]
    assert told.status is Status.BLOCKED
    assert told.acceleration == pytest.approx(-config.limits.acceleration)
    assert "the body overlaps obstacles[0] by" in told.diagnostics.reason
    check_overlaps(found, config)
    assert abs(found.states[-1, 3]) < 0.02
    assert found.commands[-1].status is Status.BLOCKED


def pressed_into_the_front(escape_speed: float) -> Drive:
    """A wall stands 0.15 m in the front of a vehicle at rest."""
    config = ControllerConfig(dead_time=0.18, escape_speed=escape_speed)
    car, start, wall = Car(config=config), Pose2(10.0, 0.0, 0.0), block(13.52, -1.5, 14.0, 1.5)
    return drive(on_lane(40.0, 3.0, config), car, start, 8.0, obstacles_at=lambda now: [wall])


def test_a_vehicle_in_contact_stands_unless_it_is_told_to_escape() -> None:
    found = pressed_into_the_front(0.0)
    assert np.ptp(found.states[:, 0]) < 0.01
    assert all(command.status is Status.BLOCKED for command in found.commands)


@pytest.mark.acceptance
def test_a_vehicle_that_may_escape_creeps_out_and_no_farther() -> None:
    found = pressed_into_the_front(0.2)
    escaping = [command.source is Source.ESCAPE for command in found.commands]
    assert escaping[1]
    assert np.abs(found.states[:, 3]).max() <= 0.2 + 1e-3
    assert not found.overlaps[-1]
    assert found.states[-1, 0] > 9.5  # free after 0.16 m, and no reason to go on
    last = max(k for k, each in enumerate(escaping) if each)
    assert last < len(escaping) - 20


@pytest.mark.acceptance
def test_noise_of_a_centimetre_at_a_wall_is_no_contact() -> None:
    """Parked 3 cm beside a wall and measured with noise, it drives off."""
    config = ControllerConfig(dead_time=0.18)
    start, car = Pose2(2.0, 3.0 - 0.5 * 2.069 - 0.03, 0.0), Car(config=config)
    rng, stds = np.random.default_rng(1), (0.005, 0.005, 0.001, 0.01, 0.001)
    found = drive(on_lane(40.0, 3.0, config), car, start, 60.0, noise=rng, stds=stds)
    assert found.docked
