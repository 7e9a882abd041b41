"""A manoeuvre is a list of segments, each driven in one direction and ended at rest.

Parts of a path and of a planned route are segments, driven in the same way.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum
from itertools import groupby, pairwise
from math import inf, nan, radians

from geometry import InputError, PathError, PathPart, Pose2, ReferencePath
from geometry.settings import replaced
from geometry.validation import Validated, validate, validated
from rti_mpcc.config import ControllerConfig
from rti_mpcc.ocp.objectives import CONTOURING, HorizonObjective, Target

WHOLE_TOLERANCE = 1.0
"""Least length of a segment whose end has the whole tolerance of a cusp [m]; a shorter one has a share."""
CUSP_TOLERANCE = (0.1, 0.1, radians(3.0))  # [m], [m], [rad] at a cusp or staging pose


class SegmentEnd(Enum):
    """What a segment ends at."""

    GOAL = "goal"
    """The goal pose, known or detected, beside or behind the path's end."""
    CUSP = "cusp"
    STOP = "stop before something in the way"
    """Only made by the controller."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Segment(Validated):
    """A piece of a manoeuvre in one direction. Equal to itself only: driven twice, it starts twice.

    Attributes:
        part: the geometry.
        index: of the route's part whose boundaries count.
        end: see `SegmentEnd`.
        tolerance: there (longitudinal [m], lateral [m], heading [rad]).
        speed, steering: limits of its own [m/s], [rad], or None for the vehicle's.
        wheels: angle to which the wheels are turned at rest before its start [rad]; None: as they are.
        margin: clearance of the planned route [m]: if it is less than `Clearance.wanted`, no more is kept, as
            far as `Clearance.least` allows. None: not known.
        dwell: least time [s] at rest at its end, a cusp.
        objective: until an arrival is planned or another objective takes over.
        target: where it ends, by its part and the goal or None; None: at the goal, or the part's own end.

    Raises:
        InputError: a limit or tolerance that is not positive, or a negative margin or dwell.
    """

    part: PathPart
    index: int
    end: SegmentEnd = SegmentEnd.CUSP
    tolerance: tuple[float, float, float] = CUSP_TOLERANCE
    speed: float | None = None
    steering: float | None = None
    wheels: float | None = None
    margin: float | None = None
    dwell: float = 0.0
    objective: HorizonObjective = CONTOURING
    target: Callable[[PathPart, Pose2 | None], Target] | None = None

    def __post_init__(self) -> None:
        validate(self)
        for name, limit in (("speed", self.speed), ("steering", self.steering)):
            if limit is not None and not limit > 0.0:
                raise InputError(f"{name} = {limit}: a limit of a segment must be > 0, or None")
        if self.margin is not None and not self.margin >= 0.0:
            raise InputError(f"margin = {self.margin}: must be >= 0, or None")
        if not all(most > 0.0 for most in self.tolerance):
            raise InputError(f"tolerance = {self.tolerance}: each must be > 0")
        if not 0.0 <= self.dwell < inf:
            raise InputError(f"dwell = {self.dwell}: must be >= 0, and finite")
        if self.dwell and self.end is not SegmentEnd.CUSP:
            raise InputError(f"dwell = {self.dwell}: only at a cusp something comes after it")

    @property
    def length(self) -> float:
        """Of its part [m]."""
        return self.part.end - self.part.start

    @validated(late=True)
    def limited(self, config: ControllerConfig) -> ControllerConfig:
        """The settings with the limits and the margin of this segment, where it has some that are lower."""
        limits, wanted = config.limits, config.clearance.wanted
        speed = limits.speed if self.speed is None else min(self.speed, limits.speed)
        steering = limits.steering if self.steering is None else min(self.steering, limits.steering)
        margin = wanted if self.margin is None else min(max(self.margin, config.planned_minimum), wanted)
        if (speed, steering, margin) == (limits.speed, limits.steering, wanted):
            return config
        own = {
            "limits": replaced(limits, speed=speed, steering=steering),
            "clearance": replaced(config.clearance, wanted=margin),
        }
        return replaced(config, **own)


Segments = tuple[Segment, ...]


class PlanOutcome(Enum):
    """What a search for a manoeuvre came to."""

    FOUND = "found"
    START_IN_COLLISION = "the body at the start is too near to something, or in it"
    GOAL_IN_COLLISION = "the body at the goal is too near to something, or in it"
    GOAL_TOO_FAR = "the goal is farther away than routes are planned"
    NO_ROUTE = "there is none that this vehicle can drive"
    BUDGET_SPENT = "none was found within the budget"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Manoeuvre:
    """What `plan_manoeuvre` found: segments from a start to a goal, or why there are none.

    Attributes:
        start, goal: poses that were asked for.
        outcome: see `PlanOutcome`.
        reason: why there is none, in words; "" where it was found.
        segments: in the order in which they are driven, each in one direction; none where nothing was found.
        clearance: least of the body to all that stands, along the way [m]; NaN where nothing was found.
        nearest: how near to the goal the search came, 0 where it was found [m].
        nodes: number of poses that the search expanded.
        seconds: time that it took [s].
    """

    start: Pose2
    goal: Pose2
    outcome: PlanOutcome
    reason: str = ""
    segments: Segments = ()
    clearance: float = nan
    nearest: float = inf
    nodes: int = 0
    seconds: float = 0.0

    @property
    def found(self) -> bool:
        """Whether there is a way."""
        return self.outcome is PlanOutcome.FOUND

    @property
    def path(self) -> ReferencePath:
        """The way. Raises PathError where none was found."""
        if not self.found:
            raise PathError(f"there is no route: {self.reason}")
        return ReferencePath(parts=tuple(segment.part for segment in self.segments))

    @property
    def length(self) -> float:
        """Of the way [m]; 0 where none was found."""
        return self.segments[-1].part.end - self.segments[0].part.start if self.segments else 0.0

    @property
    def cusps(self) -> int:
        """How often the direction changes; a stop to turn the wheels is no change."""
        directions = [segment.part.direction for segment in self.segments]
        return sum(before != after for before, after in pairwise(directions))


@validated()
def segments_of(path: ReferencePath, config: ControllerConfig) -> Segments:
    """The manoeuvre along a path, to its end or to a goal near it, by the objective of the settings."""
    *before, last = (Segment(part=part, index=k) for k, part in enumerate(path.parts))
    last = replace(last, end=SegmentEnd.GOAL, tolerance=config.goal_tolerance)
    return config.objective.segments((*before, last), config)


def checked_manoeuvre(segments: Segments, path: ReferencePath) -> Segments:
    """The segments, if they are a manoeuvre along this path.

    Raises:
        InputError: none, one that is no part of the path, parts left out or out of order, one that ends at
            the goal and is not the last, or a stop, which only the controller makes.
    """
    if not segments:
        raise InputError("segments: a manoeuvre needs one at least")
    for place, segment in enumerate(segments):
        name = f"segments[{place}]"
        if not 0 <= segment.index < len(path.parts):
            raise InputError(f"{name}.index = {segment.index}: the path has {len(path.parts)} parts")
        if segment.part is not path.parts[segment.index]:
            raise InputError(f"{name}.part: must be part {segment.index} of the path")
        if (segment.end is SegmentEnd.GOAL) != (place == len(segments) - 1):
            raise InputError(f"{name}.end: the last segment ends at the goal, and no other one")
        if segment.end is SegmentEnd.STOP:
            raise InputError(f"{name}: only the controller makes stops")
    driven = [index for index, _ in groupby(segment.index for segment in segments)]
    if driven != list(range(len(path.parts))):
        raise InputError(f"segments: drive parts {driven} of the path, must be all of them in order")
    return tuple(segments)
