"""The promises that hold for every command: with random inputs, and under faults in an area."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import product
from math import inf, nan
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import shapely

from benchmarks.encounters import body_at, on_lane
from geometry import Pose2, ReferencePath
from rti_mpcc import Command, ControllerConfig, Reason, Source, Status, VehicleState
from rti_mpcc.simulation.plant import PlantState
from rti_mpcc.types import Array
from tests.lists import acceptance, in_fast_suite, some_of
from tests.rti_mpcc.promises import check_numbers, keep_promises
from tests.rti_mpcc.yards import BEYOND, BRISK, ROOMS, Drive, Driver, block

STILL = 0.02
MAY_STAND = (Status.STALLED, Status.BLOCKED, Status.FAILED, Status.PLANNING)
"""Statuses of a vehicle that does not get on."""
OPEN = {Source.SOLUTION, Source.SHIFTED_PLAN}
CART = block(2.0, 4.5, 3.0, 5.5)
"""Beside the route, and given all the time."""


@pytest.mark.parametrize("seed", some_of(range(30)))
def test_the_promises_hold_whatever_a_controller_on_a_path_is_given(seed: int) -> None:
    keep_promises(seed)


@pytest.mark.parametrize("seed", some_of(range(6)))
def test_the_promises_hold_whatever_a_controller_in_an_area_is_given(seed: int) -> None:
    keep_promises(seed, in_area=True)


LED_ASTRAY = {
    "places leap, the speed does not": 112,
    "the clock leaps while it drives": 240,
    "one speed beyond the limit": 1040,
    "an impossible speed after another one": 2482,
    "an impossible speed, and a clock that stands": 1386,
    "an impossible speed while it drives off": 6265,
    "an impossible speed in the cycle in which it was set elsewhere": 397,
    "one speed while it is docked": 3013,
}
"""Cases of the list below that broke a promise once, by what was believed."""


@pytest.mark.parametrize("seed", LED_ASTRAY.values(), ids=LED_ASTRAY)
def test_the_promises_hold_where_a_wrong_witness_was_believed_once(seed: int) -> None:
    keep_promises(seed)


def test_where_places_leap_the_vehicle_is_braked_by_its_measured_speed() -> None:
    """It backed at 1 m/s, and was set elsewhere, rolling forward: what is reckoned alone does not count."""
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(-1, 0.0, 20.0)])
    config = ControllerConfig(deadline=None)
    controller = on_lane(path, 5.0, config)
    for cycle in range(18):
        now, leaps = cycle * config.cycle, cycle > 5
        x = -1.0 * now + 7.0 * (cycle % 3 + 1) * leaps
        command = controller.step(VehicleState(x, 0.0, 0.0, 1.2 if leaps else -1.0, 0.0), now=now)
        assert cycle < 14 or command.acceleration < 0.0, (cycle, command)


@pytest.mark.acceptance
@pytest.mark.parametrize("chunk", range(20))
def test_the_promises_hold_over_6000_random_cases(chunk: int) -> None:
    for seed in range(100 + 250 * chunk, 100 + 250 * (chunk + 1)):
        keep_promises(seed)
    for seed in range(100 + 50 * chunk, 100 + 50 * (chunk + 1)):
        keep_promises(seed, in_area=True)


# -- under faults --------------------------------------------------------------------------------------------

SOLID = shapely.union_all([shapely.Polygon(ring) for ring in (*ROOMS.obstacles, CART)])
INSIDE = shapely.Polygon(ROOMS.boundary)
LEAST = 0.03
"""So near a plan that is driven may come to what stands [m]."""


def check_plan(command: Command) -> None:
    """The body along the way that a stop takes is clear of all that is known, by shapely."""
    states = command.trajectory.states
    far = states[0, 3] ** 2 / (2.0 * BRISK.comfort_acceleration)
    driven = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(states[:, :2], axis=0).T))))
    for x, y, phi in states[driven <= far, :3]:
        body = body_at(x, y, phi, BRISK.vehicle)
        assert INSIDE.covers(body.buffer(LEAST - 1e-3)), command.diagnostics
        assert SOLID.distance(body) >= LEAST - 1e-3, command.diagnostics


def check_promises(drive: Drive) -> None:
    """Never an unchecked, non-finite or out-of-limits command, nor a contact; it stands, or goes on."""
    for command in drive.commands:
        check_numbers(command, BRISK)
        assert command.diagnostics.cause is not Reason.INTERNAL_ERROR, command.diagnostics.reason
        assert len(command.diagnostics.reason.splitlines()) <= 1
        if command.source in OPEN:
            check_plan(command)
    assert drive.clearance.min() > 0.0
    if not drive.docked:
        last = drive.commands[-1]
        assert abs(drive.states[-1, 3]) <= STILL, last.diagnostics.reason
        assert last.status in MAY_STAND
        assert last.diagnostics.reason


def through(begin: float, end: float, fault: Any, usual: Any) -> Callable[[float], Any]:
    """What is so from one time to another [s], and otherwise as usual."""
    return lambda now: fault if begin <= now < end else usual


def spoiled(begin: float, end: float, **values: float) -> Callable[[PlantState], VehicleState]:
    return lambda plant: replace(plant.measured, **values) if begin <= plant.time < end else plant.measured


def frozen(begin: float, end: float) -> Callable[[PlantState], VehicleState]:
    """What was measured first in that time is measured on."""
    kept: list[VehicleState] = []

    def measured(plant: PlantState) -> VehicleState:
        if not begin <= plant.time < end:
            return plant.measured
        kept.append(plant.measured)
        return kept[0]

    return measured


NO_POLYGONS: dict[str, Any] = {
    "two corners": [[(0.0, 0.0), (1.0, 1.0)]],
    "crossed": [[(0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0)]],
    "NaN": [[(0.0, nan), (1.0, 1.0), (1.0, 0.0)]],
    "not a list": 7,
    "words": ["here", "there"],
}
NAN_GOAL: Any = SimpleNamespace(x=nan, y=inf, phi=0.0)
FAULTS: dict[str, Callable[[float, float], dict[str, Any]]] = {
    "frozen": lambda a, b: {"measured": frozen(a, b)},
    "lost cycles": lambda a, b: {"lost": lambda now: a <= now < b},
    "NaN position": lambda a, b: {"measured": spoiled(a, b, x=nan)},
    "infinite speed": lambda a, b: {"measured": spoiled(a, b, v=inf)},
    "all NaN": lambda a, b: {"measured": spoiled(a, b, x=nan, y=nan, phi=nan, v=nan, delta=nan)},
    "elsewhere": lambda a, b: {"measured": spoiled(a, b, x=-5.0, y=5.0)},
    "clock back": lambda a, b: {"shown": lambda now: now - 100.0 if now >= a else now},
    "clock ahead": lambda a, b: {"shown": lambda now: now + 1e5 if now >= a else now},
    "clock stands": lambda a, b: {"shown": lambda now: min(now, a) if now < b else now},
    "clock NaN": lambda a, b: {"shown": through(a, b, nan, 0.0)},
    "goal NaN": lambda a, b: {"goal_at": through(a, b, NAN_GOAL, BEYOND)},
    "goal in a wall": lambda a, b: {"goal_at": through(a, b, Pose2(7.5, 4.0, 0.0), BEYOND)},
    "goal beyond all": lambda a, b: {"goal_at": through(a, b, Pose2(1e6, 0.0, 0.0), BEYOND)},
}


def told_of(odd: Any) -> Callable[[float, float], dict[str, Any]]:
    return lambda a, b: {"obstacles_at": through(a, b, odd, [CART])}


FAULTS |= {f"obstacles: {name}": told_of(odd) for name, odd in NO_POLYGONS.items()}


def driven_with(fault: dict[str, Any], seconds: float = 40.0) -> Drive:
    usual: dict[str, Any] = {"obstacles_at": lambda now: [CART], "standing_at": lambda now: [CART]}
    return Driver(area=ROOMS, **{**usual, **fault}).drive(seconds)


WHEN = {"planning": (0.0, 0.6), "driving": (2.0, 2.6)}
OFTEN = [("frozen", "driving"), ("lost cycles", "driving"), ("all NaN", "driving"), ("clock back", "driving")]
OFTEN += [("goal beyond all", "driving"), ("obstacles: crossed", "driving"), ("all NaN", "planning")]
"""What is looked at in the short form."""


@pytest.mark.parametrize(("name", "when"), in_fast_suite(OFTEN, product(FAULTS, WHEN)))
def test_under_a_fault_it_keeps_its_promises_and_docks_after_it(name: str, when: str) -> None:
    begin, end = WHEN[when]
    drive = driven_with(FAULTS[name](begin, end))
    check_promises(drive)
    assert drive.docked, (drive.statuses, drive.reasons[-1])
    assert drive.error(BEYOND).within((0.06, 0.06, 0.04))


@pytest.mark.parametrize("name", ["frozen", "all NaN", "obstacles: words"])
def test_under_a_fault_that_lasts_it_stands_and_says_why(name: str) -> None:
    drive = driven_with(FAULTS[name](2.0, inf), 8.0)
    check_promises(drive)
    assert not drive.docked


@pytest.mark.parametrize("seed", [2, *map(acceptance, (0, 1, *range(3, 103)))])
def test_the_promises_hold_under_any_two_faults(seed: int) -> None:
    rng = np.random.default_rng(seed)
    given: dict[str, Any] = {}
    for kind in rng.choice(sorted(FAULTS), 2):
        begin = rng.uniform(0.0, 5.0)
        given |= FAULTS[str(kind)](begin, begin + rng.uniform(0.05, 3.0))
    check_promises(driven_with(given, 25.0))


def test_what_comes_and_goes_in_the_door_is_never_touched() -> None:
    """Told of in every other half a second, wider and narrower than the door."""

    def obstacles_at(now: float) -> list[Array]:
        return [block(7.2, -0.2 * (now % 7), 7.8, 0.5)] if int(2.0 * now) % 2 else []

    drive = Driver(area=ROOMS, obstacles_at=obstacles_at, standing_at=lambda now: []).drive(6.0)
    for command in drive.commands:
        check_numbers(command, BRISK)
    assert drive.clearance.min() > 0.0
