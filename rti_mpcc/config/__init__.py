"""Frozen, validated settings of the controller. SI units and radians; a bad value raises `ConfigError`.

The numbers of the paper (Table I) are the defaults of `Weights`; what its published code adds is
switched on by `ControllerConfig.paper()`, see docs/decisions.
"""

from __future__ import annotations

from rti_mpcc.config.controller import COMFORT_ACCELERATION, EXIT, ControllerConfig
from rti_mpcc.config.mpc import (
    Clearance,
    CostTerm,
    DockingObjective,
    GoalTracking,
    Plausibility,
    SolverSettings,
    Weights,
)
from rti_mpcc.config.route import MissionSettings, RoutePlanner
from rti_mpcc.config.vehicle import ActuatorModel, Comfort, Limits, Ride, Vehicle

__all__ = [
    "COMFORT_ACCELERATION",
    "EXIT",
    "ActuatorModel",
    "Clearance",
    "Comfort",
    "ControllerConfig",
    "CostTerm",
    "DockingObjective",
    "GoalTracking",
    "Limits",
    "MissionSettings",
    "Plausibility",
    "Ride",
    "RoutePlanner",
    "SolverSettings",
    "Vehicle",
    "Weights",
]
