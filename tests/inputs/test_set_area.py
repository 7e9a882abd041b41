"""Another area for a controller that plans its routes, as a map that is updated."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from benchmarks.encounters import on_lane
from geometry import Area, InputError
from rti_mpcc import Command, DockingController, VehicleState
from rti_mpcc.model.footprint import body_of
from rti_mpcc.recording import Recorder, replay
from rti_mpcc.types import Array, Status
from tests.lists import some_of
from tests.rti_mpcc.yards import BRISK, CYCLE, DOOR, ROOMS, YARD, Drive, Driver, block

ON_ROUTE = block(8.0, -1.5, 9.0, 1.5)


class Updated:
    """A controller that is given another area before some of its cycles."""

    def __init__(self, area: Area, area_at: Callable[[float], Area | None]) -> None:
        self.controller = DockingController.in_area(area, BRISK)
        self._area_at = area_at

    def step(self, state: VehicleState, *, now: float, **told: object) -> Command:
        area = self._area_at(now)
        if area is not None:
            self.controller.set_area(area)
        return self.controller.step(state, now=now, **told)  # type: ignore[arg-type]


def once(area: Area, at: float) -> Callable[[float], Area | None]:
    """Given in one cycle."""
    return lambda now: area if abs(now - at) < 0.5 * CYCLE else None


def ride(area: Area, area_at: Callable[[float], Area | None], seconds: float = 90.0) -> Drive:
    """To BEYOND, judged by what stands at the end."""
    driver = Driver(area=YARD, controller=Updated(area, area_at), standing_at=lambda now: [])
    return driver.drive(seconds)


def clearance_to(drive: Drive, outline: Array) -> float:
    """Least clearance of the body to a block, on the whole ride [m]."""
    return float(
        Area(obstacles=[outline]).signed_distances(body_of(BRISK.vehicle), drive.states[:, :3].copy()).min()
    )


@pytest.mark.parametrize("at", some_of([0.0, 1.0, 3.0, 2.0]))
def test_what_comes_to_stand_on_the_route_is_driven_round(at: float) -> None:
    controller = Updated(YARD, once(YARD.with_obstacles([ON_ROUTE]), at))
    drive = Driver(area=YARD, controller=controller, standing_at=lambda now: []).drive(90.0)
    assert drive.docked, drive.reasons[-1]
    assert clearance_to(drive, ON_ROUTE) > 0.03
    assert controller.controller.area is not None
    assert len(controller.controller.area.obstacles) == 1


def test_a_door_that_opens_is_driven_through() -> None:
    closed = ROOMS.with_obstacles([DOOR])
    before = ride(closed, lambda now: None, 15.0)
    assert before.statuses[-1] in (Status.PLANNING, Status.STALLED)
    opened = ride(closed, once(ROOMS, 15.0))
    assert opened.docked, opened.reasons[-1]


def test_a_door_that_closes_is_not_driven_through() -> None:
    drive = ride(ROOMS, once(ROOMS.with_obstacles([DOOR]), 1.0), 20.0)
    assert not drive.docked
    assert clearance_to(drive, DOOR) > 0.03
    assert abs(drive.states[-1, 3]) < 0.01


@pytest.fixture(scope="module")
def usual() -> Drive:
    return ride(ROOMS, lambda now: None)


@pytest.mark.parametrize("again", ["the same", "equal", "with noise of a centimetre"])
def test_the_same_area_changes_no_command(again: str, usual: Drive) -> None:
    random = np.random.default_rng(0)

    def area_at(now: float) -> Area:
        if again == "the same":
            return ROOMS
        noise = 0.01 if again.startswith("with") else 0.0
        return Area(
            boundary=ROOMS.boundary,
            obstacles=[each + random.uniform(-noise, noise, each.shape) for each in ROOMS.obstacles],
        )

    np.testing.assert_array_equal(ride(ROOMS, area_at).commanded(), usual.commanded())


def test_it_is_recorded_and_replayed(tmp_path: Path) -> None:
    file = tmp_path / "ride.jsonl"
    with Recorder(DockingController.in_area(YARD, BRISK), file) as recorder:
        updated = Updated(YARD, once(YARD.with_obstacles([ON_ROUTE]), 1.0))
        updated.controller = recorder  # type: ignore[assignment]
        Driver(area=YARD, controller=updated, standing_at=lambda now: []).drive(6.0)
        assert recorder.controller.area is not None  # type: ignore[union-attr]
        assert len(recorder.controller.area.obstacles) == 1  # type: ignore[union-attr]
    report = replay(file)
    assert report.mismatch is None
    assert report.complete


def test_what_is_refused() -> None:
    with pytest.raises(InputError, match=r"drives a path in a corridor\. Give what has changed to step"):
        on_lane(9.0, 3.0, BRISK).set_area(YARD)
    with pytest.raises(InputError, match="area = None: must be an Area"):
        DockingController.in_area(YARD, BRISK).set_area(None)  # type: ignore[arg-type]
