"""Exact checks of the body: does it overlap something, and how far along a plan does it stay clear.

Clear is a body that is farther than `Clearance.least` from all obstacles that stand, and from boundaries
but for `CONTACT_TOLERANCE`: measurements tremble. A plan that begins nearer to one of them may swing
the other end of the body out to get away, but must not touch it. That does not set in at once: from less than
twice that distance a plan may come nearer by as much.
Of an obstacle that moves with u it is not known what it will do next:

(S1)  dist(body(t), hull(P, P + u t)) > d_min   and   dist(edge(t), hull(P, P + u t)) > d_min + |u| t_stop,
      t_stop = dead time + cycle + |v| / a_max

for all times t from now on at which the plan is there: it may go on as it does, or stop on the way; and where
the leading edge of the body is, it may turn into any direction while the vehicle needs t_stop to stand.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, cos, hypot, inf, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from geometry import Corridor
from geometry.compiled import Array1, Array2, IndexOut1, Out1, kernel
from geometry.convex import VALUE, WITNESS, distance_between, swept
from geometry.shape_grid import in_frame
from rti_mpcc.config import ControllerConfig
from rti_mpcc.config.mpc import CONTACT_TOLERANCE
from rti_mpcc.model.footprint import body_of, box_of, clearances
from rti_mpcc.model.layout import PHI, POSE, THETA, V, X, Y
from rti_mpcc.ocp.horizon import distances, states_at, step_length
from rti_mpcc.planning.obstacles import Obstacle
from rti_mpcc.planning.state import ControllerState
from rti_mpcc.planning.surroundings import Surroundings
from rti_mpcc.planning.ways import CHECK_SPACING
from rti_mpcc.safety.naming import Met, met_by
from rti_mpcc.types import Array, Trajectory

STOP_SHARE = 0.25  # more of the route than braking in comfort takes is checked for a stop
SWING_ROOM = 0.33  # of the body's width, left to swing out past what blocks the route
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
    met = met_by(states[deepest, :POSE], surroundings, part, config, within=0.0)
    return Overlap(float(depth[deepest]), *met)


def distance_to_contact(
    plan: Trajectory,
    corridor: Corridor,
    part: int,
    config: ControllerConfig,
    reach: float,
    *,
    least: float,
) -> float:
    """Distance along the plan to the first body nearer than `least` to what stands [m]; inf: none."""
    marks, states = _driven(plan, config, reach)
    poses = np.ascontiguousarray(states[:, :POSE])
    # Where the plan begins it counts how near it is to twice the distance that is kept.
    within = max(2.0 * least, CONTACT_TOLERANCE)
    apart = corridor.signed_distances(part, body_of(config.vehicle), poses, within)
    first = _first_below(apart, _least(apart[0], least))
    return float(marks[first]) if first >= 0 else np.inf


@kernel
def _first_below(apart: Array2, least: Array1) -> int:
    """The first row of `apart` (n, m) with a value below `least` (m,), or -1."""
    for n in range(len(apart)):
        for k in range(len(least)):
            if apart[n, k] < least[k]:
                return n
    return -1


def _least(begins: Array, least: float) -> Array:
    """Clearances (1 + obstacles,) [m] that a plan keeps which `begins` with these [m]."""
    kept = np.full(len(begins), least)
    kept[0] = max(least - CONTACT_TOLERANCE, 0.0)
    nearer = np.minimum(np.maximum(begins - kept, 0.0), kept)
    return np.where(begins >= 0.0, nearer, begins - OVERLAP_GROWTH)


def distance_to_obstacle(
    plan: Trajectory, corridor: Corridor, part: int, config: ControllerConfig, reach: float
) -> float:
    """Distance along the plan to the first body that touches an obstacle, no boundary [m], or inf."""
    marks, states = _driven(plan, config, reach)
    meets = _obstacles_met(states, corridor, part, config).any(axis=1)
    return float(marks[np.argmax(meets)]) if meets.any() else np.inf


def _obstacles_met(
    states: Array, corridor: Corridor, part: int, config: ControllerConfig
) -> NDArray[np.bool_]:
    """Which obstacles (n, k) the bodies at `states` (n, >= 3) touch."""
    poses, within = np.ascontiguousarray(states[:, :POSE]), config.clearance.least
    apart = corridor.signed_distances(part, body_of(config.vehicle), poses, within)
    met: NDArray[np.bool_] = apart[:, 1:] <= 0.0
    return met


def distance_to_moving(
    plan: Trajectory, moving: Sequence[Obstacle], ages: float, config: ControllerConfig, reach: float
) -> float:
    """Distance along the plan to the first body that may meet a moving obstacle, (S1) [m], or inf.

    `ages`: time from when the obstacles were given to the start of the plan [s].
    """
    if not moving:
        return np.inf
    marks, states = _driven(plan, config, reach)
    elapsed = ages + config.dead_time + (_times(plan, marks) - plan.times[0])
    stop = config.dead_time + config.cycle + np.abs(states[:, V]) / config.limits.acceleration
    body, near = box_of(config.vehicle).corners, np.zeros(len(marks), dtype=np.int64)
    for obstacle in moving:
        _meets(body, states, obstacle.hull, obstacle.velocity, elapsed, stop, config.clearance.least, near)
    return float(marks[np.argmax(near)]) if near.any() else np.inf


@kernel
def _meets(
    body: Array2,
    states: Array2,
    hull: Array2,
    velocity: Array1,
    elapsed: Array1,
    stop: Array1,
    least: float,
    near: IndexOut1,
) -> None:
    """Equation (S1): set `near` (n,) to 1 where one of the bodies at `states` (n, 6) may meet it."""
    covered, seen = np.empty((len(hull) + 2, 2)), np.empty((len(hull) + 2, 2))
    edge, witness = np.empty((2, 2)), np.empty(WITNESS)
    speed = hypot(velocity[0], velocity[1])
    for n in range(len(states)):
        count = swept(hull, velocity[0] * elapsed[n], velocity[1] * elapsed[n], covered)
        c, s = cos(states[n, PHI]), sin(states[n, PHI])
        in_frame(covered, 0, count, states[n, X], states[n, Y], c, s, seen)
        distance_between(body, 0, len(body), seen, 0, count, inf, witness)
        if witness[VALUE] <= least:
            near[n] = 1
        # The leading edge: corners 1 and 2 are those at the front.
        first = 1 if states[n, V] >= 0.0 else 3
        for j in range(2):
            k = (first + j) % len(body)
            edge[j, 0], edge[j, 1] = body[k, 0], body[k, 1]
        distance_between(edge, 0, 2, seen, 0, count, inf, witness)
        if witness[VALUE] <= least + speed * stop[n]:
            near[n] = 1


def progress_of_contact(
    s: ControllerState, plan: Trajectory, distance: float, config: ControllerConfig
) -> float:
    """Progress [m] at which a body on the path meets what a plan meets after so far [m].

    Stops are on the path, and a plan may be beside it: on the inside of a bend it is farther along by then.
    Where the body on the path does not meet it, or later, it is where the plan's body is beside the path; so
    it is where that body meets it all along, which the plan passes.
    """
    part, index, corridor = s.task.segment.part, s.task.segment.index, s.area.corridor
    state = states_at(plan, _times(plan, np.array([distance])), config.vehicle.wheelbase)
    x, y, phi = state[0, :POSE].tolist()
    # Not the plan's own progress: nothing holds that to where an arrival is.
    begin, end = float(plan.states[0, THETA]), part.project(x, y, heading=phi)
    theta = np.arange(begin, end, CHECK_SPACING)
    at = part.reference(theta)
    bodies = np.column_stack([at.x, at.y, at.phi])
    met = _obstacles_met(state, corridor, index, config)[0]
    meets = np.asarray(_obstacles_met(bodies, corridor, index, config)[:, met].any(axis=1))
    if not meets.any():
        return end
    clear = np.flatnonzero(~meets[: np.flatnonzero(meets)[-1]])
    return float(theta[clear[-1] + 1]) if len(clear) else end


def met_on(s: ControllerState, plan: Trajectory, distance: float, config: ControllerConfig) -> Met:
    """What a plan meets after so far [m]."""
    times = _times(plan, np.array([distance]))
    (state,) = states_at(plan, times, config.vehicle.wheelbase)
    ahead = s.now - s.area.given_at + config.dead_time + float(times[0] - plan.times[0])
    return met_by(state, s.area, s.task.segment.index, config, ahead)


def length(plan: Trajectory) -> float:
    """Way that the plan drives [m]."""
    return float(distances(plan.states)[-1])


def _driven(plan: Trajectory, config: ControllerConfig, reach: float) -> tuple[Array, Array]:
    """Distances along the plan (n,) [m] up to `reach`, at most `MOST_BODIES`, and the states (n, 6) there."""
    spacing = CHECK_SPACING
    end = min(reach, length(plan), MOST_BODIES * spacing)
    count = max(ceil(end / spacing), 1)
    marks = np.arange(count + 1.0) * (end / count)
    return marks, states_at(plan, _times(plan, marks), config.vehicle.wheelbase)


def _times(plan: Trajectory, marks: Array) -> Array:
    """When (n,) [s] the plan has driven the ways `marks` (n,) [m], which do not fall."""
    times = np.empty(len(marks))
    _when_driven(plan.times, plan.states, marks, times)
    return times


@kernel
def _when_driven(times: Array1, states: Array2, marks: Array1, found: Out1) -> None:
    """Linear within a stage; where the plan stands still the time at which it comes to."""
    k, before, step = 0, 0.0, step_length(states, 0)
    for i in range(len(marks)):
        while k < len(states) - 2 and (marks[i] > before + step):
            before += step
            k += 1
            step = step_length(states, k)
        share = min(max((marks[i] - before) / step, 0.0), 1.0) if step > 1e-9 else 0.0
        found[i] = times[k] + share * (times[k + 1] - times[k])


def stop_clearance(config: ControllerConfig) -> float:
    """Distance that a planned stop keeps from what blocks the route [m], with room to swing out past it."""
    return SWING_ROOM * config.vehicle.width + config.clearance.wanted + CHECK_SPACING


def stopping_distance(speed: float, config: ControllerConfig) -> float:
    """Way that a vehicle at `speed` [m/s] needs to stop in comfort [m], a share more, and room to go on."""
    in_comfort = speed**2 / (2.0 * config.comfort_acceleration)
    return (1.0 + STOP_SHARE) * in_comfort + stop_clearance(config)
