"""The controller that a scenario is driven by."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol, runtime_checkable

from geometry import ReferencePath
from rti_mpcc.simulation.goal_feed import GoalSource, source_in
from rti_mpcc.simulation.mission import mission_of
from rti_mpcc.simulation.scenario import Scenario
from rti_mpcc.simulation.site import Site

if TYPE_CHECKING:
    from rti_mpcc.docking import DockingController
    from rti_mpcc.mission import DockingMission


@runtime_checkable
class Planner(Protocol):
    """What a controller that plans its way tells of that.

    Attributes:
        path: that it drives on; None before it has found one.
        replans: how often it planned another way than the first one.
        planning_seconds: that all searches took [s].
    """

    @property
    def path(self) -> ReferencePath | None: ...  # noqa: D102
    @property
    def replans(self) -> int: ...  # noqa: D102
    @property
    def planning_seconds(self) -> float: ...  # noqa: D102


def planner_in(controller: object) -> Planner | None:
    """The controller, or the one that it is wrapped around, if it plans its way."""
    while (inner := getattr(controller, "controller", None)) is not None:
        controller = inner
    return controller if isinstance(controller, Planner) else None


def docking_controller(
    scenario: Scenario,
    *,
    preset: str = "default",
    method: str = "dynamic",
    goal_source: GoalSource = GoalSource.DETECTED,
) -> DockingController:
    """The controller that `simulate` makes from a scenario, without its mission: to wrap it in something.

    Raises InputError for an unknown preset or method, or a goal source that needs a detector where there is
    none.
    """
    source = source_in(scenario.name, goal_source, detector=scenario.goal.measurement is not None)
    config = scenario.controller_config(preset, method=method, detections=source is GoalSource.DETECTED)
    return Site.of(scenario).controller(config)


def driver_of(
    scenario: Scenario,
    *,
    preset: str = "default",
    method: str = "dynamic",
    goal_source: GoalSource = GoalSource.DETECTED,
) -> DockingController | DockingMission:
    """The same with the scenario's mission, if it has one: to wrap it in something, such as a recorder."""
    core = docking_controller(scenario, preset=preset, method=method, goal_source=goal_source)
    return mission_of(scenario, core)
