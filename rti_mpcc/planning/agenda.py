"""What is left of a mission, and how it goes: the part of the state that `rti_mpcc.mission` writes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import shapely
from numpy.typing import ArrayLike

from geometry import Pose2
from rti_mpcc.steps import AnyStep, Dock
from rti_mpcc.types import Array, MissionResult


@dataclass(frozen=True, slots=True, kw_only=True)
class Due:
    """A step that is to be done, its place in the mission, and how often it was tried before."""

    step: AnyStep
    place: int
    attempt: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class StepRecord:
    """A step that was begun.

    Attributes:
        kind: as in scenario files; place, attempt: as in `Due`.
        begin, end: on the controller's own clock [s]; None: it is under way.
        result: what it came to; reason: why, or "".
        goal: pose that it was to end in, None for one that has none; dock: pose of the dock that this is
            known by, or None.
    """

    kind: str
    place: int
    attempt: int
    begin: float
    end: float | None = None
    result: MissionResult = MissionResult.RUNNING
    reason: str = ""
    goal: Pose2 | None = None
    dock: Pose2 | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Berth:
    """The dock that the vehicle stands at, or makes for.

    Attributes:
        dock: the step that leads there; place: of that in the mission; pose: of the dock, as far as is known.
        body_at: where what is docked at was told to stand.
        reached: whether the vehicle has docked there.
        came: direction, +1 or -1, in which it came there; 0: not known.
        joined: it is in contact, or on its way to it: what is docked at is no obstacle any more.
    """

    dock: Dock
    place: int
    pose: Pose2
    body_at: Pose2 | None
    reached: bool = False
    came: int = 0
    joined: bool = False

    @property
    def body(self) -> Array | None:
        """Outline (k, 2) of what is to be kept clear of there [m], or None."""
        return None if self.joined or self.body_at is None else self.dock.body_at(self.body_at)


@dataclass(frozen=True, slots=True, kw_only=True)
class Agenda:
    """What is left of a mission, and how it goes.

    Attributes:
        due: the first one is under way once it has begun.
        begun: when that was [s]; None: not yet.
        stopping_since: since when one that has to begin at rest waits for that [s], or None.
        docked_since: since when the vehicle stands where it is to end [s], or None.
        trouble: what the step comes to if it goes on as it does, or None; trouble_since: since when [s].
        berth: see there; None: it is at no dock.
        bodies: outlines (k, 2) of what stands at other docks [m].
        ways_out: ends of an undocking that are still to be tried, the present one first.
        own_goal: that the controller had, or was given last; None: that of its path.
        told: goal that was told last while there was no use for it, or None.
        obstacles: that were given last besides those of the berth, or None.
        result: of the whole mission.
        reason: why the last step failed, or is tried once more.
        log: all steps that were begun.
    """

    due: tuple[Due, ...]
    begun: float | None = None
    stopping_since: float | None = None
    docked_since: float | None = None
    trouble: MissionResult | None = None
    trouble_since: float = 0.0
    berth: Berth | None = None
    bodies: tuple[Array, ...] = ()
    ways_out: tuple[Pose2, ...] = ()
    own_goal: Pose2 | None = None
    told: Pose2 | None = None
    obstacles: Sequence[ArrayLike] | None = None
    result: MissionResult = MissionResult.RUNNING
    reason: str = ""
    log: tuple[StepRecord, ...] = ()

    @property
    def step(self) -> AnyStep | None:
        """That is under way, or comes next; None: the mission is over."""
        return self.due[0].step if self.due else None

    @property
    def standing(self) -> tuple[Array, ...]:
        """Outlines (k, 2) of all that stands at docks and is to be kept clear of [m]."""
        body = None if self.berth is None else self.berth.body
        return self.bodies if body is None else (*self.bodies, body)

    def at(self, berth: Berth | None) -> Agenda:
        """At another berth, or at none. What stands at the last one goes on standing there, unless it is what
        is docked at now: two bodies do not overlap."""
        body = None if berth is None else berth.body
        last = self.berth
        left = None if last is None or last.joined else last.dock.body_at(last.body_at or last.pose)
        others = self.bodies if left is None else (*self.bodies, left)
        if body is not None:
            now = shapely.Polygon(body)
            others = tuple(each for each in others if not now.intersects(shapely.Polygon(each)))
        return replace(self, berth=berth, bodies=others)
