"""Scenario files, a plant with errors unknown to the controller, the closed loop, the figures of a run."""

from __future__ import annotations

from rti_mpcc.simulation.closed_loop import Controller, docking_controller, driver_of, simulate
from rti_mpcc.simulation.docks_file import Docks, load_docks, read_docks
from rti_mpcc.simulation.goal_feed import CameraDetector, Detector, GoalSource, SimulatedDetector
from rti_mpcc.simulation.metrics import summary
from rti_mpcc.simulation.result import RunResult, Truth, all_succeeded
from rti_mpcc.simulation.scenario import (
    PRESETS,
    Scenario,
    builtin_names,
    changed,
    load_scenario,
    save_scenario,
    scenario_from_dict,
    scenario_text,
)

__all__ = [
    "PRESETS",
    "CameraDetector",
    "Controller",
    "Detector",
    "Docks",
    "GoalSource",
    "RunResult",
    "Scenario",
    "SimulatedDetector",
    "Truth",
    "all_succeeded",
    "builtin_names",
    "changed",
    "docking_controller",
    "driver_of",
    "load_docks",
    "load_scenario",
    "read_docks",
    "save_scenario",
    "scenario_from_dict",
    "scenario_text",
    "simulate",
    "summary",
]
