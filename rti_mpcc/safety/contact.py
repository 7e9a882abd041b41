"""Exact checks of the body: does it overlap something, and how far along a plan does it stay clear.

Clear is a body that is farther than `Caution.hard_minimum` from all obstacles that stand, and from boundaries
but for `Caution.contact_tolerance`: measurements tremble. A plan that begins nearer to one of them may swing
the other end of the body out to get away, but must not touch it. Beside a boundary that does not set in at
once: from less than twice that distance a plan may come nearer by as much.
Of an obstacle that moves with u it is not known what it will do next:

(S2)  dist(body(t), hull(P, P + u t)) > d_min   and   dist(edge(t), hull(P, P + u t)) > d_min + |u| t_stop,
      t_stop = dead time + cycle + |v| / a_max

for all times t from now on at which the plan is there: it may go on as it does, or stop on the way; and where
the leading edge of the body is, it may turn into any direction while the vehicle needs t_stop to stand.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from geometry import Corridor, HalfPlanes, PathPart
from rti_mpcc.config import ControllerConfig
from rti_mpcc.model.footprint import Discs, body_polygons, cover
from rti_mpcc.model.layout import DELTA, PHI, THETA, V, X, Y
from rti_mpcc.ocp.horizon import states_at
from rti_mpcc.planning.obstacles import Obstacle
from rti_mpcc.planning.surroundings import Surroundings
from rti_mpcc.types import Array, Trajectory

UNSURE = 0.02
"""Where two pieces of a boundary are about equally near, the distance of the farther one may have been found:
it is too large by so much at most [m], see `Boundary.nearest_sample`."""


class Overlap(NamedTuple):
    """What a body overlaps: how deep [m], what it is, and where (x, y) [m]."""

    depth: float
    what: str
    where: tuple[float, float]

    def __str__(self) -> str:
        x, y = self.where
        return f"the body overlaps {self.what} by {self.depth:.2f} m at ({x:.2f}, {y:.2f})"


def overlap(states: Array, surroundings: Surroundings, part: int, config: ControllerConfig) -> Overlap | None:
    """What the bodies at `states` (n, 6) overlap, the deepest of it.

    Boundaries count from `Caution.contact_tolerance` on, obstacles from nothing on.
    """
    bodies = body_polygons(states, config.vehicle)
    if not surroundings.known.collides(part, bodies).any():
        return None
    depths = -surroundings.known.clearances(part, bodies)
    depths[depths[:, 0] <= config.caution.contact_tolerance, 0] = 0.0
    depth = depths.max(axis=1)
    deepest = int(np.argmax(depth))
    if depth[deepest] <= 0.0:
        return None
    return Overlap(float(depth[deepest]), *_met(shapely.Polygon(bodies[deepest]), surroundings, part))


def _met(body: shapely.Polygon, surroundings: Surroundings, part: int) -> tuple[str, tuple[float, float]]:
    """The name of what a body meets, and where."""
    for obstacle in surroundings.obstacles:
        if body.intersects(obstacle.shape):
            at = body.intersection(obstacle.shape).centroid
            return f"obstacles[{obstacle.index}]", (at.x, at.y)
    for name, lines in zip(("left", "right"), surroundings.known.lines(part), strict=True):
        for line in lines:
            met = body.intersection(shapely.LineString(line))
            if not met.is_empty:
                return f"the {name} boundary", (met.centroid.x, met.centroid.y)
    return "what lies beyond a boundary", (body.centroid.x, body.centroid.y)


def distance_to_contact(
    plan: Trajectory,
    corridor: Corridor,
    part: int,
    config: ControllerConfig,
    reach: float,
    *,
    least: float,
    begins_free: bool = False,
) -> float:
    """Way along the plan to the first body nearer than `least` to what stands [m]; inf if none to `reach` is.

    The bodies overlap. If the first one is known to be free (`begins_free`) and none touches anything, they
    are on the side of each wall that it is on, and need not be asked whether they are beyond one.
    """
    marks, _, bodies = _bodies(plan, config, reach)
    near = corridor.touches(part, bodies, least) if begins_free else corridor.collides(part, bodies, least)
    if near.any():
        clearances = corridor.clearances(part, bodies)
        near &= (clearances < _least(clearances[0], least, config)).any(axis=1)
    return float(marks[np.argmax(near)]) if near.any() else np.inf


def _least(begins: Array, least: float, config: ControllerConfig) -> Array:
    """Clearances (1 + obstacles,) [m] that are kept from boundaries and each obstacle by a plan that `begins`
    with these [m]."""
    wall = max(least - config.caution.contact_tolerance, 0.0)
    kept = np.where(begins < least, 0.0, least)
    kept[0] = min(max(float(begins[0]) - wall, 0.0), wall)
    return np.where(begins < 0.0, begins - config.caution.overlap_growth, kept)


def distance_to_obstacle(
    plan: Trajectory, obstacles: Sequence[Obstacle], config: ControllerConfig, reach: float
) -> float:
    """Way along the plan to the first body that touches one of these obstacles [m]; or inf.

    Boundaries do not count: they are no reason to wait, or to look for a way past.
    """
    if not obstacles:
        return np.inf
    marks, _, bodies = _bodies(plan, config, reach)
    meets = shapely.intersects(
        shapely.polygons(bodies), shapely.union_all([each.shape for each in obstacles])
    )
    return float(marks[np.argmax(meets)]) if meets.any() else np.inf


def distance_to_moving(
    plan: Trajectory, moving: Sequence[Obstacle], ages: float, config: ControllerConfig, reach: float
) -> float:
    """Way along the plan to the first body that may meet an obstacle that moves, Eq. (S2) [m]; or inf.

    Args:
        ages: so much later than when they were told the plan is looked at as beginning [s].
    """
    if not moving:
        return np.inf
    marks, states, bodies = _bodies(plan, config, reach)
    speed = np.abs(states[:, V])
    elapsed = ages + config.dead_time + (_times(plan, marks) - plan.times[0])
    stop = config.dead_time + config.cycle + speed / config.limits.acceleration
    ahead = np.where((states[:, V] >= 0.0)[:, None, None], bodies[:, 1:3], bodies[:, [0, 3]])
    shapes, edges = shapely.polygons(bodies), shapely.linestrings(ahead)
    near = np.zeros(len(marks), dtype=np.bool_)
    for obstacle in moving:
        swept, least = obstacle.swept(elapsed), config.caution.hard_minimum
        near |= shapely.dwithin(shapes, swept, least)
        near |= shapely.dwithin(edges, swept, least + obstacle.speed * stop)
    return float(marks[np.argmax(near)]) if near.any() else np.inf


def surely_clear(
    plan: Trajectory,
    planes: HalfPlanes | None,
    corridor: Corridor,
    part: int,
    config: ControllerConfig,
    reach: float,
    *,
    least: float,
) -> bool:
    """Whether `distance_to_contact` need not be asked: all bodies up to `reach` [m] are `least` clear.

    (S1)  d_k - |p - c_k| > r + least,   |p - c_k| <= |c_k - c_k'| + w/2 + (4/27 + 1/8) h m

    The discs of radius r cover the body. At c_k', where their centres were linearised about or looked up
    last, they had the distances d_k to everything (`planes` of stages 1..N, of the plan's `Solution`). A
    centre p of a body between two stages is by so much, at most, beside the nearer one's c_k: w is the
    way of the centre over the stage, h its length, m the greater of its speeds at both ends. These are the
    largest values of the cubic's weights within half a stage, see `states_at`. The first stage has no
    planes where it begins: there the whole of it counts.

    Touching nothing all along, the bodies are on the side of a wall that the first one is on, and so beyond
    one only if that is, or if the way leads round an open end of it, farther than the half-planes call
    beyond. So this holds for a vehicle whose body is free where the plan begins, see `overlap`.
    """
    discs, stages = cover(config.vehicle, config.footprint), len(plan.controls)
    count = len(discs.offsets)
    if planes is None or len(planes.distance) != stages * count:
        return False
    place = plan.states[:, X] + 1j * plan.states[:, Y]
    steps = np.abs(place[1:] - place[:-1])
    # Of the stages that bodies up to `reach` lie between, and one more against rounding.
    last = min(int(np.searchsorted(np.cumsum(steps), reach)) + 2, stages)
    centres = _centres(place[1 : last + 1], np.exp(1j * plan.states[1 : last + 1, PHI]), discs)
    apart = corridor.lower_bound(part, centres, planes).reshape(last, count).min(axis=1)
    aside = _between_stages(plan, steps[:last], discs, config.vehicle.wheelbase)
    aside[0] *= 2.0
    np.maximum(aside[:-1], aside[1:], out=aside[:-1])
    return bool((apart - aside).min() > discs.radius + least + UNSURE)


def bodies_surely_clear(
    states: Array, planes: HalfPlanes | None, corridor: Corridor, part: int, config: ControllerConfig
) -> bool:
    """Whether `overlap` need not be asked at `states` (n, 6): the bodies touch nothing that stands, by (S1).

    `planes` are those of the first stages of a plan that is being driven. The way from there crosses nothing
    either.
    """
    discs = cover(config.vehicle, config.footprint)
    if planes is None or len(planes.distance) < len(states) * len(discs.offsets):
        return False
    centres = _centres(states[:, X] + 1j * states[:, Y], np.exp(1j * states[:, PHI]), discs)
    return bool(corridor.lower_bound(part, centres, planes).min() > discs.radius + UNSURE)


def _centres(place: NDArray[np.complex128], axis: NDArray[np.complex128], discs: Discs) -> Array:
    """Disc centres (n * discs, 2) [m] of bodies at x + iy with exp(i phi) (n,), see `disc_centres`."""
    centres = place[:, None] + discs.offsets * axis[:, None]
    return centres.view(np.float64).reshape(-1, 2)


def _between_stages(plan: Trajectory, steps: Array, discs: Discs, wheelbase: float) -> Array:
    """How far (n,) [m] any disc centre is, at most, from where the nearer end of its stage has it.

    For the first n stages, whose ways are `steps` (n,) [m]: the last term of (S1).
    """
    states, stages = plan.states[: len(steps) + 1], len(steps)
    arm = float(np.abs(discs.offsets).max())
    turning = 1.0 + arm * float(np.tan(np.abs(states[:, DELTA]).max())) / wheelbase
    speed = np.abs(states[:, V])
    most = np.maximum(speed[1:], speed[:-1]) * (plan.times[1 : stages + 1] - plan.times[:stages])
    turn = np.abs(states[1:, PHI] - states[:-1, PHI])
    between: Array = 0.5 * (steps + arm * turn) + (4.0 / 27.0 + 0.125) * turning * most
    return between


def progress_of_contact(
    plan: Trajectory, distance: float, part: PathPart, obstacles: Sequence[Obstacle], config: ControllerConfig
) -> float:
    """Progress [m] at which a body on the path meets what a plan meets after so far [m].

    Stops are on the path, and a plan may be beside it: on the inside of a bend it is farther along by then.
    Where the body on the path does not meet it, or later, it is the plan's own progress; so it is where that
    body meets it all along, which the plan passes.
    """
    state = states_at(plan, _times(plan, np.array([distance])), config.vehicle.wheelbase)
    begin, end = float(plan.states[0, THETA]), float(state[0, THETA])
    body = shapely.Polygon(body_polygons(state, config.vehicle)[0])
    met = [each.shape for each in obstacles if body.intersects(each.shape)]
    if not met:
        return end
    theta = np.arange(begin, end, config.caution.check_spacing)
    at = part.reference(theta)
    bodies = shapely.polygons(body_polygons(np.column_stack([at.x, at.y, at.phi]), config.vehicle))
    meets = shapely.intersects(bodies, shapely.union_all(met))
    if not meets.any():
        return end
    clear = np.flatnonzero(~meets[: np.flatnonzero(meets)[-1]])
    return float(theta[clear[-1] + 1]) if len(clear) else end


def length(plan: Trajectory) -> float:
    """Way that the plan drives [m]."""
    return float(_steps(plan).sum())


def _steps(plan: Trajectory) -> Array:
    """Way (N,) of each stage [m]."""
    steps: Array = np.hypot(np.diff(plan.states[:, X]), np.diff(plan.states[:, Y]))
    return steps


def _bodies(plan: Trajectory, config: ControllerConfig, reach: float) -> tuple[Array, Array, Array]:
    """Ways along the plan (n,) [m] up to `reach`, states (n, 6) and bodies (n, 4, 2) [m] there."""
    end = min(reach, length(plan))
    marks = np.linspace(0.0, end, max(int(np.ceil(end / config.caution.check_spacing)) + 1, 2))
    states = states_at(plan, _times(plan, marks), config.vehicle.wheelbase)
    return marks, states, body_polygons(states, config.vehicle)


def _times(plan: Trajectory, marks: Array) -> Array:
    """When (n,) [s] the plan has driven the ways `marks` (n,) [m]."""
    steps = _steps(plan)
    travelled = np.append(0.0, np.cumsum(steps))
    moving = np.append(True, steps > 1e-9)
    times: Array = np.interp(marks, travelled[moving], plan.times[moving])
    return times


def stop_clearance(config: ControllerConfig) -> float:
    """Distance that a planned stop keeps from something that fills the way [m].

    Corridor rows let plans come nearer to what is ahead, (H6). The room is kept to swing out past it: what is
    not ahead counts by the discs, which reach beyond the ends of the body.
    """
    vehicle, footprint = config.vehicle, config.footprint
    overhang = cover(vehicle, footprint).radius - 0.5 * (vehicle.front + vehicle.rear) / footprint.discs
    return overhang + footprint.margin + config.caution.check_spacing


def stopping_distance(speed: float, config: ControllerConfig) -> float:
    """Way that a vehicle at `speed` [m/s] needs to stop in comfort [m], a share more, and room to go on."""
    in_comfort = speed**2 / (2.0 * config.comfort_acceleration)
    return (1.0 + config.caution.stop_share) * in_comfort + stop_clearance(config)
