"""An obstacle that blocks the route as a fault: where it is put, when, and beside which other obstacles."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from geometry import Pose2, ReferencePath
from rti_mpcc.config import Vehicle
from rti_mpcc.simulation import Scenario, changed, simulate, summary
from rti_mpcc.simulation.scenery import ACROSS, BESIDE, THICKNESS
from rti_mpcc.types import Array
from tests.lists import some_of
from tests.rti_mpcc.simulation.conftest import Scripted, ScriptedPlanner, forward, still

VEHICLE = Vehicle()
FRONT, REAR, HALF = VEHICLE.front, VEHICLE.rear, 0.5 * VEHICLE.width + BESIDE
BOX = [[20.0, 5.0], [21.0, 5.0], [21.0, 6.0]]
AHEAD, BACK = {"direction": 1, "curvature": 0, "length": 20}, {"direction": -1, "curvature": 0, "length": 20}


def blocked(scenario: Scenario, size: float = 1.0, begin: float = 1.0, **changes: Any) -> Scenario:
    faults = [{"kind": "blocked", "from": begin, "to": begin + 1.0, "size": size}]
    return changed(scenario, {"simulation.duration": 3.0, "faults": faults, **changes})


def put(scenario: Scenario, controller: Any, gap: float, x: float, y: float = 0.0, phi: float = 0.0) -> Array:
    """The obstacle in the way of a vehicle that stands there from the beginning."""
    there = {"simulation.duration": 0.2, "simulation.start_offset": [x, y, phi]}
    simulate(blocked(scenario, gap, 0.1, **there), controller=controller)
    (wall,) = controller.given[-1][3]
    return np.asarray(wall)


def extent(outline: Array) -> tuple[float, float, float, float]:
    return (*outline.min(axis=0).tolist(), *outline.max(axis=0).tolist())


@pytest.mark.parametrize(
    ("segment", "at", "gap", "near"),
    [
        (AHEAD, (1.0, 0.7, 0.1), 4.0, 1.0 + FRONT + 4.0),
        (BACK, (-1.0, 0.0, 0.0), 4.0, -1.0 - REAR - 4.0),
        ({**AHEAD, "length": 10}, (8.0, 0.0, 0.0), 5.0, 8.0 + FRONT + 5.0),
        ({**AHEAD, "length": 10}, (11.0, 0.0, 0.0), 5.0, 11.0 + FRONT + 5.0),
    ],
    ids=["ahead", "in reverse", "behind the end", "the vehicle behind the end"],
)
def test_along_a_path_it_reaches_to_the_boundaries(
    straight: Scenario,
    segment: dict[str, Any],
    at: tuple[float, float, float],
    gap: float,
    near: float,
) -> None:
    outline = put(changed(straight, {"path.segments": [segment]}), Scripted(script=still), gap, *at)
    left, right, beside = near, near + segment["direction"] * THICKNESS, 3.0 if abs(near) < 10.0 else ACROSS
    assert extent(outline) == pytest.approx((min(left, right), -beside, max(left, right), beside))


@pytest.mark.parametrize(
    ("segments", "x", "gap", "near", "direction"),
    [
        ([AHEAD], 1.0, 4.0, 1.0 + FRONT + 4.0, 1),
        # 2 m forward and 10 m back: the rear axle is at -4 m by then.
        ([{**AHEAD, "length": 6}, BACK], 4.0, 12.0, -4.0 - REAR, -1),
        # 2 m forward and 2 m back: there the vehicle is now, so it stands beyond the cusp.
        ([{**AHEAD, "length": 6}, BACK], 4.0, 4.0, 4.0 + FRONT + 4.0, 1),
        ([{**BACK, "length": 5}], -4.0, 7.0, -11.0 - REAR, -1),
        (None, 1.0, 4.0, 1.0 + FRONT + 4.0, 1),
    ],
    ids=["ahead", "behind a cusp", "not on the body", "behind the end", "without a route"],
)
def test_in_an_area_it_is_somewhat_wider_than_the_body(
    hall: Scenario, segments: Any, x: float, gap: float, near: float, direction: int
) -> None:
    triples = [(each["direction"], 0.0, each["length"]) for each in segments or ()]
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), triples) if triples else None
    outline = put(hall, ScriptedPlanner(script=still, planned=lambda now: path), gap, x)
    far = near + direction * THICKNESS
    assert extent(outline) == pytest.approx((min(near, far), -HALF, max(near, far), HALF))


@pytest.mark.parametrize("ground", ["straight", "hall"])
def test_it_is_given_and_kept_for_as_long_as_it_is_there(ground: str, request: pytest.FixtureRequest) -> None:
    controller = Scripted(script=forward)
    result = simulate(blocked(request.getfixturevalue(ground)), controller=controller)
    assert [len(given[3]) for given in controller.given] == [0] * 20 + [1] * 20 + [0] * 21
    assert [begin for begin, _ in result.obstacles] == [0.0, 1.0, 2.0]
    # It stays where it was put: the vehicle has come 1.5 m nearer when it goes, and is 0.5 m inside.
    (wall,) = {outline.tobytes() for given in controller.given for outline in given[3]}
    assert np.frombuffer(wall).reshape(-1, 2)[:, 0].min() == pytest.approx(0.5 + FRONT + 1.0)
    assert summary(result)["min_clearance_m"] == pytest.approx(-0.5, abs=0.02)


def test_it_comes_on_top_of_other_obstacles(straight: Scenario) -> None:
    known, given = Scripted(script=still), Scripted(script=still)
    simulate(changed(blocked(straight), {"corridor.obstacles": [BOX]}), controller=known)
    later = lambda now: [np.array(BOX)] if now > 1.475 else []  # noqa: E731
    simulate(blocked(straight), controller=given, obstacles_at=later)
    assert [len(entry[3]) for entry in known.given[::10]] == [1, 1, 2, 2, 1, 1, 1]
    assert [len(entry[3]) for entry in given.given[::10]] == [0, 0, 1, 2, 1, 1, 1]


@pytest.mark.parametrize("ground", ["straight", "hall"])
def test_without_changes_no_obstacles_are_given(ground: str, request: pytest.FixtureRequest) -> None:
    controller = Scripted(script=still)
    scenario = changed(request.getfixturevalue(ground), {"simulation.duration": 0.2})
    simulate(scenario, controller=controller)
    assert {given[3] for given in controller.given} == {None}
    result = simulate(scenario, controller=controller, obstacles_at=lambda now: [np.array(BOX)])
    ((_, outlines),) = result.obstacles
    assert len(outlines) == 1


# -- obstacles that move -------------------------------------------------------------------------------------

CART = {"polygon": [[6.0, 4.0], [7.0, 4.0], [7.0, 5.0], [6.0, 5.0]], "velocity": [0.0, -0.5]}


def test_a_moving_obstacle_is_given_with_its_velocity_where_it_is_while_it_is_there(
    straight: Scenario,
) -> None:
    cart = {**CART, "from": 0.5, "to": 1.5, "turn_rate": 0.2, "name": "cart"}
    controller = Scripted(script=still)
    simulate(changed(straight, {"simulation.duration": 2.0, "moving": [cart]}), controller=controller)
    times = np.array([given[0] for given in controller.given])
    there = [given[3] for given in controller.given]
    assert [len(each) for each in there] == [int(0.5 <= time <= 1.5) for time in times]
    (last,) = there[int(np.flatnonzero(times <= 1.5)[-1])]
    assert (last.velocity, last.turn_rate, last.name) == ((0.0, -0.5), 0.2, "cart")
    middle = np.asarray(last).mean(axis=0)
    assert middle == pytest.approx([6.5, 4.5 - 0.5 * 1.0])
    turned = np.asarray(last) - middle
    assert np.arctan2(turned[2, 1], turned[2, 0]) == pytest.approx(np.pi / 4 + 0.2)


def test_the_clearance_is_to_where_a_moving_obstacle_is_at_that_time(straight: Scenario) -> None:
    scenario = changed(straight, {"simulation.duration": 10.0, "moving": [CART]})
    figures = summary(simulate(scenario, controller=Scripted(script=still)))
    # It passes in front of the vehicle, which stands 6 m - front away.
    assert figures["min_clearance_m"] == pytest.approx(min(3.0 - HALF + BESIDE, 6.0 - FRONT), abs=0.01)


@pytest.mark.parametrize("velocity", some_of([[0.0, -0.6], [-0.4, 0.0]]), ids=["crosses", "comes towards"])
def test_a_moving_obstacle_is_waited_for_and_not_touched(straight: Scenario, velocity: list[float]) -> None:
    lane = {"path.segments": [{"direction": 1, "curvature": 0, "length": 16}], "corridor.left": 6.0}
    there = {"crosses": [[9.0, 4.0], [10.0, 4.0], [10.0, 5.0], [9.0, 5.0]]}.get(
        "crosses" if velocity[1] else "", [[19.0, 3.5], [20.0, 3.5], [20.0, 4.5], [19.0, 4.5]]
    )
    cart = {"polygon": there, "velocity": velocity, "name": "cart"}
    coarse = {"simulation.duration": 60.0, "simulation.cycle": 0.1}
    result = simulate(changed(straight, {**lane, "moving": [cart], **coarse}))
    figures = summary(result)
    assert figures["docked"]
    assert figures["min_clearance_m"] > 0.0
