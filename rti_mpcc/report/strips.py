"""Quantities of a ride over time, with comfort values and limits: timeline.png and page.html show them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rti_mpcc.model.footprint import clearances
from rti_mpcc.report.ride import Ride
from rti_mpcc.types import Array


class Strip(NamedTuple):
    """One quantity, values (n,) at the times of `Ride.motion` or of its moments.

    `label`: with the unit; `comfort`, `limit`: largest absolute values, or None.
    """

    label: str
    values: Array
    comfort: float | None = None
    limit: float | None = None


def motion_strips(ride: Ride) -> list[Strip]:
    """The strips at the times of `Ride.motion`."""
    motion, comfort, limits = ride.motion, ride.config.comfort, ride.config.limits
    return [
        Strip("speed [m/s]", motion.v, limit=limits.speed),
        Strip("steering [rad]", motion.delta, limit=limits.steering),
        Strip("acceleration [m/s²]", motion.acceleration, comfort.acceleration, limits.acceleration),
        Strip("lateral acceleration [m/s²]", motion.lateral_acceleration, comfort.lateral_acceleration),
        Strip("steering rate [rad/s]", motion.steering_rate, comfort.steering_rate, limits.steering_rate),
        Strip("progress [m]", motion.theta),
    ]


def commanded_jerk(ride: Ride) -> Strip:
    """Change of the commanded acceleration from cycle to cycle over the time between, a value a moment."""
    commanded = np.array([moment.command.acceleration for moment in ride.moments])
    spans = np.diff(ride.times, prepend=ride.times[0] - ride.config.cycle)
    jerk = np.diff(commanded, prepend=0.0) / np.where(spans > 0.0, spans, np.nan)
    return Strip("jerk, commanded [m/s³]", jerk, ride.config.comfort.jerk)


def clearance(ride: Ride) -> Strip:
    """Signed distance of the measured body to what the controller knew, a value a moment; NaN: not known."""
    values = np.full(len(ride.moments), np.nan)
    for k, moment in enumerate(ride.moments):
        if moment.corridor is not None and np.isfinite(moment.pose).all():
            part = moment.command.diagnostics.part
            values[k] = clearances(moment.pose[None], moment.corridor, part, ride.config.vehicle).min()
    return Strip("clearance [m]", values, limit=ride.config.clearance.least)


def computing_time(ride: Ride) -> Strip:
    """Time that `step` took, a value a moment."""
    spent = np.array([moment.command.diagnostics.step_ms for moment in ride.moments])
    return Strip("time a cycle [ms]", spent)
