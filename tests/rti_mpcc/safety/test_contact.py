from __future__ import annotations

import numpy as np
import pytest
import shapely

from geometry import Corridor, Pose2, ReferencePath
from rti_mpcc.config import ControllerConfig
from rti_mpcc.manoeuvre import segments_of
from rti_mpcc.model.footprint import body_of, body_polygons
from rti_mpcc.model.layout import THETA
from rti_mpcc.ocp.corridor_rows import corridor_rows
from rti_mpcc.planning.obstacles import Obstacle, observed
from rti_mpcc.planning.surroundings import Surroundings
from rti_mpcc.safety import contact
from rti_mpcc.types import Array, Trajectory
from tests.rti_mpcc.encounters import square

CONFIG = ControllerConfig()
LEAST = CONFIG.clearance.least
WALL_AT = 20.0
PATH = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 40.0)])


def corridor(direction: int = 1, wall_at: float | None = WALL_AT, width: float = 3.0) -> Corridor:
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(direction, 0.0, 40.0)])
    walls: list[Array] = []
    if wall_at is not None:
        near, far = direction * wall_at, direction * (wall_at + 0.5)
        walls = [np.array([[near, -3.0], [far, -3.0], [far, 3.0], [near, 3.0]])]
    return Corridor.from_offsets(path, left=width, right=-width, obstacles=walls)


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
    return contact.distance_to_contact(plan, inside, 0, CONFIG, reach, least=LEAST)


@pytest.mark.parametrize(("direction", "ahead"), [(1, CONFIG.vehicle.front), (-1, CONFIG.vehicle.rear)])
def test_the_way_to_a_wall_is_found_within_the_spacing(direction: int, ahead: float) -> None:
    found = way(straight_on(2.0, 30.0, direction=direction), corridor(direction))
    expected = WALL_AT - ahead - 2.0
    assert expected <= found <= expected + CONFIG.caution.check_spacing


def test_nothing_in_the_way_is_infinite() -> None:
    assert way(straight_on(2.0, 30.0), corridor(wall_at=None)) == np.inf
    assert way(straight_on(2.0, 15.0), corridor()) == np.inf


def test_beyond_the_reach_nothing_is_looked_for() -> None:
    assert way(straight_on(2.0, 30.0), corridor(), reach=10.0) == np.inf
    assert way(straight_on(2.0, 30.0), corridor(), reach=16.0) < np.inf


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
    inside, least = corridor(wall_at=None), CONFIG.clearance.least - CONFIG.caution.contact_tolerance
    assert way(beside_the_wall(0.3, 0.3 - least - 0.01), inside) == np.inf
    found = way(beside_the_wall(0.3, 0.3), inside)
    assert found == pytest.approx(10.0 * (0.3 - least) / 0.3, abs=2.0 * CONFIG.caution.check_spacing)


@pytest.mark.parametrize("room", [0.3, 0.02])
def test_to_an_obstacle_all_of_the_hard_minimum_is_kept(room: float) -> None:
    """Whatever the room beside a boundary is."""
    top = 3.0 - room - 0.5 * CONFIG.vehicle.width
    box = np.array([[14.0, -1.0], [15.0, -1.0], [15.0, top - 1.2], [14.0, top - 1.2]])
    for gap, free in ((0.06, True), (0.04, False)):
        box[2:, 1] = top - 0.5 * CONFIG.vehicle.width - gap
        inside = corridor(wall_at=None).with_obstacles([box])
        assert (way(beside_the_wall(room, 0.0), inside) == np.inf) == free


@pytest.mark.parametrize("room", [0.02, 0.0, -0.01])
def test_a_plan_that_begins_nearer_may_leave_and_swing_out_but_not_touch(room: float) -> None:
    inside = corridor(wall_at=None)
    for onwards, free in ((-0.3, True), (0.0, True), (0.5 * max(room, 0.0), True), (room + 0.05, False)):
        assert (way(beside_the_wall(room, onwards), inside) == np.inf) == free


def test_a_plan_that_stands_still_is_checked_where_it_stands() -> None:
    assert way(straight_on(5.0, 5.0), corridor()) == np.inf


def test_the_way_needed_is_that_of_stopping_in_comfort_a_share_more_and_room() -> None:
    room = contact.stop_clearance(CONFIG)
    assert contact.stopping_distance(0.0, CONFIG) == room
    expected = 1.25 * 2.0**2 / (2.0 * CONFIG.comfort_acceleration) + room
    assert contact.stopping_distance(2.0, CONFIG) == pytest.approx(expected)
    assert contact.stopping_distance(-2.0, CONFIG) == pytest.approx(expected)


def test_at_the_stop_clearance_no_row_is_violated_and_there_is_room_to_swing_out() -> None:
    vehicle = CONFIG.vehicle
    room = contact.stop_clearance(CONFIG)
    pose = np.array([[WALL_AT - vehicle.front - room, 0.0, 0.0]])
    found = corridor().contacts(0, body_of(vehicle, 2), pose, within=9.0, outward=0.0)
    assert found.apart[0, 1, 2] == pytest.approx(room)
    rows = corridor_rows(np.zeros(1), found, CONFIG.clearance.wanted, near=9.0)
    assert rows is not None
    assert rows.lower.max() <= 0.0
    assert room > CONFIG.clearance.wanted + CONFIG.caution.check_spacing + 0.3 * vehicle.width


# -- what the body overlaps ----------------------------------------------------------------------------------


def at(x: float, y: float = 0.0) -> Array:
    return np.array([[x, y, 0.0, 0.0, 0.0, x]])


FREE, IN = WALL_AT - CONFIG.vehicle.front - 0.5, WALL_AT - CONFIG.vehicle.front + 0.1
"""Rear axle before the wall, and with the front 0.1 m in it [m]."""
LEFT = 3.0 - 0.5 * CONFIG.vehicle.width
"""Where the flank touches the left boundary [m]."""


def around(inside: Corridor) -> Surroundings:
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 40.0)])
    return Surroundings.of(inside, path, CONFIG)


def test_what_is_overlapped_is_told_with_its_depth_and_its_place() -> None:
    found = contact.overlap(at(IN), around(corridor()), 0, CONFIG)
    assert found is not None
    assert found.what == "obstacles[0]"
    assert found.depth == pytest.approx(0.1, abs=0.01)
    assert found.where == pytest.approx((WALL_AT + 0.05, 0.0), abs=0.01)
    assert str(found) == "the body overlaps obstacles[0] by 0.10 m at (20.05, -0.00)"


@pytest.mark.parametrize(("side", "name"), [(1.0, "the left boundary"), (-1.0, "the right boundary")])
def test_a_boundary_is_told_by_its_side(side: float, name: str) -> None:
    found = contact.overlap(at(10.0, side * (LEFT + 0.2)), around(corridor()), 0, CONFIG)
    assert found is not None
    assert found.what == name
    assert found.depth == pytest.approx(0.2, abs=0.01)


def test_a_body_beyond_a_boundary_overlaps_what_lies_there() -> None:
    found = contact.overlap(at(10.0, 4.5), around(corridor()), 0, CONFIG)
    assert found is not None
    assert found.what == "what lies beyond a boundary"


def test_a_free_body_and_one_that_only_seems_to_touch_overlap_nothing() -> None:
    inside = around(corridor())
    tolerance = CONFIG.caution.contact_tolerance
    assert contact.overlap(at(FREE), inside, 0, CONFIG) is None
    assert contact.overlap(at(10.0, LEFT + 0.9 * tolerance), inside, 0, CONFIG) is None
    assert contact.overlap(at(10.0, LEFT + 1.5 * tolerance), inside, 0, CONFIG) is not None


def test_an_obstacle_is_overlapped_however_little_that_is() -> None:
    inside = around(corridor())
    assert contact.overlap(at(IN - 0.099), inside, 0, CONFIG) is not None
    assert contact.overlap(at(IN - 0.101), inside, 0, CONFIG) is None


def test_the_deepest_of_several_bodies_counts() -> None:
    states = np.concatenate((at(FREE), at(IN), at(IN + 0.1)))
    found = contact.overlap(states, around(corridor()), 0, CONFIG)
    assert found is not None
    assert found.depth == pytest.approx(0.2, abs=0.01)


# -- what moves ----------------------------------------------------------------------------------------------


def walking(x: float, y: float, speed: float, heading: float) -> Obstacle:
    """A square of 0.6 m that has been seen to walk for a while."""
    step = 0.05 * speed * np.array([np.cos(heading), np.sin(heading)])
    known: tuple[Obstacle, ...] = ()
    for k in range(-10, 1):
        corners = square(x + k * step[0], y + k * step[1], 0.6)
        known = observed(known, [corners], 0.05 * k, 0.05 * (k - 1), CONFIG)
    return known[0]


def way_to(walker: Obstacle, plan: Trajectory) -> float:
    return contact.distance_to_moving(plan, [walker], 0.0, CONFIG, np.inf)


def test_who_walks_onto_the_way_in_time_is_met_and_who_walks_off_it_is_not() -> None:
    plan = straight_on(0.0, 20.0)  # 2 m/s, the front is at 13.7 m after 5 s
    assert way_to(walking(15.0, 4.0, 1.0, -0.5 * np.pi), plan) < np.inf
    assert way_to(walking(15.0, 4.0, 1.0, 0.5 * np.pi), plan) == np.inf
    assert way_to(walking(15.0, 14.0, 1.0, -0.5 * np.pi), plan) == np.inf


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


def test_beside_the_leading_edge_it_may_turn_into_any_direction() -> None:
    plan, room = straight_on(0.0, 20.0), 0.5 * CONFIG.vehicle.width + 0.3
    reserve = CONFIG.dead_time + CONFIG.cycle + 2.0 / CONFIG.limits.acceleration
    for beside, met in ((0.5 * reserve, True), (2.0 * reserve + 0.1, False)):
        walker = walking(15.0, room + beside, 1.0, 0.0)  # along with the vehicle
        assert (way_to(walker, plan) < np.inf) == met


def test_boundaries_do_not_fill_the_way_and_obstacles_do() -> None:
    into_both = straight_on(2.0, 30.0, y=2.5)  # over the left boundary all along, and into the wall
    around = Surroundings.of(corridor(), PATH, CONFIG)
    met = contact.distance_to_obstacle(into_both, around.corridor, 0, CONFIG, np.inf)
    expected = WALL_AT - CONFIG.vehicle.front - 2.0
    assert expected <= met <= expected + CONFIG.caution.check_spacing
    assert around.corridor.collides(0, body_polygons(into_both.states, CONFIG.vehicle)).all()
    free = around.corridor.with_obstacles(())
    assert contact.distance_to_obstacle(into_both, free, 0, CONFIG, np.inf) == np.inf
    assert contact.distance_to_obstacle(straight_on(2.0, 15.0), around.corridor, 0, CONFIG, np.inf) == np.inf


def test_what_a_plan_meets_is_met_by_the_body_on_the_path_at_its_own_progress() -> None:
    """Whatever progress the plan has in mind; what only the plan meets counts from beside it."""
    around, front = Surroundings.of(corridor(), PATH, CONFIG), CONFIG.vehicle.front
    segment, met = segments_of(PATH, CONFIG)[0], WALL_AT - front

    def progress(plan: Trajectory, distance: float) -> float:
        return contact.progress_of_contact(plan, distance, around.corridor, segment, CONFIG)

    spacing = CONFIG.caution.check_spacing
    for ahead in (0.0, -3.0, 3.0):
        plan = straight_on(2.0, 30.0)
        plan.states[:, THETA] = plan.states[:, 0] + ahead
        found = progress(plan, met + 0.01 - 2.0)
        assert met <= found <= met + spacing
    aside = straight_on(2.0, 30.0, y=4.0 - 0.01)  # it meets nothing there but the boundary
    aside.states[:, THETA] = aside.states[:, 0]
    assert progress(aside, 5.0) == pytest.approx(7.0)
    assert progress(aside, 0.0) == pytest.approx(2.0)
    assert progress(plan, met + 1.5 - 2.0) == pytest.approx(progress(plan, met + 0.01 - 2.0), abs=spacing)
    passing = straight_on(met + 1.0, 30.0)  # the body on the path meets it all along
    passing.states[:, THETA] = passing.states[:, 0]
    assert progress(passing, 0.5) == pytest.approx(met + 1.5)


def test_an_obstacle_told_some_time_ago_may_be_farther_by_now() -> None:
    plan, walker = straight_on(0.0, 4.0), walking(4.5, 4.4, 1.0, -0.5 * np.pi)
    assert contact.distance_to_moving(plan, [walker], 0.0, CONFIG, 1.0) == np.inf
    assert contact.distance_to_moving(plan, [walker], 0.9, CONFIG, 1.0) < np.inf


def test_between_coarse_stages_nothing_is_missed() -> None:
    """Both ends of a stage are clear, the obstacle between them is met."""
    inside = corridor(width=9.0).with_obstacles([[(9.0, -1.5), (9.3, -1.5), (9.3, 1.5), (9.0, 1.5)]])
    plan = straight_on(0.0, 16.0, n=1)
    assert not inside.collides(0, body_polygons(plan.states, CONFIG.vehicle)).any()
    assert way(plan, inside) < np.inf
