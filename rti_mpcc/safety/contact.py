"""Exact check of a plan's body against boundaries and obstacles."""

from __future__ import annotations

import numpy as np

from geometry import Corridor
from rti_mpcc.config import ControllerConfig
from rti_mpcc.model.footprint import body_polygons, cover
from rti_mpcc.model.layout import X, Y
from rti_mpcc.ocp.horizon import states_at
from rti_mpcc.safety.ladder import SPARE, braking
from rti_mpcc.safety.stopping import stopping_motion
from rti_mpcc.types import Trajectory

CHECKED = 3.0
"""How far ahead along the plan contact is looked for beyond the stopping distance [m]."""
LET_OUT = 0.2
"""So far a body that touches something may swing its other end out to get away [m]: in reverse the front goes
out by l²/2R, l its distance from the axle: 0.14 m on a circle of 50 m."""
SPACING = 0.2
"""Way between two bodies that are checked [m]."""


def way_to_contact(
    plan: Trajectory, corridor: Corridor, part: int, config: ControllerConfig, reach: float
) -> float:
    """Way along the plan to the first body that touches something [m]; inf if none does within `reach`.

    A body that touches from the start on is let out: only poses with `LET_OUT` less clearance than it has
    there, or would have if it braked, count.
    """
    steps = np.hypot(np.diff(plan.states[:, X]), np.diff(plan.states[:, Y]))
    way = np.append(0.0, np.cumsum(steps))
    end = min(reach, float(way[-1]))
    marks = np.linspace(0.0, end, max(int(np.ceil(end / SPACING)) + 1, 2))
    moving = np.append(True, steps > 1e-9)
    times = np.interp(marks, way[moving], plan.times[moving])
    bodies = body_polygons(states_at(plan, times, config.vehicle.wheelbase), config.vehicle)
    touching = corridor.collides(part, bodies)
    if touching[0]:
        clearance = corridor.clearance(part, bodies)
        touching &= clearance < min(clearance[0], _braked(plan, corridor, part, config)) - LET_OUT
    return float(marks[np.argmax(touching)]) if touching.any() else np.inf


def _braked(plan: Trajectory, corridor: Corridor, part: int, config: ControllerConfig) -> float:
    """Least clearance [m] on the way to a standstill with the steering held."""
    motion = stopping_motion(plan.states[0], plan.times, braking(config), config.vehicle.wheelbase)
    return float(corridor.clearance(part, body_polygons(motion.states, config.vehicle)).min())


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
