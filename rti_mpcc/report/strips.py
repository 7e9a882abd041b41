"""Quantities of a ride over time, with comfort values and limits: timeline.png and page.html show them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rti_mpcc.model.footprint import clearances
from rti_mpcc.report.ride import Ride
from rti_mpcc.types import Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Strip:
    """One quantity at the times of `Ride.motion`, or at those of its moments.

    Attributes:
        label: with the unit; values: (n,) there.
        comfort, limit: largest absolute values, or None.
    """

    label: str
    values: Array
    comfort: float | None = None
    limit: float | None = None


def motion_strips(ride: Ride) -> list[Strip]:
    """Speed, steering, acceleration, lateral acceleration, steering rate, progress."""
    motion, comfort, limits = ride.motion, ride.config.comfort, ride.config.limits
    return [
        Strip(label="speed [m/s]", values=motion.v, limit=limits.speed),
        Strip(label="steering [rad]", values=motion.delta, limit=limits.steering),
        Strip(
            label="acceleration [m/s²]",
            values=motion.acceleration,
            comfort=comfort.acceleration,
            limit=limits.acceleration,
        ),
        Strip(
            label="lateral acceleration [m/s²]",
            values=motion.lateral_acceleration,
            comfort=comfort.lateral_acceleration,
        ),
        Strip(
            label="steering rate [rad/s]",
            values=motion.steering_rate,
            comfort=comfort.steering_rate,
            limit=limits.steering_rate,
        ),
        Strip(label="progress [m]", values=motion.theta),
    ]


def commanded_jerk(ride: Ride) -> Strip:
    """Change of the commanded acceleration from cycle to cycle over the time between, a value a moment."""
    times = np.array([moment.time for moment in ride.moments])
    commanded = np.array([moment.command.acceleration for moment in ride.moments])
    spans = np.diff(times, prepend=times[0] - ride.config.cycle)
    jerk = np.diff(commanded, prepend=0.0) / np.where(spans > 0.0, spans, np.nan)
    return Strip(label="jerk, commanded [m/s³]", values=jerk, comfort=ride.config.comfort.jerk)


def clearance(ride: Ride) -> Strip:
    """Signed distance of the measured body to what the controller knew, a value a moment; NaN: not known."""
    values = np.full(len(ride.moments), np.nan)
    for k, moment in enumerate(ride.moments):
        if moment.corridor is not None and np.isfinite(moment.pose).all():
            part = moment.command.diagnostics.part
            values[k] = clearances(moment.pose[None], moment.corridor, part, ride.config.vehicle).min()
    return Strip(label="clearance [m]", values=values, limit=ride.config.clearance.least)


def computing_time(ride: Ride) -> Strip:
    """Time that `step` took, a value a moment."""
    spent = np.array([moment.command.diagnostics.step_ms for moment in ride.moments])
    return Strip(label="time a cycle [ms]", values=spent)
