"""Exact check of a plan's body against boundaries and obstacles."""

from __future__ import annotations

import numpy as np

from geometry import Corridor
from rti_mpcc.config import ControllerConfig
from rti_mpcc.model.footprint import body_polygons, cover
from rti_mpcc.model.layout import V, X, Y
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


def way_to_contact(
    plan: Trajectory,
    corridor: Corridor,
    part: int,
    config: ControllerConfig,
    reach: float,
    touched: float | None = None,
) -> float:
    """Way along the plan to the first body that touches something [m]; inf if none does within `reach`.

    A body that touches from the start on is let out: only poses with `LET_OUT` less clearance than `touched`
    (default: than it has there) count.
    """
    marks, bodies = _bodies(plan, config, reach)
    touching = corridor.collides(part, bodies)
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

    The discs reach beyond the ends of the body; nearer than that the corridor rows let no plan come.
    """
    vehicle, footprint = config.vehicle, config.footprint
    overhang = cover(vehicle, footprint.discs).radius - 0.5 * (vehicle.front + vehicle.rear) / footprint.discs
    return overhang + footprint.margin + SPACING


def stopping_distance(speed: float, config: ControllerConfig) -> float:
    """Way needed to stop from `speed` [m/s] while blocked [m], with `SPARE` to spare."""
    return speed**2 / (2.0 * braking(config)) + SPARE
