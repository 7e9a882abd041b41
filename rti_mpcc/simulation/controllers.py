"""The controller of a scenario with its mission, and both of them inside of wrappers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from geometry import Pose2
from rti_mpcc.config import ControllerConfig
from rti_mpcc.docking import DockingController
from rti_mpcc.mission import DockingMission
from rti_mpcc.mission.state import StepRecord
from rti_mpcc.simulation.goal_feed import GoalSource, source_in
from rti_mpcc.simulation.scenario import Scenario
from rti_mpcc.types import MissionResult


def controller_of(scenario: Scenario, config: ControllerConfig) -> DockingController:
    """The controller along the scenario's path, or in its area. Raises InputError."""
    if scenario.in_area:
        return DockingController.in_area(scenario.build_area(), config)
    path = scenario.build_path()
    return DockingController(path, scenario.build_corridor(path), config)


def mission_of(scenario: Scenario, controller: DockingController) -> DockingMission | DockingController:
    """The controller with the scenario's mission, or itself where there is none."""
    if not scenario.mission:
        return controller
    goal = scenario.planned_goal() if scenario.in_area else None
    body = None if scenario.goal.body is None else np.array(scenario.goal.body)
    home = None if scenario.home is None else Pose2(*scenario.home.pose)
    return DockingMission(controller, [each.build(goal, body) for each in scenario.mission], home=home)


def docking_controller(
    scenario: Scenario,
    *,
    preset: str = "default",
    method: str | None = None,
    goal_source: GoalSource = GoalSource.DETECTED,
) -> DockingController:
    """The controller that `simulate` makes, without the mission. Raises InputError."""
    source = source_in(scenario.name, goal_source, detector=scenario.goal.measurement is not None)
    config = scenario.controller_config(preset, method=method, detections=source is GoalSource.DETECTED)
    return controller_of(scenario, config)


def driver_of(scenario: Scenario, **options: Any) -> DockingController | DockingMission:
    """`docking_controller` and its options, with the scenario's mission if there is one."""
    return mission_of(scenario, docking_controller(scenario, **options))


def all_succeeded(result: MissionResult | None, log: Sequence[StepRecord]) -> bool:
    """Whether a mission ended and the last try of each step succeeded; True where there was none.

    A mission that continues after a failed step (`then="continue"`) succeeds, but not with all of its steps.
    """
    last_tries = {record.place: record.result for record in log}
    succeeded = MissionResult.SUCCEEDED
    return result in (None, succeeded) and all(each is succeeded for each in last_tries.values())
