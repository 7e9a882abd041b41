"""Obstacles from cycle to cycle: which are the same, which of them move, and what of a change counts.

An obstacle is given as a polygon, or with its velocity (`rti_mpcc.types.Obstacle`). A polygon is matched with
the obstacle of the last cycle whose middle is nearest, if it can have come from there; its velocity is that
of its middle over the last moments.

A static obstacle keeps its outline until one is given that differs from it by more than `MOVED`: another
order of obstacles or corners, rounding, and noise of a centimetre change nothing. One that differs by less
than `JUMP` has to last: the cells of a map flicker.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from math import inf, log, sqrt
from operator import itemgetter
from typing import Any

import numpy as np
import shapely
from numpy.typing import ArrayLike

from geometry import CorridorError
from geometry.arrays import locked
from geometry.outline import CheckedShape, Shape, checked_shape
from rti_mpcc.types import Array, Index, Obstacle

MOVED = 0.05  # [m] of its middle within OBSERVATION: the obstacle moves; what differs by less is no change
OBSERVATION = 0.3  # [s] over which the speed of an obstacle is measured
CLEAR_TIME = 1.0  # [s] without: an obstacle stands again, a vehicle that was stopped drives on
FASTEST = 10.0  # [m/s]; what seems to move faster is another obstacle
JUMP = 0.2  # [m] by which noise may put a middle elsewhere, at most
LASTING = 0.5  # [s] for which another outline of what stands, by `JUMP` at most, is given before it counts
SIGMAS = 7.0  # by which the difference of two middles exceeds their noise: once in 200,000
NOISE_READINGS = 5, 20  # by which that noise is known, at least and at most
FORGOTTEN = 1.0  # [s] without being given: an obstacle is where it was, and stands

_ROUNDED = 1e-9  # [s] by which differences of times are
ROUNDING = 1e-6  # [m]; middles of obstacles that are nearer to each other are at the same place


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TrackedObstacle:
    """An obstacle and what was seen of its motion.

    Attributes:
        index: in the list that was told last.
        outline: (m, 2) as it was given last [m]; checked: the shape that counts for it.
        steady_since: since when each outline has been that before, to within `MOVED` [s].
        due: when the outline counts, if it stays until then [s], or inf where it is that shape.
        readings: (time [s], x [m], y [m]) of each place of its middle, the newest last, and since when it was
            there; of the place before, since when at the latest. A map that is slower than the cycles gives
            each of them several times.
        velocity: (2,) [m/s]; 0 while it stands; turn_rate: as given [rad/s].
        moves: whether it moves; still_since: since when it has not [s], for one that did.
        stated: its motion was given with it; name: in reasons, or "".
    """

    index: int
    outline: Array
    checked: CheckedShape
    readings: tuple[tuple[float, float, float], ...]
    velocity: Array
    steady_since: float
    due: float = inf
    moves: bool = False
    still_since: float | None = None
    turn_rate: float = 0.0
    stated: bool = False
    name: str = ""

    @property
    def middle(self) -> tuple[float, float]:
        """Where it is [m]."""
        return self.readings[-1][1:]

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
        return float(np.hypot(*(self.outline - self.middle).T).max()) if self.turn_rate else 0.0

    @property
    def settled(self) -> bool:
        """Whether it stays the same if it is given again as it is: that tells nothing new of its motion."""
        return not (self.moves or self.stated)

    def given_again(self, now: float) -> TrackedObstacle:
        """This obstacle, without a stated motion, given at `now` [s] once more as it is."""
        return self if self.settled else replace(self, **self._motion(self.readings, now))

    def seen_as(self, new: TrackedObstacle, now: float, last: float) -> TrackedObstacle:
        """This obstacle, given at `now` [s] as `new`; until `last` [s] it was at its known place."""
        if now - last > FORGOTTEN:
            return new
        readings = self._read(new.middle, now, last)
        known = {"readings": readings} | ({} if new.stated else self._motion(readings, now))
        if self.moves or known.get("moves", new.moves):
            return replace(new, **known)
        apart = _apart(self.checked, new.checked)
        steady = _apart(_checked(self.outline), new.checked) <= MOVED
        known["steady_since"] = since = self.steady_since if steady else now
        if apart <= MOVED:
            known["checked"] = self.checked
        elif apart <= JUMP and now < since + LASTING:  # it may show for a moment, as in a map that flickers
            known |= {"checked": self.checked, "due": since + LASTING}
        return replace(new, **known)

    def _read(
        self, here: tuple[float, float], now: float, last: float
    ) -> tuple[tuple[float, float, float], ...]:
        """The readings with the place where it is given at `now` [s]: those since `OBSERVATION`, at least."""
        since, x, y = self.readings[-1]
        if here == (x, y):
            return self.readings
        # It has not just left: a map slower than the cycles gave it where it was when that was read.
        left = max(since, min(now - OBSERVATION, last))
        readings = (*self.readings[:-1], (left, x, y), (now, *here))
        old = _place_at(readings, now - OBSERVATION)
        return readings[min(old, max(len(readings) - NOISE_READINGS[1], 0)) :]

    def _motion(self, readings: tuple[tuple[float, float, float], ...], now: float) -> dict[str, Any]:
        """Whether and how fast this obstacle moves, by its readings until now."""
        moved = np.subtract(readings[-1][1:], readings[_place_at(readings, now - OBSERVATION)][1:])
        distance = float(np.hypot(*moved))
        displaced = distance > MOVED and (distance > JUMP or distance > SIGMAS * _noise(readings, now))
        since_when = None if displaced else (now if self.still_since is None else self.still_since)
        still = not self.moves or (since_when is not None and now - since_when >= CLEAR_TIME)
        if (still and not displaced) or not moved.any():
            return {"velocity": np.zeros(2), "moves": not still, "still_since": None if still else since_when}
        ended, *place = readings[-1]
        began, *first = readings[_place_at(readings, ended - OBSERVATION)]
        velocity = np.subtract(place, first) / max(ended - began, distance / FASTEST)
        return {"velocity": velocity, "moves": True, "still_since": since_when}

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
    def _stay_until(self) -> float:
        """Until when the same outlines, given again, change nothing [s]."""
        return min((each.due if each.settled else -inf for each in self.obstacles), default=inf)

    @cached_property
    def _joined(self) -> tuple[Array, list[int]]:
        return _join([each.outline for each in self.obstacles])

    def are_given_again(self, given: Any, now: float) -> bool:
        """Whether these are bare outlines, at `now` [s] the same as those of all obstacles, settled ones."""
        if now >= self._stay_until or not isinstance(given, list | tuple | np.ndarray):
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
    try:
        checked = _checked(corners)
    except CorridorError:  # told with its number
        checked = CheckedShape(checked_shape(corners, f"obstacles[{index}]"))
    middle = checked.shape.centroid
    name = given.name if isinstance(given, Obstacle) else ""
    readings, stands = ((now, middle.x, middle.y),), np.zeros(2)
    found = TrackedObstacle(
        index=index,
        outline=corners,
        checked=checked,
        readings=readings,
        velocity=stands,
        steady_since=now,
        name=name,
    )
    if not isinstance(given, Obstacle) or given.velocity is None:
        return found
    velocity, turn_rate = np.array(given.velocity), given.turn_rate
    moves = bool(velocity.any()) or turn_rate != 0.0
    return replace(found, stated=True, velocity=velocity, turn_rate=turn_rate, moves=moves)


def _checked(corners: Array) -> CheckedShape:
    return _checked_once(corners.shape, corners.tobytes())


@lru_cache(maxsize=4096)
def _checked_once(size: tuple[int, ...], corners: bytes) -> CheckedShape:
    """The shape of an outline: a map that flickers gives the same ones again and again."""
    return CheckedShape(checked_shape(np.frombuffer(corners).reshape(size), "obstacles"))


def _apart(one: CheckedShape, other: CheckedShape) -> float:
    return float(shapely.hausdorff_distance(one.shape, other.shape))


def observed(
    known: tuple[TrackedObstacle, ...], outlines: Sequence[ArrayLike], now: float, last: float
) -> tuple[TrackedObstacle, ...]:
    """The obstacles given at `now` [s], by those `known`, given at `last`; the same tuple if nothing is new.

    Raises:
        CorridorError: one that is no simple polygon.
    """
    same = [
        k < len(known)
        and now < known[k].due
        and not (isinstance(each, Obstacle) and each.velocity is not None)
        and np.array_equal(known[k].outline, each)
        for k, each in enumerate(outlines)
    ]
    if all(same) and len(known) == len(outlines) and all(each.settled for each in known):
        return known
    given = [known[k] if same[k] else first_seen(k, each, now) for k, each in enumerate(outlines)]
    left = np.ones(len(known), dtype=bool)
    left[: len(same)] = np.logical_not(same[: len(known)])
    farthest = FASTEST * min(now - last, FORGOTTEN) + JUMP
    middles = np.array([each.middle for each in known]).reshape(-1, 2)
    for k, obstacle in enumerate(given):
        if same[k]:
            given[k] = obstacle.given_again(now)
            continue
        place = _match(obstacle, known, middles, np.flatnonzero(left), farthest)
        if place is not None:
            left[place] = False
            given[k] = known[place].seen_as(obstacle, now, last)
    return tuple(given)


def _noise(readings: Sequence[tuple[float, float, float]], now: float) -> float:
    """Standard deviation of readings along an axis [m], by the upper quartile of their second differences:
    neither an even motion nor a sudden one changes it much. Three within `OBSERVATION` tell it."""
    at_once = len(readings) >= 3 and readings[-3][0] >= now - OBSERVATION
    if len(readings) < NOISE_READINGS[0] and not at_once:
        return JUMP
    second = np.diff(readings[-NOISE_READINGS[1] :], 2, axis=0)[:, 1:]
    return sqrt(float(np.quantile((second**2).sum(axis=1), 0.75)) / (12.0 * log(4.0)))


def _place_at(readings: Sequence[tuple[float, float, float]], time: float) -> int:
    """The place where it was at a time [s], or the first one that is known."""
    return max(bisect_right(readings, time + _ROUNDED, key=itemgetter(0)) - 1, 0)


def obstacles_changed(
    before: Sequence[TrackedObstacle], now: Sequence[TrackedObstacle], least: float
) -> bool:
    """Whether what they cover has changed: some point of it is elsewhere by more than `least` [m]."""
    return _reach_beyond(before, now, least) or _reach_beyond(now, before, least)


def _reach_beyond(some: Sequence[TrackedObstacle], others: Sequence[TrackedObstacle], least: float) -> bool:
    """Whether a point of some obstacles is farther than `least` [m] from all others."""
    same, twins = {id(each.checked) for each in others}, {each.index: each.checked for each in others}
    changed = [each for each in some if id(each.checked) not in same]
    apart = [
        each.shape
        for each in changed
        if each.index not in twins or _apart(each.checked, twins[each.index]) > least
    ]
    if not apart:
        return False
    shapes, here = np.array([each.shape for each in others], dtype=object), shapely.union_all(apart)
    near = shapely.buffer(shapes[shapely.dwithin(shapes, here, least)], least)
    return not shapely.covers(shapely.union_all(near), here)


def _match(
    new: TrackedObstacle, known: Sequence[TrackedObstacle], middles: Array, left: Index, farthest: float
) -> int | None:
    """The known obstacle among those `left`, by their middles (k, 2), that this one can be: the nearest; of
    several at the same place the most similar one."""
    apart = np.hypot(*(middles[left] - new.middle).T)
    least = apart.min(initial=inf)
    if least > farthest:
        return None
    nearest = left[apart <= least + ROUNDING].tolist()
    return int(min(nearest, key=lambda k: _apart(known[k].checked, new.checked)))
