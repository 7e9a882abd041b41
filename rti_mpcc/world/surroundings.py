"""Where the vehicle may be: the corridor with the obstacles that are known by now, and which of them move.

An obstacle is given as a polygon, or with its velocity (`rti_mpcc.types.Obstacle`). A polygon is matched with
the obstacle of the last cycle whose middle is nearest, if it can have come from there; its velocity is that
of its middle over the last moments.

A static obstacle keeps its outline until one is given that differs from it by more than `MOVED`: another
order of obstacles or corners, rounding, and noise of a centimetre change nothing.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import log, sqrt
from typing import Any

import numpy as np
import shapely
from numpy.typing import ArrayLike

from geometry import Area, Corridor, CorridorError, ReferencePath
from geometry.arrays import locked
from geometry.corridor import with_shapes
from geometry.corridor_area import area_of
from geometry.outline import CheckedShape, Shape, checked_shape
from rti_mpcc.config import ControllerConfig
from rti_mpcc.ocp.side_clearance import SideClearance
from rti_mpcc.types import Array, Index, Obstacle

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


# -- obstacles from cycle to cycle --------------------------------------------------------------------

MOVED = 0.05  # [m] of its middle within OBSERVATION: the obstacle moves; what differs by less is no change
OBSERVATION = 0.3  # [s] over which the speed of an obstacle is measured
CLEAR_TIME = 1.0  # [s] without: an obstacle stands again, a vehicle that was stopped drives on
FASTEST = 10.0  # [m/s]; what seems to move faster is another obstacle
JUMP = 0.2  # [m] by which noise may put a middle elsewhere, at most
SIGMAS = 7.0  # by which the difference of two middles exceeds their noise: once in 200,000
NOISE_READINGS = 20  # by which that noise is known, at most
FORGOTTEN = 1.0  # [s] without being given: an obstacle is where it was, and stands

ROUNDING = 1e-6  # [m]; middles of obstacles that are nearer to each other are at the same place


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TrackedObstacle:
    """An obstacle and what was seen of its motion.

    Attributes:
        index: in the list that was told last.
        outline: (m, 2) as it was given when it was last seen to have moved [m]; checked: the same.
        seen: (time [s], x [m], y [m]) of its middle over the last moments, the newest last.
        velocity: (2,) [m/s]; 0 while it stands; turn_rate: as given [rad/s].
        moves: whether it moves; still_since: since when it has not [s], for one that did.
        readings: (x [m], y [m]) of its middle when it was last seen anew; a map that is slower than the
            cycles gives each of them several times.
        stated: its motion was given with it; name: in reasons, or "".
    """

    index: int
    outline: Array
    checked: CheckedShape
    seen: tuple[tuple[float, float, float], ...]
    velocity: Array
    moves: bool = False
    still_since: float | None = None
    turn_rate: float = 0.0
    readings: tuple[tuple[float, float], ...] = ()
    stated: bool = False
    name: str = ""

    @property
    def speed(self) -> float:
        """Of its middle [m/s]."""
        return float(np.hypot(*self.velocity))

    @property
    def turning(self) -> float:
        """How much faster than its middle a corner may be [m/s]."""
        return abs(self.turn_rate) * self.radius

    @property
    def radius(self) -> float:
        """Of the circle around its middle with all of it [m], if it turns."""
        return float(np.hypot(*(self.outline - self.seen[-1][1:]).T).max()) if self.turn_rate else 0.0

    @property
    def settled(self) -> bool:
        """Whether it stays the same if it is given again as it is: that tells nothing new of its motion."""
        return not (self.moves or self.stated)

    def seen_as(self, new: TrackedObstacle, now: float, last: float) -> TrackedObstacle:
        """This obstacle, given at `now` [s] as `new`; until `last` [s] it was at its known place."""
        before = self._seen_before(now, last)
        if not before:
            return new
        if not new.stated:
            new = self._moved(replace(new, seen=(*before, *new.seen)))
        stands = not (new.moves or self.moves)
        kept = stands and shapely.hausdorff_distance(self.shape, new.shape) <= MOVED
        return replace(new, outline=self.outline, checked=self.checked) if kept else new

    def seen_again(self, index: int, now: float, last: float) -> TrackedObstacle:
        """This obstacle, a settled one, given once more as it is."""
        seen = (*self._seen_before(now, last), (now, *self.seen[-1][1:]))
        return replace(self, index=index, seen=seen)

    def _seen_before(self, now: float, last: float) -> list[tuple[float, float, float]]:
        """Of the moments that are known: the newest that is old enough, and all since."""
        stood = ((last, *self.seen[-1][1:]),) if last > self.seen[-1][0] else ()
        known = [each for each in (*self.seen, *stood) if each[0] < now and now - each[0] <= FORGOTTEN]
        old = max((k for k, each in enumerate(known) if now - each[0] >= OBSERVATION), default=0)
        return known[old:]

    def _moved(self, new: TrackedObstacle) -> TrackedObstacle:
        """Whether and how fast this obstacle moves, by where it was seen until now."""
        (since, *first), (now, *last) = new.seen[0], new.seen[-1]
        moved = np.subtract(last, first)
        distance = float(np.hypot(*moved))
        displaced = distance > MOVED and distance > min(SIGMAS * self._noise(), JUMP)
        since_when = None if displaced else (now if self.still_since is None else self.still_since)
        still = not self.moves or (since_when is not None and now - since_when >= CLEAR_TIME)
        readings, here = self.readings, (last[0], last[1])
        if readings[-1:] != (here,):
            readings = (*readings, here)[-NOISE_READINGS:]
        if still and not displaced:
            return replace(new, velocity=np.zeros(2), moves=False, still_since=None, readings=readings)
        velocity = moved / max(now - since, distance / FASTEST)
        return replace(new, velocity=velocity, moves=True, still_since=since_when, readings=readings)

    def _noise(self) -> float:
        """Standard deviation of the readings along an axis [m], by the median of their second differences:
        neither an even motion nor a sudden one changes it much."""
        if len(self.readings) < 3:
            return 0.0
        second = np.diff(self.readings, 2, axis=0)
        return sqrt(float(np.median((second**2).sum(axis=1))) / (12.0 * log(2.0)))

    @property
    def shape(self) -> Shape:
        """The same as a point, a line or a polygon [m]."""
        return self.checked.shape


@dataclass(frozen=True, eq=False)
class Tracked:
    """The obstacles of a cycle. What follows from all of them is found once, when it is first needed."""

    obstacles: tuple[TrackedObstacle, ...]

    @cached_property
    def standing(self) -> tuple[TrackedObstacle, ...]:
        """Those that stand."""
        return tuple([each for each in self.obstacles if not each.moves])

    @cached_property
    def moving(self) -> tuple[TrackedObstacle, ...]:
        """Those that move."""
        return tuple([each for each in self.obstacles if each.moves])

    @cached_property
    def _settled(self) -> bool:
        return all(each.settled for each in self.obstacles)

    @cached_property
    def _joined(self) -> tuple[Array, list[int]]:
        return _join([each.outline for each in self.obstacles])

    def are_given_again(self, given: Any) -> bool:
        """Whether these are bare outlines, the same as those of all obstacles, which are settled."""
        if not (self._settled and isinstance(given, list | tuple | np.ndarray)):
            return False
        try:
            (corners, counts), known = _join(given), self._joined
        except (TypeError, ValueError):  # not bare ones, or not readable
            return False
        return counts == known[1] and np.array_equal(corners, known[0])


def _join(outlines: Any) -> tuple[Array, list[int]]:
    """Corners (k, 2) of outlines, one after the other [m], and how many each has. Raises TypeError for an
    `Obstacle`, which says more than where it is, and ValueError for what is no outline."""
    return np.concatenate([np.empty((0, 2)), *outlines]), list(map(len, outlines))


def first_seen(index: int, given: ArrayLike, now: float) -> TrackedObstacle:
    """An obstacle that was not known before. Raises CorridorError if it is no simple polygon."""
    corners = locked(np.array(given, dtype=np.float64))
    checked = CheckedShape(checked_shape(corners, f"obstacles[{index}]"))
    middle = checked.shape.centroid
    name = given.name if isinstance(given, Obstacle) else ""
    seen, stands = ((now, middle.x, middle.y),), np.zeros(2)
    found = TrackedObstacle(
        index=index, outline=corners, checked=checked, seen=seen, velocity=stands, name=name
    )
    if not isinstance(given, Obstacle) or given.velocity is None:
        return found
    velocity, turn_rate = np.array(given.velocity), given.turn_rate
    moves = bool(velocity.any()) or turn_rate != 0.0
    return replace(found, stated=True, velocity=velocity, turn_rate=turn_rate, moves=moves)


def observed(
    known: tuple[TrackedObstacle, ...], outlines: Sequence[ArrayLike], now: float, last: float
) -> tuple[TrackedObstacle, ...]:
    """The obstacles given at `now` [s], by those `known`, given at `last`; the same tuple if nothing is new.

    Raises:
        CorridorError: one that is no simple polygon.
    """
    same = [
        k < len(known) and not _states_motion(each) and np.array_equal(known[k].outline, each)
        for k, each in enumerate(outlines)
    ]
    if all(same) and len(known) == len(outlines) and all(each.settled for each in known):
        return known
    given = [known[k] if same[k] else first_seen(k, each, now) for k, each in enumerate(outlines)]
    left = np.array([not (k < len(same) and same[k]) for k in range(len(known))], dtype=bool)
    farthest = FASTEST * min(now - last, FORGOTTEN) + JUMP
    middles = np.array([each.seen[-1][1:] for each in known]).reshape(-1, 2)
    found = []
    for k, obstacle in enumerate(given):
        if same[k] and obstacle.settled:
            found.append(obstacle.seen_again(k, now, last))
            continue
        place = k if same[k] else _match(obstacle, known, middles, np.flatnonzero(left), farthest)
        if place is None:
            found.append(obstacle)
            continue
        left[place] = False
        here = replace(obstacle, index=k, seen=((now, *obstacle.seen[-1][1:]),))
        found.append(known[place].seen_as(here, now, last))
    return tuple(found)


def _states_motion(given: ArrayLike) -> bool:
    return isinstance(given, Obstacle) and given.velocity is not None


def obstacles_changed(
    before: Sequence[TrackedObstacle], now: Sequence[TrackedObstacle], least: float
) -> bool:
    """Whether what they cover has changed: some point of it is elsewhere by more than `least` [m]."""
    one, other = (shapely.union_all([each.shape for each in known]) for known in (before, now))
    if one.is_empty or other.is_empty:
        return bool(one.is_empty != other.is_empty)
    return bool(shapely.hausdorff_distance(one, other) > least)


def _match(
    obstacle: TrackedObstacle, known: Sequence[TrackedObstacle], middles: Array, left: Index, farthest: float
) -> int | None:
    """The known obstacle among those `left`, by their middles (k, 2), that this one can be: the nearest; of
    several at the same place the most similar one."""
    apart = np.hypot(*(middles[left] - obstacle.seen[-1][1:]).T)
    if not apart.size or apart.min() > farthest:
        return None
    nearest = left[apart <= apart.min() + ROUNDING].tolist()
    return int(min(nearest, key=lambda k: shapely.hausdorff_distance(known[k].shape, obstacle.shape)))
