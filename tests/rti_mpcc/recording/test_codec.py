"""Values to JSON and back: the same bits, and errors that say where."""

from __future__ import annotations

import json
from dataclasses import dataclass
from enum import Enum
from math import inf, nan
from struct import pack
from typing import Any, NamedTuple

import numpy as np
import pytest

from estimation import GoalMeasurement
from geometry import Pose2
from rti_mpcc.errors import InputError
from rti_mpcc.recording.codec import SMALL, decoder, to_data
from rti_mpcc.types import Array, VehicleState


class Colour(Enum):
    RED = "red"


class Pair(NamedTuple):
    word: str
    number: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Everything:
    number: float
    maybe: float | None
    flag: bool
    words: tuple[str, ...]
    two: tuple[float, int]
    colour: Colour
    pair: Pair | None
    names: dict[str, int]
    array: Array
    pose: Pose2


THING = Everything(
    number=0.1 + 0.2,
    maybe=None,
    flag=True,
    words=("a", "é"),
    two=(-0.0, 3),
    colour=Colour.RED,
    pair=Pair("b", 1),
    names={"c": 2},
    array=np.arange(3.0),
    pose=Pose2(1.0, 2.0, 3.0),
)


def back(kind: Any, value: object) -> Any:
    return decoder(kind)(json.loads(json.dumps(to_data(value))))


def test_everything_comes_back() -> None:
    again = back(Everything, THING)
    assert isinstance(again, Everything)
    assert to_data(again) == to_data(THING)
    assert again.colour is Colour.RED
    assert isinstance(again.pair, Pair)
    assert isinstance(again.words, tuple)


@pytest.mark.parametrize(
    "value", [0.0, -0.0, 1 / 3, 5e-324, 1.7976931348623157e308, 1e-7, inf, -inf, np.nextafter(1.0, 2.0)]
)
def test_numbers_keep_their_bits(value: float) -> None:
    assert pack("<d", back(float, value)) == pack("<d", value)
    small, large = np.array([value, 1.0]), np.full((SMALL, 2), value)
    assert back(Array, small).tobytes() == small.tobytes()
    assert back(Array, large).tobytes() == large.tobytes()


def test_nan_is_always_the_same_object() -> None:
    """Equality of tuples, and so of dataclasses, goes by identity first."""
    one, other = (back(VehicleState, VehicleState(nan, float("nan"), 0.0, 0.0, 0.0)) for _ in range(2))
    assert one == other


@pytest.mark.parametrize("shape", [(), (0, 2), (3,), (2, 3), (SMALL,), (SMALL + 1,), (5, 4, 3)])
def test_arrays_keep_their_shape_and_cannot_be_written(shape: tuple[int, ...]) -> None:
    values = np.random.default_rng(0).standard_normal(shape)
    again = back(Array, values)
    np.testing.assert_array_equal(again, values, strict=True)
    assert not again.flags.writeable


def test_scalars_of_numpy_are_numbers() -> None:
    assert to_data([np.float64(1.5), np.float32(0.5), np.int64(2), np.bool_(True)]) == [1.5, 0.5, 2, True]


def test_a_pose_that_no_constructor_makes_comes_back() -> None:
    pose = object.__new__(Pose2)
    for name in ("x", "y", "phi"):
        object.__setattr__(pose, name, nan)
    assert back(Pose2, pose).x != 0.0


def test_a_covariance_comes_back() -> None:
    told = GoalMeasurement(stamp=1.0, x=2.0, y=3.0, phi=4.0, covariance=np.diag([1.0, nan, 1e-9]))
    again = back(GoalMeasurement, told)
    np.testing.assert_array_equal(again.covariance, told.covariance)
    assert (again.frame, again.vehicle) == (told.frame, None)


def test_what_recordings_do_not_know_is_refused() -> None:
    with pytest.raises(InputError, match="a set cannot be recorded"):
        to_data({1, 2})
    with pytest.raises(TypeError, match="no decoder"):
        decoder(float | str)
    with pytest.raises(TypeError, match="no decoder"):
        decoder(set)


@pytest.mark.parametrize(
    ("field", "data", "message"),
    [
        ("number", "a", ".number = 'a': must be a number"),
        ("number", True, ".number = True: must be a number"),
        ("flag", 1, ".flag = 1: must be a bool"),
        ("words", ["a", 2], ".words[1] = 2: must be a str"),
        ("words", "ab", ".words = 'ab': must be a list"),
        ("two", [1.0], ".two has 1 items: must have 2"),
        ("two", [1.0, 2.0], ".two[1] = 2.0: must be a int"),
        ("colour", "green", ".colour = 'green': is no Colour"),
        ("names", {"c": None}, ".names.c = None: must be a int"),
        ("array", [1.0], ".array = [1.0]: must be an array"),
        ("array", {"array": [[1.0], [2.0, 3.0]]}, ".array: not an array of numbers"),
        ("array", {"base64": "AAAA", "shape": [1]}, ".array: not an array of numbers"),
        ("array", {"base64": "*", "shape": [1]}, ".array: not an array of numbers"),
        ("pose", {"x": 1.0, "y": 2.0}, ".pose: missing or unknown in a Pose2: phi"),
        ("pose", {"x": 1.0, "y": 2.0, "phi": 0.0, "z": 0.0}, ".pose: missing or unknown in a Pose2: z"),
        ("pose", 3, ".pose = 3: must be an object with named fields"),
    ],
)
def test_errors_say_where(field: str, data: object, message: str) -> None:
    changed = to_data(THING) | {field: data}
    with pytest.raises(InputError) as refused:
        decoder(Everything)(changed)
    assert str(refused.value).startswith(message)
