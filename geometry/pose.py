"""Poses in the plane, and angles: on the circle, and their branches on the real line [rad]."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, cos, isfinite, pi, sin
from typing import overload

import numpy as np

from geometry.arrays import Array
from geometry.errors import BAD_INPUT, InputError, shown
from geometry.validation import Validated, validate, validated


@overload
def wrap(angle: float) -> float: ...
@overload
def wrap(angle: Array) -> Array: ...
def wrap(angle: float | Array) -> float | Array:
    """Return the same angle in (-pi, pi] [rad]; scalars give a float, arrays keep their shape.

    In an array what is not finite becomes NaN.

    Raises:
        InputError: no number, or a scalar that is not finite.
    """
    try:
        if isinstance(angle, np.ndarray):
            with np.errstate(invalid="ignore"):
                return np.asarray(angle - 2.0 * pi * np.ceil((angle - pi) / (2.0 * pi)), dtype=np.float64)
        return float(angle - 2.0 * pi * ceil((angle - pi) / (2.0 * pi)))
    except BAD_INPUT:
        raise InputError(f"angle = {shown(angle)}: must be a finite number, or an array of numbers") from None


def degrees_hint(what: str, heading: float) -> str:
    """What to say of a heading of more than a full turn [rad], which may be meant in degrees, or ""."""
    if abs(heading) <= 2.0 * pi:
        return ""
    return f"{what} {heading:.6g}: in degrees? radians are expected"


@overload
def lift(angle: float, near: float) -> float: ...
@overload
def lift(angle: Array, near: float | Array) -> Array: ...
@overload
def lift(angle: float, near: Array) -> Array: ...
def lift(angle: float | Array, near: float | Array) -> float | Array:
    """Return the same angle on the branch nearest to `near`, i.e. within pi of it [rad].

    Raises:
        InputError: no numbers, arrays whose shapes do not go together, or scalars that are not finite.
    """
    if isinstance(angle, float) and isinstance(near, float):
        return near + wrap(angle - near)
    try:
        with np.errstate(invalid="ignore"):
            return near + wrap(np.subtract(angle, near, dtype=np.float64))
    except BAD_INPUT:
        given = f"angle, near = {shown(angle)}, {shown(near)}"
        raise InputError(f"{given}: must be finite numbers, or arrays of them that go together") from None


@dataclass(frozen=True, slots=True)
class Pose2(Validated):
    """Position and heading in the world frame (or in the frame of another pose).

    Attributes:
        x: position [m].
        y: position [m].
        phi: heading, counter-clockwise from the x axis [rad]; not wrapped.

    Raises:
        InputError: a field is not a finite number.
    """

    x: float
    y: float
    phi: float

    def __post_init__(self) -> None:
        # As nearly all are: they need no second look.
        if type(self.x) is type(self.y) is type(self.phi) is float and isfinite(self.x + self.y + self.phi):
            return
        validate(self)
        for name in ("x", "y", "phi"):
            if not isfinite(value := getattr(self, name)):
                raise InputError(f"Pose2: {name} = {value} must be finite.")

    def compose(self, offset: Pose2) -> Pose2:
        """Return the world pose of `offset`, which is given in the frame of this pose.

        Args:
            offset: x longitudinal along the heading, y lateral to the left [m]; its phi is added [rad].
        """
        if not isinstance(offset, Pose2):
            raise InputError(f"offset = {shown(offset)}: must be a Pose2")
        c, s = cos(self.phi), sin(self.phi)
        return Pose2(
            self.x + c * offset.x - s * offset.y, self.y + s * offset.x + c * offset.y, self.phi + offset.phi
        )

    def relative_to(self, frame: Pose2) -> Pose2:
        """Return this pose in the frame of another: inverse of `compose`, heading in (-pi, pi]."""
        if not isinstance(frame, Pose2):
            raise InputError(f"frame = {shown(frame)}: must be a Pose2")
        ahead, aside = offset(self.x - frame.x, self.y - frame.y, frame.phi)
        return Pose2(ahead, aside, wrap(self.phi - frame.phi))

    @validated(late=True)
    def within(self, tolerance: tuple[float, float, float], share: float = 1.0) -> bool:
        """Whether this pose, an error, is within a share of a tolerance: x, y [m], phi [rad]."""
        x, y, phi = tolerance
        return abs(self.x) <= share * x and abs(self.y) <= share * y and abs(self.phi) <= share * phi


def offset(dx: float, dy: float, phi: float) -> tuple[float, float]:
    """Return an offset in x and y [m] in a frame with the heading `phi` [rad]: ahead, and to the left [m]."""
    c, s = cos(phi), sin(phi)
    return c * dx + s * dy, -s * dx + c * dy


def unchecked_pose(x: float, y: float, phi: float) -> Pose2:
    """Return a pose of any numbers, also those that `Pose2` refuses: as from a broken message."""
    pose = object.__new__(Pose2)
    for name, value in (("x", x), ("y", y), ("phi", phi)):
        object.__setattr__(pose, name, float(value))
    return pose
