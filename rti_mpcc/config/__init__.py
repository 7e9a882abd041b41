"""Frozen, validated settings of the controller. SI units and radians; a bad value raises `ConfigError`.

The numbers of the paper (Table I) are the defaults of `Weights`; what its published code adds is
switched on by `ControllerConfig.paper()`, see docs/decisions.
"""

from __future__ import annotations

from rti_mpcc.config.controller import COMFORT_ACCELERATION, EXIT, NO_COMFORT, ControllerConfig
from rti_mpcc.config.decisions import Method, Ride
from rti_mpcc.config.inputs import GoalTracking, Plausibility
from rti_mpcc.config.mission import MissionSettings
from rti_mpcc.config.mpc import (
    AdmmSettings,
    BoundRelaxation,
    Footprint,
    NarrowPassage,
    SolverSettings,
    SpeedProfile,
    Weights,
)
from rti_mpcc.config.route import RoutePlanner
from rti_mpcc.config.safety import Caution
from rti_mpcc.config.vehicle import Comfort, Limits, Vehicle

__all__ = [
    "COMFORT_ACCELERATION",
    "EXIT",
    "NO_COMFORT",
    "AdmmSettings",
    "BoundRelaxation",
    "Caution",
    "Comfort",
    "ControllerConfig",
    "Footprint",
    "GoalTracking",
    "Limits",
    "Method",
    "MissionSettings",
    "NarrowPassage",
    "Plausibility",
    "Ride",
    "RoutePlanner",
    "SolverSettings",
    "SpeedProfile",
    "Vehicle",
    "Weights",
]
