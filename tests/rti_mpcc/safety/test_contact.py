from __future__ import annotations

import numpy as np
import pytest

from geometry import Corridor, HalfPlanes, Pose2, ReferencePath
from rti_mpcc.config import ControllerConfig, Footprint
from rti_mpcc.model.footprint import body_polygons, cover, disc_centres
from rti_mpcc.ocp.corridor_rows import corridor_rows
from rti_mpcc.safety import contact
from rti_mpcc.safety.ladder import SPARE, braking
from rti_mpcc.types import Array, Trajectory
from tests.rti_mpcc.corners import no_corners

CONFIG = ControllerConfig()
WALL_AT = 20.0


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
    return contact.way_to_contact(plan, inside, 0, CONFIG, reach)


@pytest.mark.parametrize(("direction", "ahead"), [(1, CONFIG.vehicle.front), (-1, CONFIG.vehicle.rear)])
def test_the_way_to_a_wall_is_found_within_the_spacing(direction: int, ahead: float) -> None:
    found = way(straight_on(2.0, 30.0, direction=direction), corridor(direction))
    expected = WALL_AT - ahead - 2.0
    assert expected <= found <= expected + contact.SPACING


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


def test_a_body_that_touches_already_may_leave_but_not_press_on() -> None:
    inside = corridor(wall_at=None, width=3.0)
    y = 3.0 - 0.5 * CONFIG.vehicle.width + 0.05
    begin = straight_on(2.0, 12.0, y=y)
    outwards, inwards = begin.states.copy(), begin.states.copy()
    outwards[:, 1] += np.linspace(0.0, 0.3, len(outwards))
    inwards[:, 1] -= np.linspace(0.0, 0.3, len(inwards))
    leave = Trajectory(times=begin.times, states=inwards, controls=begin.controls)
    press = Trajectory(times=begin.times, states=outwards, controls=begin.controls)
    assert inside.collides(0, body_polygons(begin.states[:1], CONFIG.vehicle)).all()
    assert way(leave, inside) == np.inf
    assert way(press, inside) == pytest.approx(10.0 * contact.LET_OUT / 0.3, abs=2.0 * contact.SPACING)


def test_a_body_that_touches_may_go_as_deep_as_braking_fully_would() -> None:
    """Steered straight it stays where it is; turned to the wall it goes into it before it stands."""
    inside = corridor(wall_at=None, width=3.0)
    times, y = np.linspace(0.0, 2.0, 21), 3.0 - 0.5 * CONFIG.vehicle.width + 0.05
    deep = straight_on(2.0, 8.0, y=y)
    states = np.zeros((21, 6))
    states[:, 0], states[:, 3] = np.linspace(2.0, 6.0, 21), 2.0
    states[:, 1] = y + np.linspace(0.0, 0.45, 21)
    states[:, 2] = np.arctan2(0.45, 4.0)
    for steering, free in ((0.0, False), (0.6, True)):
        states[:, 4] = steering
        plan = Trajectory(times=times, states=states.copy(), controls=np.zeros((20, 3)))
        found = contact.touched(None, states[0], inside, 0, CONFIG)
        assert (contact.way_to_contact(plan, inside, 0, CONFIG, np.inf, found) == np.inf) == free
    assert way(deep, inside) == np.inf


def test_a_plan_that_stands_still_is_checked_where_it_stands() -> None:
    assert way(straight_on(5.0, 5.0), corridor()) == np.inf


def test_the_stopping_distance_is_that_of_the_braking_and_a_spare() -> None:
    assert contact.stopping_distance(0.0, CONFIG) == SPARE
    expected = 2.0**2 / (2.0 * braking(CONFIG)) + SPARE
    assert contact.stopping_distance(2.0, CONFIG) == pytest.approx(expected)
    assert contact.stopping_distance(-2.0, CONFIG) == pytest.approx(expected)


@pytest.mark.parametrize("discs", [1, 3, 5])
def test_at_the_stop_clearance_the_discs_are_free(discs: int) -> None:
    """Where the body stops so far before a wall, no corridor row is violated."""
    config = ControllerConfig(footprint=Footprint(discs=discs))
    stop = WALL_AT - config.vehicle.front - contact.stop_clearance(config)
    shape = cover(config.vehicle, discs)
    centres = disc_centres(np.array([[stop, 0.0, 0.0, 0.0, 0.0, stop]]), shape)
    gap = WALL_AT - centres[0, :, 0].max() - shape.radius
    assert gap >= config.footprint.margin
    assert gap == pytest.approx(config.footprint.margin + contact.SPACING)


def test_what_a_wall_ahead_hides_from_the_rows_is_found() -> None:
    """(H6): a post at the body's corner, farther from the disc's centre than the wall ahead of it."""
    vehicle, end, half = CONFIG.vehicle, 15.0, 0.5 * CONFIG.vehicle.width
    front = end + vehicle.front
    boxes = ((front + 0.2, front + 0.5, -1.5, 1.5), (front - 0.1, front + 0.1, half - 0.1, half + 0.5))
    outlines = [np.array([[a, c], [b, c], [b, d], [a, d]]) for a, b, c, d in boxes]
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 40.0)])
    inside = Corridor.from_offsets(path, left=3.0, right=-3.0, obstacles=outlines)
    plan, discs = straight_on(10.0, end), cover(vehicle, CONFIG.footprint.discs)
    planes = inside.half_planes(0, disc_centres(plan.states[1:], discs).reshape(-1, 2))
    footprint = CONFIG.footprint
    rows = corridor_rows(plan.states[1:], planes, discs, footprint.margin, footprint.near, no_corners)
    assert rows is not None
    assert rows.lower[-1].max() <= 0.0
    assert not contact.surely_clear(plan, planes, inside, 0, CONFIG, np.inf)
    assert way(plan, inside) < np.inf


# -- what touches already ------------------------------------------------------------------------------------


def at(x: float, v: float = 0.0) -> Array:
    return np.array([x, 0.0, 0.0, v, 0.0, x])


FREE, IN = WALL_AT - CONFIG.vehicle.front - 0.5, WALL_AT - CONFIG.vehicle.front + 0.1
"""Rear axle before the wall, and with the front 0.1 m in it [m]."""


def touched(before: float | None, state: Array) -> float | None:
    return contact.touched(before, state, corridor(), 0, CONFIG)


def test_a_body_that_is_free_has_not_touched_anything() -> None:
    assert touched(None, at(FREE)) is None
    assert touched(-0.3, at(FREE)) is None


@pytest.mark.parametrize("speed", [0.0, 1.0, 1.5])
def test_what_can_still_be_kept_is_known_when_the_contact_begins(speed: float) -> None:
    found = touched(None, at(IN, speed))
    way = 0.1 + speed**2 / (2.0 * CONFIG.limits.acceleration)
    assert found == pytest.approx(-way, abs=0.01)
    assert touched(-0.7, at(IN, speed)) == -0.7


def test_a_body_is_let_out_of_a_contact_and_not_through_it() -> None:
    inside, through = corridor(), straight_on(IN, IN + 5.0, n=100)
    out = straight_on(IN, IN - 5.0, n=100)
    assert contact.way_to_contact(out, inside, 0, CONFIG, np.inf, -0.1) == np.inf
    found = contact.way_to_contact(through, inside, 0, CONFIG, np.inf, -0.1)
    assert found == pytest.approx(contact.LET_OUT, abs=contact.SPACING)
    deeper = straight_on(IN + contact.LET_OUT + 0.1, IN + 5.0, n=100)
    # Where it began counts, not where it is by now.
    assert contact.way_to_contact(deeper, inside, 0, CONFIG, np.inf, -0.1) == 0.0


def test_going_deeper_is_told_from_standing_and_coming_out() -> None:
    inside = corridor()
    assert contact.deepens(straight_on(IN, IN + 0.2), inside, 0, CONFIG)
    assert not contact.deepens(straight_on(IN, IN), inside, 0, CONFIG)
    assert not contact.deepens(straight_on(IN, IN - 2.0), inside, 0, CONFIG)
    assert not contact.deepens(straight_on(2.0, 5.0), inside, 0, CONFIG)


DISCS = cover(CONFIG.vehicle, CONFIG.footprint.discs)


def planes_of(plan: Trajectory, inside: Corridor) -> HalfPlanes:
    return inside.half_planes(0, disc_centres(plan.states[1:], DISCS).reshape(-1, 2))


def wavy(seed: int, n: int = 20) -> Trajectory:
    """A plan that turns and goes about between walls; its states jump a little from what they should be."""
    random = np.random.default_rng(seed)
    times = np.linspace(0.0, 10.0, n + 1)
    states = np.zeros((n + 1, 6))
    speed, steering = random.uniform(0.5, 3.0), np.cumsum(random.normal(0.0, 0.1, n + 1)).clip(-0.5, 0.5)
    for k in range(n):
        h, rate = times[k + 1] - times[k], speed * np.tan(steering[k]) / CONFIG.vehicle.wheelbase
        x, y, phi = states[k, :3]
        middle = phi + 0.5 * h * rate
        states[k + 1, :3] = x + h * speed * np.cos(middle), y + h * speed * np.sin(middle), phi + h * rate
    states[:, :2] += random.normal(0.0, 0.02, (n + 1, 2))
    states[:, 3], states[:, 4] = speed, steering
    return Trajectory(times=times, states=states, controls=np.zeros((n, 3)))


def moved(plan: Trajectory, by: float, seed: int) -> Trajectory:
    shift = np.random.default_rng(seed).normal(0.0, by, (len(plan.states), 6)) * (1, 1, 0.3, 0, 0, 0)
    return Trajectory(times=plan.times, states=plan.states + shift, controls=plan.controls)


@pytest.mark.parametrize("seed", range(40))
def test_what_is_surely_clear_makes_no_contact(seed: int) -> None:
    random = np.random.default_rng(seed)
    around = [corridor(width=width) for width in (3.0, 5.0, 9.0)]
    plan = wavy(seed)
    for inside in around:
        for by in (0.0, 0.1, 0.4):
            solved = moved(plan, by, seed)
            reach = float(random.choice([0.0, 3.0, 8.0, np.inf]))
            if contact.surely_clear(solved, planes_of(plan, inside), inside, 0, CONFIG, reach):
                assert way(solved, inside, reach) == np.inf


def test_what_is_well_clear_surely_is() -> None:
    inside, plan = corridor(), straight_on(2.0, 8.0)
    planes = planes_of(plan, inside)
    assert contact.surely_clear(plan, planes, inside, 0, CONFIG, np.inf)
    assert contact.surely_clear(moved(plan, 0.05, 0), planes, inside, 0, CONFIG, np.inf)
    # Known from the cycles before, and not looked up again.
    again = inside.half_planes(
        0, disc_centres(plan.states[1:], DISCS).reshape(-1, 2) + 0.1, planes, within=1.5
    )
    assert not again.normal.any()
    assert contact.surely_clear(plan, again, inside, 0, CONFIG, np.inf)


def test_what_is_not_known_to_be_clear_is_not_surely() -> None:
    inside, plan = corridor(), straight_on(2.0, 8.0)
    planes = planes_of(plan, inside)
    onto_the_wall = straight_on(2.0, 30.0, n=60)
    assert not contact.surely_clear(plan, None, inside, 0, CONFIG, np.inf)
    assert not contact.surely_clear(straight_on(2.0, 8.0, n=21), planes, inside, 0, CONFIG, np.inf)
    assert not contact.surely_clear(plan, planes, corridor(wall_at=6.0), 0, CONFIG, np.inf)
    assert not contact.surely_clear(straight_on(2.0, 8.0, y=1.9), planes, inside, 0, CONFIG, np.inf)
    on = planes_of(onto_the_wall, inside)
    assert not contact.surely_clear(onto_the_wall, on, inside, 0, CONFIG, np.inf)
    assert contact.surely_clear(onto_the_wall, on, inside, 0, CONFIG, 5.0)


def test_between_coarse_stages_nothing_is_missed() -> None:
    """Both ends of a stage are clear, the obstacle between them is met."""
    inside = corridor(width=9.0).with_obstacles([[(9.0, -1.5), (9.3, -1.5), (9.3, 1.5), (9.0, 1.5)]])
    plan = straight_on(0.0, 16.0, n=1)
    assert not inside.collides(0, body_polygons(plan.states, CONFIG.vehicle)).any()
    assert way(plan, inside) < np.inf
    assert not contact.surely_clear(plan, planes_of(plan, inside), inside, 0, CONFIG, np.inf)


def test_a_body_is_surely_clear_near_where_the_plan_is() -> None:
    inside, plan = corridor(), straight_on(2.0, 8.0)
    planes = planes_of(plan, inside)
    assert contact.body_surely_clear(plan.states[0], planes, inside, 0, CONFIG)
    assert not contact.body_surely_clear(plan.states[0], None, inside, 0, CONFIG)
    assert not contact.body_surely_clear(plan.states[0], planes, corridor(wall_at=6.0), 0, CONFIG)
    for y in np.linspace(-3.0, 3.0, 25):
        state = straight_on(2.0, 8.0, y=float(y)).states[0]
        if contact.body_surely_clear(state, planes, inside, 0, CONFIG):
            assert contact.touched(None, state, inside, 0, CONFIG) is None
