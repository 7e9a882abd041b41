"""The steps of a mission, as data: dock, wait, drive straight, undock, drive to a pose.

A mission is a list of them. How each is begun, and what it comes to, is in `rti_mpcc.mission`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from enum import Enum
from math import inf
from typing import ClassVar, Literal

import numpy as np
import shapely
from numpy.typing import ArrayLike

from estimation import CharucoBoard
from geometry import InputError, Pose2
from geometry.doors import Admitted, admit, door
from geometry.outline import checked_polygon, outline_at
from rti_mpcc.types import Array

Then = Literal["stop", "continue", "home"]
"""What comes after a step that failed for good: nothing, the next step, or the way home."""
Signal = Callable[[], bool]
"""Asked once a cycle."""


LONGEST = 100.0
"""Length of what is driven straight on or along a bend, at most [m]: one cycle looks at all of it."""

QUARTER = 4
"""So many corners has a quarter of a circle around where something may be."""


class DockKind(Enum):
    """How the pose of a dock is known."""

    KNOWN = "known"
    """It is where it is said to be."""
    DETECTED = "detected"
    """By detections: what is said is where it is expected."""
    CHARUCO = "charuco"
    """The same, by its ChArUco board in the pictures of a camera."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Step(Admitted):
    """What all steps have.

    Attributes:
        timeout: the step has failed after so long [s].
        patience: and where it does not get on for so long [s]: something is in the way, there is no plan or
            no way, or the goal is not seen.
        retries: so often it is tried again.
        retry_from: place in the mission of the step from which it is tried again, an earlier one or its own;
            None: its own.
        then: what comes after it has failed for good.

    Raises:
        InputError: a time that is not positive, or a negative count.
    """

    word: ClassVar[str] = ""
    timeout: float = inf
    patience: float = 15.0
    retries: int = 0
    retry_from: int | None = None
    then: Then = "stop"

    def __post_init__(self) -> None:
        admit(self)
        for name in ("timeout", "patience"):
            _refuse_unless(getattr(self, name) > 0.0, self, name, "must be > 0")
        for name in ("retries", "retry_from"):
            count = getattr(self, name)
            _refuse_unless(count is None or count >= 0, self, name, "must be a whole number >= 0")


COMMON = tuple(each.name for each in fields(Step))
"""What all steps have."""


@dataclass(frozen=True, slots=True)
class Approach(Admitted):
    """The straight last piece of the way into a dock.

    Attributes:
        length: at most LONGEST [m]; direction: +1 forward, -1 in reverse.

    Raises:
        InputError: a length that is not positive or more than LONGEST, or another direction.
    """

    length: float
    direction: int

    def __post_init__(self) -> None:
        admit(self)
        allowed = f"must be > 0 and at most {LONGEST:g} m"
        _refuse_unless(0.0 < self.length <= LONGEST, self, "length", allowed)
        _refuse_unless(self.direction in (1, -1), self, "direction", "must be 1 (forward) or -1 (in reverse)")


@dataclass(frozen=True, slots=True)
class Straight(Step):
    """Drive straight on: along the axis of the dock that the vehicle stands at, else along its heading.

    Attributes:
        distance: at most LONGEST [m], negative in reverse.
        speed: at most [m/s]; steering: angle of the wheels, at most [rad].
        tolerance: lateral [m] and heading [rad] error at its end, at most. It is not begun where the errors
            are so large that they cannot be mended on the way. None: as it comes.
        until: what tells that it is over before its distance, a contact say; None: nothing.

    Raises:
        InputError: a distance of 0 or more than LONGEST, or a limit or tolerance that is not positive.
    """

    word = "straight"
    distance: float
    speed: float = field(default=0.2, kw_only=True)
    steering: float = field(default=0.05, kw_only=True)
    tolerance: tuple[float, float] | None = field(default=None, kw_only=True)
    until: Signal | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        Step.__post_init__(self)
        _refuse_unless(_is_way(self.distance), self, "distance", _WAY)
        for name in ("speed", "steering"):
            _refuse_unless(_positive(getattr(self, name)), self, name, "must be > 0, and finite")
        allowed = "must be two numbers > 0: lateral [m], heading [rad]"
        _refuse_unless(_all_positive(self.tolerance), self, "tolerance", allowed)


@dataclass(frozen=True, slots=True, eq=False)
class Dock(Step):
    """Drive to a dock and stand there.

    Attributes:
        pose: of the rear axle of the docked vehicle, world frame; None: the controller's own goal.
        name: of the dock, for who reads of it.
        kind: see `DockKind`; None: as the controller's settings say.
        board: that stands at it, of a `CHARUCO` dock.
        approach: see there; None: any way into it.
        tolerance: longitudinal [m], lateral [m], heading [rad]; None: that of the settings.
        body: outline (k, 2) [m] of what is docked at, in the frame of `pose`: it is kept clear of in every
            step but `Straight`, where the dock is seen to be. None: nothing.
        contact: the move that ends in contact, to be put into a mission behind it; None: there is none.
        uncertainty: how wrong `pose` may be, at most, in its position [m] and heading [rad]: the way there
            keeps clear of wherever `body` may be, but on the straight approach, on which the dock has to be
            seen.

    Raises:
        InputError: a tolerance that is not positive, a body that is no polygon, a charuco dock without a
            board, or a board of another dock.
    """

    word = "dock"
    pose: Pose2 | None = None
    name: str = field(default="", kw_only=True)
    kind: DockKind | None = field(default=None, kw_only=True)
    board: CharucoBoard | None = field(default=None, kw_only=True)
    approach: Approach | None = field(default=None, kw_only=True)
    tolerance: tuple[float, float, float] | None = field(default=None, kw_only=True)
    body: ArrayLike | None = field(default=None, kw_only=True)
    contact: Straight | None = field(default=None, kw_only=True)
    uncertainty: tuple[float, float] | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        Step.__post_init__(self)
        _refuse_unless(_all_positive(self.tolerance), self, "tolerance", _THREE)
        allowed = "must be two numbers > 0, [m] and [rad], of a dock with a body and an approach"
        certain = self.uncertainty is None or (self.body is not None and self.approach is not None)
        _refuse_unless(certain and _all_positive(self.uncertainty), self, "uncertainty", allowed)
        by_board = self.kind is DockKind.CHARUCO
        _refuse_unless(
            by_board == (self.board is not None), self, "board", "a charuco dock has one, and no other"
        )
        for name in ("tolerance", "approach", "kind"):
            alone = self.pose is None and getattr(self, name) is not None
            _refuse_unless(not alone, self, name, "only of a dock with a pose, to which a way is planned")
        if self.body is not None:
            checked_polygon(self.body, "Dock.body")

    def keep_out(self) -> tuple[tuple[tuple[float, float], ...], ...]:
        """Outlines of where the body may be, corners x, y [m]; none where its place is certain."""
        if self.uncertainty is None or self.pose is None or self.body is None:
            return ()
        far, turn = self.uncertainty
        poses = [replace(self.pose, phi=self.pose.phi + angle) for angle in (-turn, 0.0, turn)]
        bodies = shapely.MultiPoint(np.concatenate([outline_at(self.body, pose) for pose in poses]))
        around = bodies.convex_hull.buffer(far, quad_segs=QUARTER)
        return (tuple((x, y) for x, y in shapely.get_coordinates(around)[:-1].tolist()),)

    @door(late=True)
    def body_at(self, pose: Pose2) -> Array | None:
        """The outline (k, 2) of what is docked at, where the dock is at this pose; None: there is none."""
        return None if self.body is None else outline_at(self.body, pose)


@dataclass(frozen=True, slots=True)
class Wait(Step):
    """Stand for some seconds, or until something tells that it is over; with both until the first of them.

    Raises:
        InputError: negative seconds, or neither seconds nor `until`.
    """

    word = "wait"
    seconds: float | None = None
    until: Signal | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        Step.__post_init__(self)
        good = self.seconds is None or 0.0 <= self.seconds < inf
        _refuse_unless(good, self, "seconds", "must be >= 0, and finite")
        some = self.seconds is not None or self.until is not None
        _refuse_unless(some, self, "seconds", "needs seconds, or until")


@dataclass(frozen=True, slots=True)
class Undock(Step):
    """Drive out of where the vehicle stands, straight on or along the best bend that is clear.

    Attributes:
        distance: along the way out, at most LONGEST [m], negative in reverse.

    Raises:
        InputError: a distance of 0, or of more than LONGEST.
    """

    word = "undock"
    distance: float

    def __post_init__(self) -> None:
        Step.__post_init__(self)
        _refuse_unless(_is_way(self.distance), self, "distance", _WAY)


@dataclass(frozen=True, slots=True)
class DriveTo(Step):
    """Drive to a pose and stand there.

    Attributes:
        pose: of the rear axle, world frame.
        tolerance: longitudinal [m], lateral [m], heading [rad]; None: that of the settings.

    Raises:
        InputError: a tolerance that is not positive.
    """

    word = "drive_to"
    pose: Pose2
    tolerance: tuple[float, float, float] | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        Step.__post_init__(self)
        _refuse_unless(_all_positive(self.tolerance), self, "tolerance", _THREE)


AnyStep = Dock | Wait | Straight | Undock | DriveTo


_WAY = f"must not be 0, and at most {LONGEST:g} m either way"
_THREE = "must be three numbers > 0: [m], [m], [rad]"


def _positive(value: float) -> bool:
    return 0.0 < value < inf


def _is_way(value: float) -> bool:
    return 0.0 < abs(value) <= LONGEST


def _all_positive(values: tuple[float, ...] | None) -> bool:
    return values is None or all(map(_positive, values))


def _refuse_unless(good: bool, where: object, name: str, allowed: str) -> None:
    if not good:
        raise InputError(f"{type(where).__name__}.{name} = {getattr(where, name)!r}: {allowed}")
