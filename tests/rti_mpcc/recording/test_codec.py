"""Values from a line, the same bits, and errors that say where."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from math import inf, nan
from typing import Any

import numpy as np
import pytest

from estimation import GoalMeasurement
from geometry import Pose2
from rti_mpcc.config import SolverSettings
from rti_mpcc.errors import InputError
from rti_mpcc.qp.solver import Stop
from rti_mpcc.recording.codec import structured
from rti_mpcc.recording.lines import from_line, to_data, to_line
from rti_mpcc.types import Array


class Colour(Enum):
    RED = "red"


@dataclass(frozen=True, slots=True, kw_only=True)
class Everything:
    number: float
    maybe: float | None
    flag: bool
    words: tuple[str, ...]
    two: tuple[float, int]
    colour: Colour
    stop: Stop | None
    names: dict[str, int]
    array: Array
    pose: Pose2
    settings: SolverSettings


THING = Everything(
    number=0.1 + 0.2,
    maybe=None,
    flag=True,
    words=("a", "é"),
    two=(-0.0, 3),
    colour=Colour.RED,
    stop=Stop("b", 1),
    names={"c": 2},
    array=np.arange(3.0),
    pose=Pose2(1.0, 2.0, 3.0),
    settings=SolverSettings(tolerance=1 / 3e5),
)


def back(value: Any) -> Any:
    return structured(from_line(to_line(value).rstrip())[0], type(value))


def test_everything_comes_back() -> None:
    again = back(THING)
    assert isinstance(again, Everything)
    assert to_data(again) == to_data(THING)
    assert again.colour is Colour.RED
    assert isinstance(again.stop, Stop)
    assert isinstance(again.words, tuple)
    assert again.settings == THING.settings


@pytest.mark.parametrize("value", [nan, inf, -inf, 5e-324, -0.0])
def test_numbers_need_not_be_finite(value: float) -> None:
    again = back(replace(THING, number=value, array=np.full((2, 3), value)))
    assert repr(again.number) == repr(value)
    np.testing.assert_array_equal(again.array, np.full((2, 3), value), strict=True)
    np.testing.assert_array_equal(np.signbit(again.array), np.signbit(np.full((2, 3), value)))


@pytest.mark.parametrize("shape", [(), (0,), (0, 2), (3,), (2, 3), (33,), (5, 4, 3), (2, 0)])
def test_arrays_keep_their_shape_and_cannot_be_written(shape: tuple[int, ...]) -> None:
    values = np.random.default_rng(0).standard_normal(shape)
    again = back(replace(THING, array=values)).array
    np.testing.assert_array_equal(again, values, strict=True)
    assert not again.flags.writeable


def test_a_pose_that_no_constructor_makes_comes_back() -> None:
    pose = object.__new__(Pose2)
    for name in ("x", "y", "phi"):
        object.__setattr__(pose, name, nan)
    assert repr(back(replace(THING, pose=pose)).pose) == repr(pose)


def test_a_covariance_comes_back() -> None:
    given = GoalMeasurement(stamp=1.0, x=2.0, y=3.0, phi=4.0, covariance=np.diag([1.0, nan, 1e-9]))
    again = back(given)
    np.testing.assert_array_equal(again.covariance, given.covariance)
    assert (again.frame, again.vehicle) == (given.frame, None)
    assert back(replace(given, covariance=None)).covariance is None


@pytest.mark.parametrize(
    ("field", "data", "message"),
    [
        ("number", "a", "number: must be a float, is 'a'"),
        ("number", True, "number: must be a float, is True"),
        ("flag", 1, "flag: must be a bool, is 1"),
        ("words", ["a", 2], "words[1]: must be a str, is 2"),
        ("words", 5, "words: invalid value for type, expected tuple"),
        ("two", [1.0], "two: invalid value"),
        ("two", [1.0, 2.0], "two[1]: must be a int, is 2.0"),
        ("colour", "green", "colour: invalid value for type, expected Colour"),
        ("names", {"c": None}, "names['c']: must be a int, is None"),
        ("array", [[1.0], [2.0, 3.0]], "array: invalid value for type, expected ndarray"),
        ("array", "a", "array: invalid value for type, expected ndarray"),
        ("array", {"shape": "a"}, "array: invalid value for type, expected ndarray"),
        ("pose", {"x": 1.0, "y": 2.0}, "pose.phi: required field missing"),
        ("pose", {"x": 1.0, "y": 2.0, "phi": 0.0, "z": 0.0}, "pose: extra fields found (z)"),
        ("pose", 3, "pose: unknown error ('int' object has no attribute 'keys')"),
        (
            "settings",
            {"tolerance": -1.0},
            "settings: SolverSettings.tolerance = -1.0: Input should be greater than 0",
        ),
    ],
)
def test_errors_say_where(field: str, data: object, message: str) -> None:
    changed = to_data(THING) | {field: data}
    with pytest.raises(InputError) as refused:
        structured(changed, Everything)
    assert str(refused.value) == message


def test_all_that_is_wrong_is_said() -> None:
    with pytest.raises(InputError) as refused:
        structured({"x": 1.0, "y": "a"}, Pose2)
    assert str(refused.value) == "y: must be a float, is 'a'; phi: required field missing"
