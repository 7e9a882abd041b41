"""The state of a mission, which the controller keeps, and the record of each step."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import shapely
from numpy.typing import ArrayLike

from geometry import Pose2
from rti_mpcc.types import Array, MissionResult

if TYPE_CHECKING:
    from rti_mpcc.mission.dock import Dock
    from rti_mpcc.mission.step import Step


@dataclass(frozen=True, slots=True, kw_only=True)
class PendingStep:
    """A step to be done, its place in the mission, and the number of earlier attempts."""

    step: Step
    place: int
    attempt: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class StepRecord:
    """A step that was started.

    Attributes:
        kind: as in scenario files; place, attempt: as in `PendingStep`.
        begin, end: on the controller's own clock [s]; None: it is not over.
        result, reason: of the step; goal: its pose, or None; dock: pose of the dock of that goal, or None.
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
class DockState:
    """The dock that the vehicle stands at, or drives to.

    Attributes:
        dock: the step that leads there; place: of that in the mission; pose: of the dock, as known.
        body_at: given pose of the docked object.
        reached: whether the vehicle has docked there.
        incoming_direction: direction, +1 or -1, in which it arrived; 0: not known.
        joined: it is in contact, or drives into contact: the docked object is no obstacle any more.
    """

    dock: Dock
    place: int
    pose: Pose2
    body_at: Pose2 | None
    reached: bool = False
    incoming_direction: int = 0
    joined: bool = False

    @property
    def body(self) -> Array | None:
        """Outline (k, 2) of the docked object to keep clear of [m], or None."""
        return None if self.joined or self.body_at is None else self.dock.body_at(self.body_at)


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionState:
    """What is left of a mission, and its state.

    Attributes:
        pending: steps left, the current one first; started: when that was started [s]; None: not yet.
        stopping_since: since when a step that starts at rest waits for that [s], or None.
        docked_since: since when the vehicle stands at the end of the step [s], or None.
        trouble: the result if nothing changes, or None; trouble_since: since when [s].
        dock_state: the dock, or None; bodies: outlines (k, 2) of the objects at other docks [m].
        data: what the current step has to remember, or None.
        own_goal: that the controller had, or was given last; None: that of its path.
        unused_goal: goal that was given last without any use for it, or None.
        obstacles: that were given last besides that of the dock, or None.
        result: of the whole mission; reason: why the last step failed, or is tried again.
        log: all steps that were started.
    """

    pending: tuple[PendingStep, ...]
    started: float | None = None
    stopping_since: float | None = None
    docked_since: float | None = None
    trouble: MissionResult | None = None
    trouble_since: float = 0.0
    dock_state: DockState | None = None
    bodies: tuple[Array, ...] = ()
    data: Any = None
    own_goal: Pose2 | None = None
    unused_goal: Pose2 | None = None
    obstacles: Sequence[ArrayLike] | None = None
    result: MissionResult = MissionResult.RUNNING
    reason: str = ""
    log: tuple[StepRecord, ...] = ()

    @property
    def step(self) -> Step | None:
        """The current one, or the next; None: the mission is over."""
        return self.pending[0].step if self.pending else None

    @property
    def standing(self) -> tuple[Array, ...]:
        """Outlines (k, 2) of all objects at docks to keep clear of [m]."""
        body = None if self.dock_state is None else self.dock_state.body
        return self.bodies if body is None else (*self.bodies, body)

    def at(self, dock_state: DockState | None) -> MissionState:
        """At another dock, or at none. The object at the last one stays there, unless it overlaps the one at
        this one: then it is the same."""
        body = None if dock_state is None else dock_state.body
        last = self.dock_state
        left = None if last is None or last.joined else last.dock.body_at(last.body_at or last.pose)
        others = self.bodies if left is None else (*self.bodies, left)
        if body is not None:
            now = shapely.Polygon(body)
            others = tuple(each for each in others if not now.intersects(shapely.Polygon(each)))
        return replace(self, dock_state=dock_state, bodies=others)
