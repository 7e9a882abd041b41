"""What a user told, whatever it is, as the numbers that a recording holds and a controller is given.

Nothing here raises: what is no number where one must be is NaN, and so is all of what is no state, pose,
measurement or outline at all. The controller refuses those as well.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from math import nan
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike

from estimation import Frame, GoalMeasurement
from geometry import Pose2
from rti_mpcc.types import Array

T = TypeVar("T")

# The cycle has to go on, so these catch whatever looking at an odd value raises.


def number(given: object, field: str = "") -> float:
    """What was told, or what it has in a field, as a float."""
    try:
        return float(getattr(given, field) if field else given)  # type: ignore[arg-type]
    except Exception:
        return nan


def numbers(given: object, kind: type[T]) -> T:
    """A dataclass of numbers with those in the fields of what was told, without the checks of its own."""
    made = object.__new__(kind)
    for field in fields(kind):  # type: ignore[arg-type]
        object.__setattr__(made, field.name, number(given, field.name))
    return made


def measurements(given: Sequence[GoalMeasurement] | None) -> tuple[GoalMeasurement, ...]:
    """The detections; none for None."""
    try:
        return () if given is None else tuple(map(_measurement, given))
    except Exception:
        return (_measurement(None),)


def outlines(given: Sequence[ArrayLike] | None) -> tuple[Array, ...] | None:
    """Those of obstacles, read-only, or None."""
    try:
        return None if given is None else tuple(map(read_only, given))
    except Exception:
        return (read_only([nan]),)


def read_only(values: ArrayLike) -> Array:
    """A copy as float64. Raises what NumPy does where these are no numbers."""
    array = np.array(values, dtype=np.float64)
    array.setflags(write=False)
    return array


def _measurement(given: GoalMeasurement | None) -> GoalMeasurement:
    try:
        assert given is not None
        return GoalMeasurement(
            stamp=number(given, "stamp"),
            x=number(given, "x"),
            y=number(given, "y"),
            phi=number(given, "phi"),
            covariance=given.covariance,
            frame=Frame(given.frame),
            vehicle=None if given.vehicle is None else numbers(given.vehicle, Pose2),
        )
    except Exception:
        return GoalMeasurement(stamp=nan, x=nan, y=nan, phi=nan)
