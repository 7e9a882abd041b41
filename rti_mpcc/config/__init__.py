"""Frozen, validated settings of the controller. SI units and radians; a bad value raises `ConfigError`.

The numbers of the paper (Table I) are the defaults of `Weights`; what its published code adds is
switched on by `ControllerConfig.paper()`, see docs/decisions.
"""

from __future__ import annotations

from rti_mpcc.config.controller import COMFORT_ACCELERATION, EXIT, ControllerConfig
from rti_mpcc.config.decisions import ArrivalTiming, Behaviour, Guesses, Retries, Ride, Search
from rti_mpcc.config.inputs import GoalLimits, GoalTracking, ObstacleTracking, Plausibility, UserClock
from rti_mpcc.config.mission import MissionSettings
from rti_mpcc.config.mpc import Clearance, DockingObjective, SolverSettings, Weights
from rti_mpcc.config.route import RoutePlanner
from rti_mpcc.config.safety import Caution, Escape, Fallback
from rti_mpcc.config.vehicle import Comfort, Limits, Vehicle

__all__ = [
    "COMFORT_ACCELERATION",
    "EXIT",
    "ArrivalTiming",
    "Behaviour",
    "Caution",
    "Clearance",
    "Comfort",
    "ControllerConfig",
    "DockingObjective",
    "Escape",
    "Fallback",
    "GoalLimits",
    "GoalTracking",
    "Guesses",
    "Limits",
    "MissionSettings",
    "ObstacleTracking",
    "Plausibility",
    "Retries",
    "Ride",
    "RoutePlanner",
    "Search",
    "SolverSettings",
    "UserClock",
    "Vehicle",
    "Weights",
]
