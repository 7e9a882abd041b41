"""The steps of a mission, as data: dock, wait, drive straight, undock, drive to a pose.

A mission is a list of them; `rti_mpcc.mission` drives it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, fields, replace
from enum import Enum
from math import inf
from typing import ClassVar, Literal

import numpy as np
import shapely
from numpy.typing import ArrayLike

from estimation import CharucoBoard
from geometry import InputError, Pose2
from geometry.outline import checked_polygon, outline_at
from geometry.validation import Validated, validate, validated
from rti_mpcc.types import Array

Then = Literal["stop", "continue", "home"]
"""Continuation after a step that failed for good: none, the next step, or the route home."""
Signal = Callable[[], bool]
"""Asked once a cycle."""


LONGEST = 100.0
"""Largest distance of a straight move or an undocking [m]: one cycle checks all of it."""

QUARTER = 4
"""Corners of a quarter of a circle around where something may be."""


class DockKind(Enum):
    """How the pose of a dock is known."""

    KNOWN = "known"
    """It is at the given pose."""
    DETECTED = "detected"
    """By detections: the given pose is where it is expected."""
    CHARUCO = "charuco"
    """By detections of its ChArUco board in the pictures of a camera."""


Rule = tuple[str, bool, str]
"""A field, whether its value is allowed, and what is allowed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Step(Validated):
    """Fields of all steps. A value out of its range is refused with an `InputError`.

    Attributes:
        timeout: time after which the step has failed [s].
        patience: and the time without progress [s]: it is blocked, there is no plan or no route, or the goal
            is not seen.
        retries: number of times that it is tried again.
        retry_from: place in the mission of the step from which it is tried again, an earlier one or its own;
            None: its own.
        then: continuation after it has failed for good.
    """

    word: ClassVar[str] = ""
    timeout: float = inf
    patience: float = 15.0
    retries: int = 0
    retry_from: int | None = None
    then: Then = "stop"

    def __post_init__(self) -> None:
        validate(self)
        times = [(name, getattr(self, name) > 0.0, "must be > 0") for name in ("timeout", "patience")]
        counts = [
            (name, (getattr(self, name) or 0) >= 0, "must be a whole number >= 0")
            for name in ("retries", "retry_from")
        ]
        _refuse_unless(self, [*times, *counts])
        _refuse_unless(self, self._rules())

    def _rules(self) -> Iterable[Rule]:
        return ()


COMMON = tuple(each.name for each in fields(Step))
"""Names of the fields of all steps."""


@dataclass(frozen=True, slots=True)
class Approach(Validated):
    """The straight last piece of the route into a dock.

    Attributes:
        length: at most LONGEST [m]; direction: +1 forward, -1 in reverse.
    """

    length: float
    direction: int

    def __post_init__(self) -> None:
        validate(self)
        far = f"must be > 0 and at most {LONGEST:g} m"
        either = "must be 1 (forward) or -1 (in reverse)"
        good = 0.0 < self.length <= LONGEST
        _refuse_unless(self, (("length", good, far), ("direction", self.direction in (1, -1), either)))


@dataclass(frozen=True, slots=True)
class Straight(Step):
    """Drive straight on: along the axis of the dock that the vehicle stands at, else along its heading.

    Attributes:
        distance: at most LONGEST [m], negative in reverse.
        speed: at most [m/s]; steering: angle of the wheels, at most [rad].
        tolerance: lateral [m] and heading [rad] error at its end, at most. It is not started where the errors
            are too large to be corrected on it. None: any errors.
        until: signal that it is over before its distance, a contact say; None: there is none.
    """

    word = "straight"
    distance: float
    speed: float = field(default=0.2, kw_only=True)
    steering: float = field(default=0.05, kw_only=True)
    tolerance: tuple[float, float] | None = field(default=None, kw_only=True)
    until: Signal | None = field(default=None, kw_only=True)

    def _rules(self) -> Iterable[Rule]:
        two = "must be two numbers > 0: lateral [m], heading [rad]"
        yield _distance_rule(self.distance)
        for name in ("speed", "steering"):
            yield name, 0.0 < getattr(self, name) < inf, "must be > 0, and finite"
        yield "tolerance", _all_positive(self.tolerance), two


@dataclass(frozen=True, slots=True, eq=False)
class Dock(Step):
    """Drive to a dock and stand there.

    Attributes:
        pose: of the rear axle of the docked vehicle, world frame; None: the controller's own goal.
        name: of the dock, for readers.
        kind: see `DockKind`; None: as the controller's settings say.
        board: at the dock, of a `CHARUCO` dock.
        approach: see there; None: any route into it.
        tolerance: longitudinal [m], lateral [m], heading [rad]; None: that of the settings.
        body: outline (k, 2) [m] of the docked object, in the frame of `pose`: an obstacle in every step but
            `Straight`, where the dock is detected. None: there is none.
        contact: the move that ends in contact, to be put into a mission behind it; None: there is none.
        uncertainty: largest error of `pose` in its position [m] and heading [rad]: detections beyond it are
            rejected, and the route keeps clear of wherever `body` may be, but on the straight approach, on
            which the dock has to be detected.
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

    def _rules(self) -> Iterable[Rule]:
        yield "tolerance", _all_positive(self.tolerance), _THREE
        certain = self.uncertainty is None or (self.body is not None and self.approach is not None)
        pair = "must be two numbers > 0, [m] and [rad], of a dock with a body and an approach"
        yield "uncertainty", certain and _all_positive(self.uncertainty), pair
        by_board = self.kind is DockKind.CHARUCO
        yield "board", by_board == (self.board is not None), "a charuco dock has one, and no other"
        for name in ("tolerance", "approach", "kind"):
            alone = self.pose is None and getattr(self, name) is not None
            yield name, not alone, "only of a dock with a pose, to which a route is planned"
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

    @validated(late=True)
    def body_at(self, pose: Pose2) -> Array | None:
        """The outline (k, 2) of the body, where the dock is at this pose; None: there is none."""
        return None if self.body is None else outline_at(self.body, pose)


@dataclass(frozen=True, slots=True)
class Wait(Step):
    """Stand for some seconds, or until a signal; with both until the first of them."""

    word = "wait"
    seconds: float | None = None
    until: Signal | None = field(default=None, kw_only=True)

    def _rules(self) -> Iterable[Rule]:
        yield "seconds", self.seconds is None or 0.0 <= self.seconds < inf, "must be >= 0, and finite"
        yield "seconds", self.seconds is not None or self.until is not None, "needs seconds, or until"


@dataclass(frozen=True, slots=True)
class Undock(Step):
    """Drive out of where the vehicle stands, straight on or along the best bend that is clear.

    Attributes:
        distance: along the route, at most LONGEST [m], negative in reverse.
    """

    word = "undock"
    distance: float

    def _rules(self) -> Iterable[Rule]:
        yield _distance_rule(self.distance)


@dataclass(frozen=True, slots=True)
class DriveTo(Step):
    """Drive to a pose and stand there.

    Attributes:
        pose: of the rear axle, world frame.
        tolerance: longitudinal [m], lateral [m], heading [rad]; None: that of the settings.
    """

    word = "drive_to"
    pose: Pose2
    tolerance: tuple[float, float, float] | None = field(default=None, kw_only=True)

    def _rules(self) -> Iterable[Rule]:
        yield "tolerance", _all_positive(self.tolerance), _THREE


AnyStep = Dock | Wait | Straight | Undock | DriveTo
_THREE = "must be three numbers > 0: [m], [m], [rad]"


def _distance_rule(value: float) -> Rule:
    return "distance", 0.0 < abs(value) <= LONGEST, f"must not be 0, and at most {LONGEST:g} m either way"


def _all_positive(values: tuple[float, ...] | None) -> bool:
    return values is None or all(0.0 < value < inf for value in values)


def _refuse_unless(where: object, rules: Iterable[Rule]) -> None:
    for name, good, allowed in rules:
        if not good:
            raise InputError(f"{type(where).__name__}.{name} = {getattr(where, name)!r}: {allowed}")
