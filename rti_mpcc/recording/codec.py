"""From the JSON data of a line back to values, by the type hints of their dataclasses."""

from __future__ import annotations

from dataclasses import make_dataclass
from textwrap import shorten
from typing import Any, TypeVar, get_origin

import numpy as np
from cattrs import BaseValidationError, Converter, transform_error
from cattrs.v import format_exception
from numpy.typing import ArrayLike

from geometry import Pose2
from geometry.settings import Settings
from rti_mpcc.errors import InputError
from rti_mpcc.qp.solver import Stop
from rti_mpcc.recording.given import numbers, read_only
from rti_mpcc.recording.lines import Data
from rti_mpcc.types import Array

T = TypeVar("T")


def structured(data: Data, kind: type[T]) -> T:
    """The value of a kind that JSON data describe. Raises InputError, which says where they do not."""
    try:
        return _converter.structure(data, kind)
    except BaseValidationError as error:
        parts = (said.rpartition(" @ ") for said in transform_error(error, "", _said))
        raise InputError("; ".join(f"{at.lstrip('.')}: {what}" for what, _, at in parts)) from None


def _said(error: BaseException, kind: type | None) -> str:
    return str(error) if isinstance(error, InputError) else format_exception(error, kind)


def _plain(data: Data, kind: Any) -> Any:
    if type(data) is not kind and (type(data), kind) != (int, float):
        raise InputError(f"must be a {kind.__name__}, is {shorten(repr(data), 60)}")
    return kind(data)


def _array(data: Data, _: object) -> Array:
    return read_only(np.zeros(data["shape"]) if isinstance(data, dict) else data)


_PoseNumbers = make_dataclass("_PoseNumbers", [(name, float) for name in ("x", "y", "phi")])


def _pose(data: Data, _: object) -> Pose2:
    """Of any numbers: a pose that was told need not be finite."""
    return numbers(_converter.structure(data, _PoseNumbers), Pose2)


def _is_array(kind: Any) -> bool:
    return get_origin(kind) is np.ndarray


def _is_settings(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, Settings)


_converter = Converter(forbid_extra_keys=True)
for _kind in (str, bool, int, float):
    _converter.register_structure_hook(_kind, _plain)
_converter.register_structure_hook(Pose2, _pose)
# The library doesn't read the hints of named tuples.
_converter.register_structure_hook(Stop, lambda data, _: Stop(*_converter.structure(data, tuple[str, int])))
_converter.register_structure_hook_func(_is_settings, lambda data, kind: kind(**data))
_converter.register_structure_hook_func(_is_array, _array)
# What the hint of a measurement's covariance says is what its constructor takes.
_converter.register_structure_hook_func(
    lambda kind: kind == ArrayLike | None, lambda data, _: None if data is None else _array(data, _)
)
