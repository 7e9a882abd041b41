"""Where the vehicle may be: the corridor, or the area, with the obstacles that are known by now."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from geometry import Area, Corridor, CorridorError, ReferencePath
from geometry.corridor import with_shapes
from geometry.corridor_area import area_of
from rti_mpcc.config import ControllerConfig
from rti_mpcc.ocp.side_clearance import SideClearance
from rti_mpcc.world.obstacles import Tracked, first_seen, observed

GOAL_REACH = 20.0  # [m] from the path's last part: a goal beyond it is taken for a mistake

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Surroundings:
    """A corridor and its obstacles.

    Attributes:
        corridor: with the static obstacles, which plans avoid; known: with all obstacles.
        tracked: the obstacles.
        given_at: when they were given last [s].
        replaced: whether the area is another one than that in which the route was planned.
        changes: number of changes of the static ones, and of the area.
        unreadable: why the last given ones are not used, or "".
    """

    corridor: Corridor
    known: Corridor
    tracked: Tracked
    replaced: bool = False
    given_at: float = 0.0
    changes: int = 0
    unreadable: str = ""

    @classmethod
    def of(cls, corridor: Corridor, path: ReferencePath, config: ControllerConfig) -> Surroundings:
        """Along a path. Raises CorridorError if the corridor is narrower than the body."""
        width, theta = corridor.narrowest()
        if width < config.vehicle.least_width:
            raise CorridorError(
                f"the corridor is {width:.3f} m wide at theta = {theta:.2f} m: "
                f"it must be wider than the body, {config.vehicle.width:.3f} m"
            )
        if path.max_curvature > config.max_curvature * (1.0 + 1e-6):
            _log.warning(
                "the path's curvature reaches %.3f 1/m, the vehicle can drive %.3f 1/m",
                path.max_curvature,
                config.max_curvature,
            )
        obstacles = tuple(first_seen(k, each, 0.0) for k, each in enumerate(corridor.obstacles))
        return cls(corridor=corridor, known=corridor, tracked=Tracked(obstacles))

    @classmethod
    def in_area(cls, area: Area) -> Surroundings:
        """In an area, with no obstacles given yet."""
        corridor = Corridor.in_area(area)
        return cls(corridor=corridor, known=corridor, tracked=Tracked(()))

    def without_path(self, area: Area) -> Surroundings:
        """The same obstacles in an area, in place of a corridor along a path."""
        if self.corridor.area is area and not self.replaced:
            return self
        return replace(self._in(area), replaced=False)

    def in_another(self, area: Area) -> Surroundings:
        """The same obstacles in another area; what is new there may block the route."""
        return replace(self._in(area), replaced=True, changes=self.changes + 1)

    def _in(self, area: Area) -> Surroundings:
        return self._on(with_shapes(Corridor.in_area(area), [each.checked for each in self.tracked.standing]))

    def _on(self, corridor: Corridor) -> Surroundings:
        """In a corridor with the static obstacles."""
        known = corridor
        if self.tracked.moving:
            known = with_shapes(corridor, [each.checked for each in self.tracked.obstacles])
        return replace(self, corridor=corridor, known=known)

    def updated(self, outlines: Sequence[ArrayLike], now: float) -> Surroundings:
        """With the obstacles given at `now` [s]. Raises CorridorError for one that is no simple polygon."""
        obstacles = observed(self.tracked.obstacles, outlines, now, self.given_at)
        if obstacles is self.tracked.obstacles:
            return self.given_again(now)
        tracked = Tracked(obstacles)
        stand = [each.checked for each in tracked.standing]
        changed = {id(each) for each in stand} != {id(each.checked) for each in self.tracked.standing}
        corridor = with_shapes(self.corridor, stand) if changed else self.corridor
        after = replace(self, tracked=tracked, given_at=now, changes=self.changes + changed, unreadable="")
        return after._on(corridor)

    def given_again(self, now: float) -> Surroundings:
        """With the same obstacles, given at `now` [s] as well."""
        return replace(self, given_at=now, unreadable="")


def area_along(path: ReferencePath, corridor: Corridor, config: ControllerConfig) -> Area:
    """All of the corridor along a path, and beyond its open ends as far as a goal there needs, to replan in.

    Raises:
        CorridorError: the boundaries do not enclose the path.
    """
    vehicle = config.vehicle
    return area_of(corridor, path, beyond=GOAL_REACH + 2.0 * (vehicle.front + vehicle.rear))


def warn_if_narrow(side_clearance: SideClearance, index: int, config: ControllerConfig) -> None:
    """Warn of a part, the route's `index`-th, whose boundaries leave less than the margin beside the body."""
    left, theta = side_clearance.least
    margin, least = config.clearance.wanted, config.clearance.least
    if left >= margin:
        return
    consequence = f"it is driven there at {float(side_clearance.speed_at(np.array([theta]))[0]):.2f} m/s"
    if left < least:
        consequence = f"no plan is driven that leaves less than {least:.2f} m"
    _log.warning(
        "part %d: the boundaries leave %.3f m beside the body on the path at theta = %.2f m, "
        "less than the margin of %.2f m: %s",
        *(index, left, theta, margin, consequence),
    )
