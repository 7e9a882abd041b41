"""Exact checks of the body: what it overlaps, and how far along a plan it stays clear.

A body is clear if it is farther than `Clearance.least` from all static obstacles, and from boundaries less
`CONTACT_TOLERANCE`, since measurements are noisy. A plan that starts nearer than twice that distance may
come nearer by half of what there is, to swing the other end of the body out, but must not touch anything.
The next motion of an obstacle with outline O and velocity v_o is not known:

(S1)  dist(body(t), hull(O, O + v_o t)) > d_min,  dist(edge(t), hull(O, O + v_o t)) > d_min + |v_o| t_stop,
      t_stop = dead time + cycle + |v| / a_max

for all times t of the plan: the obstacle may continue or stop, and near the leading edge of the body it may
turn into any direction while the vehicle needs t_stop to stand. One that turns about its middle covers more
by its radius times the angle, and at most by twice its radius.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import ceil, cos, hypot, inf, sin
from typing import NamedTuple

import numpy as np
import shapely

from geometry import Area
from geometry.compiled import Array1, Array2, IndexOut1, kernel
from geometry.convex import VALUE, WITNESS, distance_between, swept
from geometry.corridor import space_around
from geometry.free_space import distances_in
from geometry.outline import shape_of
from geometry.shape_grid import BodyFrame, in_frame
from rti_mpcc.config import ControllerConfig
from rti_mpcc.config.mpc import CONTACT_TOLERANCE
from rti_mpcc.course.context import PlanningContext
from rti_mpcc.course.route_start import CHECK_SPACING
from rti_mpcc.model.actuators import roll_forward
from rti_mpcc.model.footprint import body_of, body_polygons, box_of, clearances
from rti_mpcc.model.layout import PHI, POSE, V, X, Y
from rti_mpcc.ocp.horizon import distances, states_at
from rti_mpcc.state import ControllerState
from rti_mpcc.types import Array, Trajectory
from rti_mpcc.world.obstacles import TrackedObstacle
from rti_mpcc.world.surroundings import Surroundings

STOP_SHARE = 0.25  # more of the route than braking in comfort takes is checked for a stop
SWING_CLEARANCE = 0.33  # of the body's width, left to swing out past what blocks the route
CLEAR_DISTANCE = 0.5  # [m] that have to be clear beyond what a stop needs, to drive on
OVERLAP_GROWTH = 0.01  # [m], for rounding, by which a plan that starts in an overlap may go deeper

MOST_BODIES = 5_000  # checked along a plan: a kilometre, so that no plan makes a cycle long


class Overlap(NamedTuple):
    """What a body overlaps: how deep [m], what it is, and where (x, y) [m]."""

    depth: float
    what: str
    where: tuple[float, float]

    def __str__(self) -> str:
        x, y = self.where
        return f"the body overlaps {self.what} by {self.depth:.2f} m at ({x:.2f}, {y:.2f})"


def overlap_now(s: ControllerState, context: PlanningContext) -> Overlap | None:
    """What the body overlaps, at its estimated state now or until the command starts to act."""
    estimate = s.vehicle.monitor.state
    if estimate is None:
        return None
    half = s.clock.now + 0.5 * s.vehicle.dead_time
    middle = roll_forward(estimate, s.queue, s.clock.now, half, context.config, s.vehicle.disturbance)
    return overlap(np.array((estimate, middle, context.state)), s.area, s.task.segment.index, context.config)


def overlap(states: Array, surroundings: Surroundings, part: int, config: ControllerConfig) -> Overlap | None:
    """What the bodies at `states` (n, 6) overlap most; boundaries count from `CONTACT_TOLERANCE` on."""
    apart = clearances(states, surroundings.known, part, config.vehicle, config.clearance.least)
    if not np.count_nonzero(apart < 0.0):
        return None
    depths = -apart
    depths[depths[:, 0] <= CONTACT_TOLERANCE, 0] = 0.0
    depth = depths.max(axis=1)
    deepest = int(np.argmax(depth))
    if depth[deepest] <= 0.0:
        return None
    met = nearest_object(states[deepest, :POSE], surroundings, part, config, within=0.0)
    return Overlap(float(depth[deepest]), *met)


def clear_distance(
    s: ControllerState, plan: Trajectory, config: ControllerConfig, reach: float = inf, later: float = 0.0
) -> float:
    """Distance along a plan to the first body that is not clear of something [m], or inf."""
    moving = distance_to_moving(s, plan, config, reach, later) if s.area.tracked.moving else inf
    return min(moving, distance_to_contact(s, plan, config, reach))


def distance_to_contact(
    s: ControllerState, plan: Trajectory, config: ControllerConfig, reach: float = inf
) -> float:
    """Distance along a plan to the first body too near to anything static [m], or inf."""
    marks, _, states = bodies_along(plan, config, reach)
    space, least = space_around(s.area.corridor, s.task.segment.index), config.clearance.least
    # At the start of the plan distances up to twice the least one count.
    within, poses = max(2.0 * least, CONTACT_TOLERANCE), np.ascontiguousarray(states[:, :POSE])
    apart = distances_in(space, body_of(config.vehicle), poses, within)
    first = _first_too_near(apart, least, max(least - CONTACT_TOLERANCE, 0.0))
    return inf if first < 0 else float(marks[first])


@kernel
def _first_too_near(apart: Array2, least: float, to_boundary: float) -> int:
    """The first body, at distances (n, 1 + obstacles) [m], that is nearer to something than a plan may come
    that starts as far from it as this one; -1: none."""
    for n in range(len(apart)):
        for j in range(apart.shape[1]):
            begins, kept = apart[0, j], to_boundary if j == 0 else least
            nearest = begins - OVERLAP_GROWTH if begins < 0.0 else min(max(begins - kept, 0.0), kept)
            if apart[n, j] < nearest:
                return n
    return -1


def first_blocked(s: ControllerState, states: Array, config: ControllerConfig) -> int | None:
    """The first of the bodies at `states` (n, 6) that touches a static obstacle, or None.

    In another area than that of the route, what is solid there counts, too.
    """
    space, poses = space_around(s.area.corridor, s.task.segment.index), np.ascontiguousarray(states[:, :POSE])
    apart = distances_in(space, body_of(config.vehicle), poses, config.clearance.least)
    blocked = (apart[:, 1:] <= 0.0).any(axis=1)
    if s.area.replaced:
        blocked |= apart[:, 0] <= -CONTACT_TOLERANCE
    return int(np.argmax(blocked)) if blocked.any() else None


def distance_to_moving(
    s: ControllerState, plan: Trajectory, config: ControllerConfig, reach: float = inf, later: float = 0.0
) -> float:
    """Distance along a plan, started `later` [s], to where it may meet a moving obstacle, (S1) [m]."""
    marks, times, states = bodies_along(plan, config, reach)
    ahead = s.clock.now - s.area.given_at + later
    elapsed = ahead + s.vehicle.dead_time + (times - plan.times[0])
    stop = s.vehicle.braking_delay + config.cycle + np.abs(states[:, V]) / config.limits.acceleration
    body, near = box_of(config.vehicle).corners, np.zeros(len(marks), dtype=np.int64)
    x, y, around = _circle_around(states, body)
    latest, longest = float(elapsed[-1]), float(stop.max())
    for obstacle in s.area.tracked.moving:
        speed, turning, swings = obstacle.speed, obstacle.turning, 2.0 * obstacle.radius
        middle_x, middle_y, radius = obstacle.checked.circle
        covers = radius + swings + speed * latest + (speed + turning) * longest
        if hypot(middle_x - x, middle_y - y) > around + covers + config.clearance.least:
            continue  # out of reach
        apart = np.minimum(turning * elapsed, swings) + config.clearance.least
        ahead_apart = apart + (speed + turning) * stop
        moved = elapsed[:, None] * obstacle.velocity
        near |= _may_collide(body, states, obstacle.checked.hull, moved, apart, ahead_apart)
    return float(marks[np.argmax(near)]) if near.any() else inf


def _circle_around(states: Array, body: Array) -> tuple[float, float, float]:
    """A circle around all bodies with corners `body` (m, 2) at `states` (n, 6): x, y and radius [m]."""
    places = states[:, [X, Y]]
    x, y = places.mean(axis=0).tolist()
    return x, y, float(np.hypot(*(places - (x, y)).T).max() + np.hypot(*body.T).max())


@kernel
def _may_collide(
    body: Array2, states: Array2, hull: Array2, moved: Array2, least: Array1, ahead: Array1
) -> IndexOut1:
    """Equation (S1): 1 (n,) where one of the bodies at `states` (n, 6) may meet a hull, `moved` (n, 2) by
    then: nearer than `least` (n,), or its leading edge nearer than `ahead` (n,) [m]."""
    near = np.zeros(len(states), dtype=np.int64)
    covered, seen = np.empty((len(hull) + 2, 2)), np.empty((len(hull) + 2, 2))
    edge, witness = np.empty((2, 2)), np.empty(WITNESS)
    for n in range(len(states)):
        count = swept(hull, moved[n, X], moved[n, Y], covered)
        frame = BodyFrame(states[n, X], states[n, Y], cos(states[n, PHI]), sin(states[n, PHI]))
        in_frame(covered, 0, count, frame, seen)
        distance_between(body, seen[:count], inf, witness)
        if witness[VALUE] <= least[n]:
            near[n] = 1
        # The leading edge: corners 1 and 2 are those at the front.
        first = 1 if states[n, V] >= 0.0 else 3
        for j in range(2):
            k = (first + j) % len(body)
            edge[j, 0], edge[j, 1] = body[k, 0], body[k, 1]
        distance_between(edge, seen[:count], inf, witness)
        if witness[VALUE] <= ahead[n]:
            near[n] = 1
    return near


def object_ahead(
    s: ControllerState, plan: Trajectory, distance: float, config: ControllerConfig
) -> NearObject:
    """What a plan meets after `distance` [m]."""
    times = _times(plan, distances(plan.states), np.array([distance]))
    (state,) = states_at(plan, times, config.vehicle.wheelbase)
    ahead = s.clock.now - s.area.given_at + s.vehicle.dead_time + float(times[0] - plan.times[0])
    return nearest_object(state, s.area, s.task.segment.index, config, ahead)


def bodies_along(
    plan: Trajectory, config: ControllerConfig, reach: float = inf
) -> tuple[Array, Array, Array]:
    """Distances along the plan (n,) [m] up to `reach`, at most `MOST_BODIES`, times [s] and states (n, 6)."""
    spacing, driven = CHECK_SPACING, distances(plan.states)
    end = min(reach, float(driven[-1]), MOST_BODIES * spacing)
    count = max(ceil(end / spacing), 1)
    marks = np.arange(count + 1.0) * (end / count)
    times = _times(plan, driven, marks)
    return marks, times, states_at(plan, times, config.vehicle.wheelbase)


def _times(plan: Trajectory, driven: Array, marks: Array) -> Array:
    """When (n,) [s] a plan that has `driven` (N+1,) [m] comes to the distances `marks` (n,) [m]."""
    end = int(driven.searchsorted(driven[-1] - 1e-9)) + 1  # it stands from there on
    return np.interp(marks, driven[:end], plan.times[:end])


def stop_clearance(config: ControllerConfig) -> float:
    """Distance that a planned stop keeps from what blocks the route [m], with room to swing out past it."""
    return SWING_CLEARANCE * config.vehicle.width + config.clearance.wanted + CHECK_SPACING


def stopping_distance(speed: float, config: ControllerConfig) -> float:
    """Way that a vehicle at `speed` [m/s] needs to stop in comfort [m], a share more, and room to go on."""
    in_comfort = speed**2 / (2.0 * config.comfort_acceleration)
    return (1.0 + STOP_SHARE) * in_comfort + stop_clearance(config)


# -- the name and place of what a body meets, for the reasons of a command --------------------------------

NEAR = 1.0  # [m]; what is farther from a body is not met by it
MOST_NAMED = 100  # obstacles of an area; with more it is a map, and the number of a rectangle says nothing


class NearObject(NamedTuple):
    """What a body meets, and where (x, y) [m]."""

    what: str
    where: tuple[float, float]

    def __str__(self) -> str:
        x, y = self.where
        return f"{self.what} at ({x:.2f}, {y:.2f})"


class _Near(NamedTuple):
    """Something near a body: how far it is in effect [m], its name and its shape."""

    apart: float
    what: str
    shape: shapely.Geometry


def nearest_object(
    state: Array,
    surroundings: Surroundings,
    part: int,
    config: ControllerConfig,
    ahead: float = 0.0,
    within: float = NEAR,
) -> NearObject:
    """What a body overlaps, or else what is nearest to it.

    Args:
        state: (>= 3,) x, y, phi of the body, and v if it has six entries.
        ahead: time from when the obstacles were given [s], over which they may move.
        within: farthest distance of what is named [m].
    """
    body = shapely.Polygon(body_polygons(state[None], config.vehicle)[0])
    speed = abs(float(state[V])) if len(state) > V else 0.0
    stop = config.dead_time + config.cycle + speed / config.limits.acceleration
    near = [_obstacle(each, body, ahead, stop) for each in surroundings.tracked.obstacles]
    for name, lines in zip(("left", "right"), surroundings.known.lines(part), strict=True):
        shapes = map(shapely.LineString, lines)
        near += [_Near(body.distance(line), f"the {name} boundary", line) for line in shapes]
    if surroundings.known.area is not None:
        near += _solid_near(body, surroundings.known.area)
    nearest = min(near, key=lambda each: each.apart, default=None)
    if nearest is None or nearest.apart > within:
        return NearObject("what lies beyond a boundary", (body.centroid.x, body.centroid.y))
    overlap = body.intersection(nearest.shape)
    if not overlap.is_empty:
        return NearObject(nearest.what, (overlap.centroid.x, overlap.centroid.y))
    (x, y), _ = shapely.shortest_line(nearest.shape, body).coords
    return NearObject(nearest.what, (x, y))


def _obstacle(obstacle: TrackedObstacle, body: shapely.Polygon, ahead: float, stop: float) -> _Near:
    """An obstacle; one that moves is met as far before it as it gets while the vehicle stops, Eq. (S1)."""
    shape, name = obstacle.shape, obstacle.name or f"obstacles[{obstacle.index}]"
    if not obstacle.moves:
        return _Near(body.distance(shape), name, shape)
    moved = shapely.transform(shape, lambda corners: corners + ahead * obstacle.velocity)
    covered = shapely.convex_hull(shapely.union_all([shape, moved]))
    return _Near(body.distance(covered) - stop * (obstacle.speed + obstacle.turning), name, covered)


def _solid_near(body: shapely.Polygon, area: Area) -> Iterator[_Near]:
    """The convex pieces of an area's obstacles near a body."""
    middle, around = body.centroid, shapely.get_coordinates(body)
    reach = NEAR + float(np.hypot(*(around - (middle.x, middle.y)).T).max())
    circles, starts = area.grid.circles, area.grid.starts
    apart = np.hypot(circles[:, 0] - middle.x, circles[:, 1] - middle.y) - circles[:, 2]
    for k in np.flatnonzero(apart <= reach).tolist():
        corners = area.grid.corners[starts[k] : starts[k + 1]]
        piece = shape_of(corners)
        if (far := body.distance(piece)) <= NEAR:
            yield _Near(far, _name_in(area, corners), piece)


def _name_in(area: Area, corners: Array) -> str:
    """The name of what a convex piece with these corners (m, 2) belongs to: they are corners of that."""
    if len(area.obstacles) <= MOST_NAMED:
        for k, ring in enumerate(area.obstacles):
            if (corners[:, None] == ring).all(axis=2).any(axis=1).all():
                return f"area.obstacles[{k}]"
    inside = shape_of(corners).centroid
    beyond = area.boundary is not None and not shapely.Polygon(area.boundary).intersects(inside)
    return "the area's boundary" if beyond else "an obstacle of the area"
