"""The controller that a scenario is driven by."""

from __future__ import annotations

from typing import TYPE_CHECKING

from geometry import Corridor, ReferencePath
from rti_mpcc.config import ControllerConfig
from rti_mpcc.simulation.goal_feed import GoalSource, source_in
from rti_mpcc.simulation.scenario import Scenario

if TYPE_CHECKING:
    from rti_mpcc.docking import DockingController


def docking_controller(
    scenario: Scenario,
    *,
    preset: str = "default",
    method: str = "dynamic",
    goal_source: GoalSource = GoalSource.DETECTED,
) -> DockingController:
    """The controller that `simulate` makes from a scenario: to wrap it in something, such as a recorder.

    Raises InputError for an unknown preset or method, or a goal source that needs a detector where there is
    none.
    """
    source = source_in(scenario.name, goal_source, detector=scenario.goal.measurement is not None)
    config = scenario.controller_config(preset, method=method, detections=source is GoalSource.DETECTED)
    path = scenario.build_path()
    return controller_on(path, scenario.build_corridor(path), config)


def controller_on(path: ReferencePath, corridor: Corridor, config: ControllerConfig) -> DockingController:
    """A `DockingController`, which is loaded here and not before: the harness serves others without it."""
    from rti_mpcc.docking import DockingController

    return DockingController(path, corridor, config)
