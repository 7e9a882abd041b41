"""Scenario files, a plant with errors unknown to the controller, the closed loop, the figures of a run."""

from __future__ import annotations

from rti_mpcc.simulation.closed_loop import Controller, simulate
from rti_mpcc.simulation.controllers import docking_controller, driver_of
from rti_mpcc.simulation.detector import Detector, SimulatedDetector
from rti_mpcc.simulation.docks_file import Docks, load_docks, read_docks
from rti_mpcc.simulation.goal_feed import GoalSource
from rti_mpcc.simulation.metrics import summary
from rti_mpcc.simulation.result import Cycles, RunResult, Tracking, Truth
from rti_mpcc.simulation.scenario import Scenario
from rti_mpcc.simulation.scenario_file import builtin_names, changed, load_scenario, scenario_from_dict
from rti_mpcc.simulation.scenario_writer import save_scenario, scenario_text

__all__ = [
    "Controller",
    "Cycles",
    "Detector",
    "Docks",
    "GoalSource",
    "RunResult",
    "Scenario",
    "SimulatedDetector",
    "Tracking",
    "Truth",
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
