"""Scenario files, a plant with errors unknown to the controller, the closed loop, the figures of a run."""

from __future__ import annotations

from rti_mpcc.simulation.closed_loop import Controller, simulate
from rti_mpcc.simulation.controllers import docking_controller, driver_of
from rti_mpcc.simulation.courses import CAMPAIGN, CourseRange, drawn_course
from rti_mpcc.simulation.dockable import Witness, find_witness
from rti_mpcc.simulation.docks_file import Docks, load_docks, read_docks
from rti_mpcc.simulation.goal_feed import Detector, GoalSource, SimulatedDetector
from rti_mpcc.simulation.metrics import summary
from rti_mpcc.simulation.result import Cycles, RunResult, Tracking, Truth
from rti_mpcc.simulation.scenario import Scenario
from rti_mpcc.simulation.scenario_file import (
    builtin_names,
    changed,
    load_scenario,
    save_scenario,
    scenario_from_dict,
    scenario_text,
)

__all__ = [
    "CAMPAIGN",
    "Controller",
    "CourseRange",
    "Cycles",
    "Detector",
    "Docks",
    "GoalSource",
    "RunResult",
    "Scenario",
    "SimulatedDetector",
    "Tracking",
    "Truth",
    "Witness",
    "builtin_names",
    "changed",
    "docking_controller",
    "drawn_course",
    "driver_of",
    "find_witness",
    "load_docks",
    "load_scenario",
    "read_docks",
    "save_scenario",
    "scenario_from_dict",
    "scenario_text",
    "simulate",
    "summary",
]
