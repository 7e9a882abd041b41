"""Where a run takes place: along a path in its corridor, or in an area."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from geometry import Area, Corridor, Pose2, ReferencePath
from rti_mpcc.config import ControllerConfig
from rti_mpcc.simulation.scenario import Scenario
from rti_mpcc.types import Array

if TYPE_CHECKING:
    from rti_mpcc.docking import DockingController

Changes = Sequence[tuple[float, Sequence[Array]]]
"""From when on [s] there are which obstacles (k, 2) [m]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Site:
    """Where a run takes place: along a path in its corridor, or in an area.

    Attributes:
        start: of the vehicle; path, corridor: None in an area; area: None along a path.
    """

    start: Pose2
    path: ReferencePath | None = None
    corridor: Corridor | None = None
    area: Area | None = None

    @classmethod
    def of(cls, scenario: Scenario) -> Site:
        """That of a scenario. Raises InputError."""
        if scenario.in_area:
            return cls(start=scenario.start_pose(), area=scenario.build_area())
        path = scenario.build_path()
        return cls(start=scenario.start_pose(), path=path, corridor=scenario.build_corridor(path))

    def controller(self, config: ControllerConfig) -> DockingController:
        """The one to drive there, which is loaded here only: the harness serves others without it."""
        from rti_mpcc.docking import DockingController

        if self.area is not None:
            return DockingController.in_area(self.area, config)
        assert self.path is not None
        assert self.corridor is not None
        return DockingController(self.path, self.corridor, config)

    def corridors(self, changes: Changes) -> tuple[tuple[float, Corridor], ...]:
        """The corridor with the obstacles of each time; none in an area."""
        corridor = self.corridor
        return () if corridor is None else tuple((at, corridor.with_obstacles(some)) for at, some in changes)

    def besides(self, changes: Changes) -> tuple[tuple[float, tuple[Array, ...]], ...]:
        """The obstacles of each time besides those of the area; none along a path."""
        return () if self.area is None else tuple((at, tuple(some)) for at, some in changes)
