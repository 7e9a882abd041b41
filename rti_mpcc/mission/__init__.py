"""Whole missions on one controller: drive up, dock, wait, drive on straight, undock, drive away.

`DockingMission` gives a controller its orders, one step after the other, and reports the result of each.
"""

from __future__ import annotations

from rti_mpcc.mission.docking_mission import DockingMission

__all__ = ["DockingMission"]
