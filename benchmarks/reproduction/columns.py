"""Columns of the tables: the figures of the paper's Tables II and III, and some more."""

from __future__ import annotations

from typing import NamedTuple


class Column(NamedTuple):
    """A figure of `simulation.summary`, by its path in it, with its head and digits."""

    head: str
    path: str
    digits: int


PAPER = (
    Column("T [s]", "time_to_tolerance_s", 2),
    Column("reversals", "direction_changes", 0),
    Column("rms δ [rad]", "rms.steering", 3),
    Column("rms δ̇ [rad/s]", "rms.steering_rate", 3),
    Column("rms a [m/s²]", "rms.acceleration", 3),
    Column("rms a_lat [m/s²]", "rms.lateral_acceleration", 3),
)
"""In the order of the paper's tables."""
BEYOND = (
    Column("dock [s]", "time_to_dock_s", 2),
    Column("clearance [m]", "min_clearance_m", 2),
    Column("∫δ̇² [rad²/s]", "energy.steering_rate", 3),
    Column("∫a² [m²/s³]", "energy.acceleration", 3),
    Column("∫a_lat² [m²/s³]", "energy.lateral_acceleration", 3),
)
