"""Whole missions on one controller: drive up, dock, wait, drive on straight, undock, drive away.

`DockingMission` gives a controller its orders, one step after the other, and reports the result of each. A
step is one file. An own one extends `Step`, or `DrivingStep`, and gives an order.
"""

from __future__ import annotations

from rti_mpcc.mission.dock import Approach, Dock, DockKind
from rti_mpcc.mission.docking_mission import DockingMission
from rti_mpcc.mission.drive_to import DriveTo
from rti_mpcc.mission.state import MissionState, StepRecord
from rti_mpcc.mission.step import DrivingStep, Next, Started, Step, StepOutcome
from rti_mpcc.mission.straight import Straight
from rti_mpcc.mission.undock import Undock
from rti_mpcc.mission.wait import Wait
from rti_mpcc.orders import Follow, GoTo, Resume, Stand

__all__ = [
    "Approach",
    "Dock",
    "DockKind",
    "DockingMission",
    "DriveTo",
    "DrivingStep",
    "Follow",
    "GoTo",
    "MissionState",
    "Next",
    "Resume",
    "Stand",
    "Started",
    "Step",
    "StepOutcome",
    "StepRecord",
    "Straight",
    "Undock",
    "Wait",
]
