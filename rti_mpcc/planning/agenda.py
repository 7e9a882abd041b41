"""What is left of a mission, and how it goes: the part of the state that `rti_mpcc.mission` writes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from numpy.typing import ArrayLike

from geometry import Pose2
from rti_mpcc.steps import AnyStep, Dock
from rti_mpcc.types import Array, MissionResult


@dataclass(frozen=True, slots=True, kw_only=True)
class Due:
    """A step that is to be done.

    Attributes:
        step: see there; place: of it in the mission; attempt: so often it was tried before.
    """

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
        dock: the step that leads there; pose: of it, as far as is known.
        reached: whether the vehicle has docked there.
        came: direction, +1 or -1, in which it came there; 0: not known.
        joined: it is in contact, or on its way to it: what is docked at is no obstacle any more.
    """

    dock: Dock
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
        docked_since: since when the vehicle stands where it is to end [s], or None.
        trouble: what the step comes to if it goes on as it does, or None; trouble_since: since when [s].
        berth: see there; None: it is at no dock.
        ways_out: ends of an undocking that are still to be tried, the present one first.
        own_goal: that the controller had, or was given last; None: that of its path.
        obstacles: that were given last besides those of the berth, or None.
        result: of the whole mission.
        reason: why the last step failed, or is tried once more.
        log: all steps that were begun.
    """

    due: tuple[Due, ...]
    begun: float | None = None
    docked_since: float | None = None
    trouble: MissionResult | None = None
    trouble_since: float = 0.0
    berth: Berth | None = None
    ways_out: tuple[Pose2, ...] = ()
    own_goal: Pose2 | None = None
    obstacles: Sequence[ArrayLike] | None = None
    result: MissionResult = MissionResult.RUNNING
    reason: str = ""
    log: tuple[StepRecord, ...] = ()

    @property
    def step(self) -> AnyStep | None:
        """That is under way, or comes next; None: the mission is over."""
        return self.due[0].step if self.due else None
