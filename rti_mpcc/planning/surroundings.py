"""Where the vehicle may be: the corridor with the obstacles that are known by now."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from geometry import Area, Corridor, CorridorError, ReferencePath
from geometry.corridor_area import area_of
from rti_mpcc.config import ControllerConfig
from rti_mpcc.ocp.room import Room
from rti_mpcc.planning.obstacles import Obstacle, first_seen, observed
from rti_mpcc.types import Array

GOAL_REACH = 20.0  # [m] from the path's last part: a goal beyond it is taken for a mistake

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Surroundings:
    """A corridor and its obstacles.

    Attributes:
        corridor: with the static obstacles, which plans avoid; known: with all obstacles.
        obstacles: all of them; given_at: when they were given last [s].
        added: outlines of what is new in the area since the route was planned, see `in_another`.
        changes: number of changes of the static ones.
        unreadable: why the last given ones are not used, or "".
    """

    corridor: Corridor
    known: Corridor
    obstacles: tuple[Obstacle, ...]
    added: tuple[Array, ...] = ()
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
        return cls(corridor=corridor, known=corridor, obstacles=obstacles)

    @classmethod
    def in_area(cls, area: Area) -> Surroundings:
        """In an area, with no obstacles given yet."""
        corridor = Corridor.in_area(area)
        return cls(corridor=corridor, known=corridor, obstacles=())

    def without_path(self, area: Area) -> Surroundings:
        """The same obstacles in an area, in place of a corridor along a path."""
        if self.corridor.area is area and not self.added:
            return self
        return self._on(Corridor.in_area(area), ())

    def in_another(self, area: Area, added: Sequence[Array]) -> Surroundings:
        """The same obstacles in another area; `added`: shapes (m_i, 2) [m] near the route, solid since it was
        planned. They count as obstacles: the vehicle stops in front of them and replans."""
        return replace(self._on(Corridor.in_area(area), tuple(added)), changes=self.changes + 1)

    def _on(self, corridor: Corridor, added: tuple[Array, ...]) -> Surroundings:
        stand = corridor.with_obstacles([*(each.outline for each in self.standing), *added])
        known = stand
        if self.moving:
            known = corridor.with_obstacles([*(each.outline for each in self.obstacles), *added])
        return replace(self, corridor=stand, known=known, added=added)

    @property
    def standing(self) -> tuple[Obstacle, ...]:
        """The static obstacles."""
        return tuple(each for each in self.obstacles if not each.moves)

    @property
    def moving(self) -> tuple[Obstacle, ...]:
        """The moving obstacles."""
        return tuple(each for each in self.obstacles if each.moves)

    def updated(self, outlines: Sequence[ArrayLike], now: float) -> Surroundings:
        """With the obstacles given at `now` [s]. Raises CorridorError for one that is no simple polygon."""
        obstacles = observed(self.obstacles, outlines, now, self.given_at)
        if obstacles is self.obstacles:
            return replace(self, given_at=now, unreadable="")
        stand = [each.outline for each in obstacles if not each.moves]
        changed = {id(each) for each in stand} != {id(each.outline) for each in self.standing}
        corridor = self.corridor.with_obstacles([*stand, *self.added]) if changed else self.corridor
        everything = corridor
        if len(stand) < len(obstacles):
            known = [each.outline for each in obstacles]
            everything = self.corridor.with_obstacles([*known, *self.added])
        return Surroundings(
            corridor=corridor,
            known=everything,
            obstacles=obstacles,
            added=self.added,
            given_at=now,
            changes=self.changes + changed,
        )


def area_along(path: ReferencePath, corridor: Corridor, config: ControllerConfig) -> Area:
    """All of the corridor along a path, and beyond its open ends as far as a goal there needs, to replan in.

    Raises:
        CorridorError: the boundaries do not enclose the path.
    """
    vehicle = config.vehicle
    return area_of(corridor, path, beyond=GOAL_REACH + 2.0 * (vehicle.front + vehicle.rear))


def tell_if_narrow(room: Room, index: int, config: ControllerConfig) -> None:
    """Warn of a part, the route's `index`-th, whose boundaries leave less than the margin beside the body."""
    left, theta = room.least
    margin, least = config.clearance.wanted, config.clearance.least
    if left >= margin:
        return
    consequence = f"it is driven there at {float(room.speed_at(np.array([theta]))[0]):.2f} m/s"
    if left < least:
        consequence = f"no plan is driven that leaves less than {least:.2f} m"
    _log.warning(
        "part %d: the boundaries leave %.3f m beside the body on the path at theta = %.2f m, "
        "less than the margin of %.2f m: %s",
        *(index, left, theta, margin, consequence),
    )
