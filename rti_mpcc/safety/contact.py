"""Exact check of a plan's body against boundaries and obstacles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from geometry import Corridor, HalfPlanes
from rti_mpcc.config import ControllerConfig
from rti_mpcc.model.footprint import Discs, body_polygons, cover
from rti_mpcc.model.layout import DELTA, PHI, V, X, Y
from rti_mpcc.ocp.horizon import states_at
from rti_mpcc.safety.ladder import SPARE, braking
from rti_mpcc.safety.stopping import stopping_motion
from rti_mpcc.types import Array, Trajectory

CHECKED = 3.0
"""How far ahead along the plan contact is looked for beyond the stopping distance [m]."""
LET_OUT = 0.2
"""So far a body that touches something may swing its other end out to get away [m]: in reverse the front goes
out by l²/2R, l its distance from the axle: 0.14 m on a circle of 50 m."""
DEEPER = 0.01
"""A contact gets worse if its clearance falls by more than this [m]."""
STOPPING_POSES = 10
"""Poses on the way to a standstill that are looked at for contact."""
SPACING = 0.2
"""Way between two bodies that are checked [m]."""
UNSURE = 0.02
"""Where two pieces of a boundary are about equally near, the distance of the farther one may have been found:
it is too large by so much at most [m], see `Boundary.nearest_sample`."""


def way_to_contact(
    plan: Trajectory,
    corridor: Corridor,
    part: int,
    config: ControllerConfig,
    reach: float,
    touched: float | None = None,
    *,
    begins_free: bool = False,
) -> float:
    """Way along the plan to the first body that touches something [m]; inf if none does within `reach`.

    The bodies overlap. If the first one is known to be free (`begins_free`) and none touches anything, they
    are on the side of each wall that it is on, and need not be asked whether they are beyond one.
    A body that touches from the start on is let out: only poses with `LET_OUT` less clearance than `touched`
    (default: than it has there) count.
    """
    marks, bodies = _bodies(plan, config, reach)
    touching = corridor.touches(part, bodies) if begins_free else corridor.collides(part, bodies)
    if touching[0]:
        clearance = corridor.clearance(part, bodies)
        touching &= clearance < (float(clearance[0]) if touched is None else touched) - LET_OUT
    return float(marks[np.argmax(touching)]) if touching.any() else np.inf


def touched(
    before: float | None, state: Array, corridor: Corridor, part: int, config: ControllerConfig
) -> float | None:
    """The least clearance [m] that a body which touches something can still be kept at; None if it is free.

    It is found when the contact begins, by braking fully from `state` (6,), and stays while it lasts:
    `before` is that of the cycle before. So a vehicle is let out of a contact, but not through it.
    """
    if not corridor.collides(part, body_polygons(state[None, :], config.vehicle))[0]:
        return None
    if before is not None:
        return before
    most = config.limits.acceleration
    times = np.linspace(0.0, max(abs(float(state[V])) / most, 1e-3), STOPPING_POSES)
    motion = stopping_motion(state, times, most, config.vehicle.wheelbase)
    return float(corridor.clearance(part, body_polygons(motion.states, config.vehicle)).min())


def surely_clear(
    plan: Trajectory,
    planes: HalfPlanes | None,
    corridor: Corridor,
    part: int,
    config: ControllerConfig,
    reach: float,
) -> bool:
    """Whether `way_to_contact` need not be asked: no body of the plan up to `reach` [m] touches anything.

    (S1)  d_k - |p - c_k| > r,   |p - c_k| <= |c_k - c_k'| + w/2 + (4/27 + 1/8) h m

    The discs of radius r cover the body. At c_k', where their centres were linearised about or looked up
    last, they had the distances d_k to everything (`planes` of stages 1..N, of the plan's `Solution`). A
    centre p of a body between two stages is by so much, at most, beside the nearer one's c_k: w is the
    way of the centre over the stage, h its length, m the greater of its speeds at both ends. These are the
    largest values of the cubic's weights within half a stage, see `states_at`. The first stage has no
    planes where it begins: there the whole of it counts.

    Touching nothing all along, the bodies are on the side of a wall that the first one is on, and so beyond
    one only if that is, or if the way leads round an open end of it, farther than the half-planes call
    beyond. So this holds for a vehicle whose body is free where the plan begins, see `touched`.
    """
    discs, stages = cover(config.vehicle, config.footprint.discs), len(plan.controls)
    count = len(discs.offsets)
    if planes is None or len(planes.distance) != stages * count:
        return False
    place = plan.states[:, X] + 1j * plan.states[:, Y]
    steps = np.abs(place[1:] - place[:-1])
    # Of the stages that bodies up to `reach` lie between, and one more against rounding.
    last = min(int(np.searchsorted(np.cumsum(steps), reach)) + 2, stages)
    centres = _centres(place[1 : last + 1], np.exp(1j * plan.states[1 : last + 1, PHI]), discs)
    apart = corridor.at_least(part, centres, planes).reshape(last, count).min(axis=1)
    aside = _between_stages(plan, steps[:last], discs, config.vehicle.wheelbase)
    aside[0] *= 2.0
    np.maximum(aside[:-1], aside[1:], out=aside[:-1])
    return bool((apart - aside).min() > discs.radius + UNSURE)


def body_surely_clear(
    state: Array, planes: HalfPlanes | None, corridor: Corridor, part: int, config: ControllerConfig
) -> bool:
    """Whether `touched` need not be asked at `state` (6,): the body touches nothing, by (S1).

    `planes` are those of the first stages of a plan that is being driven. The way from there crosses nothing
    either.
    """
    discs = cover(config.vehicle, config.footprint.discs)
    if planes is None or len(planes.distance) < len(discs.offsets):
        return False
    place = np.array([complex(state[X], state[Y])])
    centres = _centres(place, np.exp(1j * state[[PHI]]), discs)
    return bool(corridor.at_least(part, centres, planes).min() > discs.radius + UNSURE)


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


def deepens(motion: Trajectory, corridor: Corridor, part: int, config: ControllerConfig) -> bool:
    """Whether the body touches something along a motion that it goes deeper into."""
    _, bodies = _bodies(motion, config, np.inf)
    if not corridor.collides(part, bodies).any():
        return False
    clearance = corridor.clearance(part, bodies)
    return bool(clearance.min() < clearance[0] - DEEPER)


def length(plan: Trajectory) -> float:
    """Way that the plan drives [m]."""
    return float(_steps(plan).sum())


def _steps(plan: Trajectory) -> Array:
    """Way (N,) of each stage [m]."""
    steps: Array = np.hypot(np.diff(plan.states[:, X]), np.diff(plan.states[:, Y]))
    return steps


def _bodies(plan: Trajectory, config: ControllerConfig, reach: float) -> tuple[Array, Array]:
    """Ways along the plan [m] up to `reach`, and the body (n, 4, 2) [m] at each."""
    steps = _steps(plan)
    way = np.append(0.0, np.cumsum(steps))
    end = min(reach, float(way[-1]))
    marks = np.linspace(0.0, end, max(int(np.ceil(end / SPACING)) + 1, 2))
    moving = np.append(True, steps > 1e-9)
    times = np.interp(marks, way[moving], plan.times[moving])
    return marks, body_polygons(states_at(plan, times, config.vehicle.wheelbase), config.vehicle)


def stop_clearance(config: ControllerConfig) -> float:
    """Distance that a planned stop keeps from something that fills the way [m].

    Corridor rows let plans come nearer to what is ahead, (H6). The room is kept to swing out past it: what is
    not ahead counts by the discs, which reach beyond the ends of the body.
    """
    vehicle, footprint = config.vehicle, config.footprint
    overhang = cover(vehicle, footprint.discs).radius - 0.5 * (vehicle.front + vehicle.rear) / footprint.discs
    return overhang + footprint.margin + SPACING


def stopping_distance(speed: float, config: ControllerConfig) -> float:
    """Way needed to stop from `speed` [m/s] while blocked [m], with `SPARE` to spare."""
    return speed**2 / (2.0 * braking(config)) + SPARE
