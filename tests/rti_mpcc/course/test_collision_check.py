from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import shapely
import shapely.affinity

from benchmarks.encounters import square
from geometry import Corridor, Pose2, ReferencePath
from rti_mpcc.config import ControllerConfig
from rti_mpcc.config.mpc import CONTACT_TOLERANCE
from rti_mpcc.course import collision_check
from rti_mpcc.course.route_start import CHECK_SPACING
from rti_mpcc.manoeuvre import segments_of
from rti_mpcc.model.actuators import Actuators
from rti_mpcc.model.footprint import body_polygons, clearances
from rti_mpcc.state import ControllerState, Task
from rti_mpcc.types import Array, Obstacle, Trajectory
from rti_mpcc.world.obstacles import Tracked, TrackedObstacle, observed
from rti_mpcc.world.surroundings import Surroundings
from rti_mpcc.world.world import VehicleEstimate

CONFIG = ControllerConfig(dead_time=0.18)
WALL_AT = 20.0


def corridor(direction: int = 1, wall_at: float | None = WALL_AT, width: float = 3.0) -> Corridor:
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(direction, 0.0, 40.0)])
    walls: list[Array] = []
    if wall_at is not None:
        near, far = direction * wall_at, direction * (wall_at + 0.5)
        walls = [np.array([[near, -3.0], [far, -3.0], [far, 3.0], [near, 3.0]])]
    return Corridor.from_offsets(path, left=width, right=-width, obstacles=walls)


PATH = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 40.0)])


def around(inside: Corridor) -> Surroundings:
    return Surroundings.of(inside, PATH, CONFIG)


def known(area: Surroundings) -> ControllerState:
    vehicle = VehicleEstimate(actuators=Actuators.of(CONFIG.actuators))
    return ControllerState(area=area, path=PATH, task=Task.of(segments_of(PATH, CONFIG)), vehicle=vehicle)


def straight_on(begin: float, end: float, *, direction: int = 1, y: float = 0.0, n: int = 20) -> Trajectory:
    """At constant speed from x = `begin` to `end` [m] in 10 s; the stages are coarser than the check."""
    times = np.linspace(0.0, 10.0, n + 1)
    states = np.zeros((n + 1, 6))
    states[:, 0] = direction * np.linspace(begin, end, n + 1)
    states[:, 1] = y
    states[:, 3] = direction * (end - begin) / 10.0
    controls = np.zeros((n, 3))
    controls[:, 2] = (end - begin) / 10.0
    return Trajectory(times=times, states=states, controls=controls)


def way(plan: Trajectory, inside: Corridor, reach: float = np.inf) -> float:
    return collision_check.distance_to_contact(known(around(inside)), plan, CONFIG, reach)


@pytest.mark.parametrize(("direction", "ahead"), [(1, CONFIG.vehicle.front), (-1, CONFIG.vehicle.rear)])
def test_the_way_to_a_wall_is_found_within_the_spacing(direction: int, ahead: float) -> None:
    found = way(straight_on(2.0, 30.0, direction=direction), corridor(direction))
    expected = WALL_AT - ahead - 2.0
    assert expected <= found <= expected + CHECK_SPACING


def test_a_plan_that_leaves_the_corridor_makes_contact() -> None:
    plan = straight_on(2.0, 30.0)
    states = plan.states.copy()
    states[:, 1] = np.linspace(0.0, 4.0, len(states))
    leaving = Trajectory(times=plan.times, states=states, controls=plan.controls)
    # The body's side reaches 3 m where y is about 2 m: half the way.
    assert way(leaving, corridor(wall_at=None)) == pytest.approx(14.0, abs=1.0)


def beside_the_wall(room: float, onwards: float) -> Trajectory:
    """Begins with so much room to the left wall [m], and comes so much nearer to it [m]."""
    begin = straight_on(2.0, 12.0, y=3.0 - 0.5 * CONFIG.vehicle.width - room)
    states = begin.states.copy()
    states[:, 1] += np.linspace(0.0, onwards, len(states))
    return Trajectory(times=begin.times, states=states, controls=begin.controls)


def test_no_plan_is_clear_that_comes_nearer_to_a_boundary_than_the_hard_minimum_less_noise() -> None:
    inside, least = corridor(wall_at=None), CONFIG.clearance.least - CONTACT_TOLERANCE
    assert way(beside_the_wall(0.3, 0.3 - least - 0.01), inside) == np.inf
    found = way(beside_the_wall(0.3, 0.3), inside)
    assert found == pytest.approx(10.0 * (0.3 - least) / 0.3, abs=2.0 * CHECK_SPACING)


@pytest.mark.parametrize("room", [0.02, 0.0, -0.01])
def test_a_plan_that_begins_nearer_may_leave_and_swing_out_but_not_touch(room: float) -> None:
    inside = corridor(wall_at=None)
    for onwards, free in ((-0.3, True), (0.0, True), (0.5 * max(room, 0.0), True), (room + 0.05, False)):
        assert (way(beside_the_wall(room, onwards), inside) == np.inf) == free


def test_the_way_needed_is_that_of_stopping_in_comfort_a_share_more_and_room() -> None:
    room = collision_check.stop_clearance(CONFIG)
    assert collision_check.stopping_distance(0.0, CONFIG) == room
    expected = 1.25 * 2.0**2 / (2.0 * CONFIG.comfort_acceleration) + room
    assert collision_check.stopping_distance(2.0, CONFIG) == pytest.approx(expected)
    assert collision_check.stopping_distance(-2.0, CONFIG) == pytest.approx(expected)


# -- what the body overlaps ----------------------------------------------------------------------------------


def at(x: float, y: float = 0.0) -> Array:
    return np.array([[x, y, 0.0, 0.0, 0.0, x]])


FREE, IN = WALL_AT - CONFIG.vehicle.front - 0.5, WALL_AT - CONFIG.vehicle.front + 0.1
"""Rear axle before the wall, and with the front 0.1 m in it [m]."""
LEFT = 3.0 - 0.5 * CONFIG.vehicle.width
"""Where the flank touches the left boundary [m]."""


def test_what_is_overlapped_is_told_with_its_depth_and_its_place() -> None:
    found = collision_check.overlap(at(IN), around(corridor()), 0, CONFIG)
    assert found is not None
    assert found.what == "obstacles[0]"
    assert found.depth == pytest.approx(0.1, abs=0.01)
    assert found.where == pytest.approx((WALL_AT + 0.05, 0.0), abs=0.01)
    assert str(found) == "the body overlaps obstacles[0] by 0.10 m at (20.05, -0.00)"


@pytest.mark.parametrize(("side", "name"), [(1.0, "the left boundary"), (-1.0, "the right boundary")])
def test_a_boundary_is_told_by_its_side(side: float, name: str) -> None:
    found = collision_check.overlap(at(10.0, side * (LEFT + 0.2)), around(corridor()), 0, CONFIG)
    assert found is not None
    assert found.what == name
    assert found.depth == pytest.approx(0.2, abs=0.01)


# -- what moves ----------------------------------------------------------------------------------------------


def walking(x: float, y: float, speed: float, heading: float) -> TrackedObstacle:
    """A square of 0.6 m that has been seen to walk for a while."""
    step = 0.05 * speed * np.array([np.cos(heading), np.sin(heading)])
    known: tuple[TrackedObstacle, ...] = ()
    for k in range(-10, 1):
        corners = square(x + k * step[0], y + k * step[1], 0.6)
        known = observed(known, [corners], 0.05 * k, 0.05 * (k - 1))
    return known[0]


def way_to(walker: TrackedObstacle, plan: Trajectory) -> float:
    area = replace(around(corridor(wall_at=None)), tracked=Tracked((walker,)))
    return collision_check.distance_to_moving(known(area), plan, CONFIG)


def test_what_moves_is_met_where_another_library_says() -> None:
    """Equation (S1), body by body."""
    random, met = np.random.default_rng(8), 0
    least, limits = CONFIG.clearance.least, CONFIG.limits
    for _ in range(40):
        plan = straight_on(0.0, 20.0)
        walker = walking(*random.uniform((4.0, -8.0), (20.0, 8.0)), *random.uniform((0.3, -3.1), (2.0, 3.1)))
        expected = np.inf
        for mark in np.arange(101) * 0.2:  # at 2 m/s
            elapsed = CONFIG.dead_time + 0.5 * mark
            body = body_polygons(np.array([[mark, 0.0, 0.0]]), CONFIG.vehicle)[0]
            corners = np.concatenate((walker.outline, walker.outline + elapsed * walker.velocity))
            covered = shapely.MultiPoint(corners).convex_hull
            reach = walker.speed * (CONFIG.dead_time + CONFIG.cycle + 2.0 / limits.acceleration)
            edge = shapely.LineString(body[1:3])
            if covered.dwithin(shapely.Polygon(body), least) or covered.dwithin(edge, least + reach):
                expected = mark
                break
        assert way_to(walker, plan) == pytest.approx(expected)
        met += expected < np.inf
    assert 5 < met < 35


def test_a_gate_that_swings_is_met_at_the_latest_where_it_is_by_then() -> None:
    """Bars turn about their middles into a lane that is driven at 2 m/s."""
    random, met = np.random.default_rng(9), 0
    for _ in range(60):
        place, turn_rate = random.uniform((5.0, 1.5), (20.0, 4.5)), float(random.uniform(-0.8, 0.8))
        bar = shapely.affinity.rotate(shapely.box(-2.0, -0.05, 2.0, 0.05), random.uniform(0.0, 360.0))
        bar = shapely.affinity.translate(bar, *place)
        gate = Obstacle(shapely.get_coordinates(bar)[:-1], (0.0, 0.0), turn_rate)
        (walker,) = observed((), [gate], 0.0, -0.05)
        found = way_to(walker, straight_on(0.0, 20.0))
        for mark in np.arange(101) * 0.2:
            body = shapely.Polygon(body_polygons(np.array([[mark, 0.0, 0.0]]), CONFIG.vehicle)[0])
            angle = turn_rate * (CONFIG.dead_time + 0.5 * mark)
            if shapely.affinity.rotate(bar, angle, use_radians=True).intersects(body):
                met += 1
                assert found <= mark + 1e-9
                break
    assert met > 5


def test_between_coarse_stages_nothing_is_missed() -> None:
    """Both ends of a stage are clear, the obstacle between them is met."""
    inside = corridor(width=9.0).with_obstacles([[(9.0, -1.5), (9.3, -1.5), (9.3, 1.5), (9.0, 1.5)]])
    plan = straight_on(0.0, 16.0, n=1)
    assert (clearances(plan.states, inside, 0, CONFIG.vehicle) > 0.0).all()
    assert way(plan, inside) < np.inf
