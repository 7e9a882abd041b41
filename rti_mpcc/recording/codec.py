"""Values as JSON data and back, to the last bit.

Data are what `json` reads and writes: dicts, lists, strings, numbers, booleans, None. Dataclasses become
dicts by field, enums their values, tuples lists. An array becomes {"array": nested lists}, or where it is
large {"base64": ..., "shape": [...]} of its float64 in little-endian order. The way back goes by type hints.

Dataclasses are rebuilt field by field, without their own checks: a pose that is not finite comes back as it
was. An error says where in the data it is: its text grows to the left on its way out.
"""

from __future__ import annotations

from base64 import b64decode, b64encode
from collections.abc import Callable
from dataclasses import fields, is_dataclass
from enum import Enum
from math import nan
from types import NoneType, UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import ArrayLike

from estimation import GoalMeasurement
from geometry.settings import Settings
from rti_mpcc.errors import InputError
from rti_mpcc.types import Array

Data = Any
Decoder = Callable[[Data], Any]

SMALL = 32
"""Arrays of up to so many numbers are written legibly."""

_PLAIN = (str, bool, int, float, NoneType)
# Where the hint says what a constructor takes, and not what the field then holds.
_HINTS: dict[tuple[type, str], Any] = {(GoalMeasurement, "covariance"): Array | None}


def to_data(value: object) -> Data:
    """The value as JSON data.

    Raises:
        InputError: a type that recordings don't know.
    """
    if type(value) in _PLAIN:
        return value
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, np.ndarray):
        return array_data(value)
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, tuple | list):
        return [to_data(item) for item in value]
    if isinstance(value, dict):
        return {str(key): to_data(item) for key, item in value.items()}
    if isinstance(value, Settings):
        return to_data(value.model_dump())
    if is_dataclass(value):
        return fields_data(value, type(value))
    raise InputError(f"{value!r}: a {type(value).__name__} cannot be recorded")


def fields_data(value: object, kind: type) -> dict[str, Data]:
    """What a value has of the fields of the dataclass `kind`, as JSON data."""
    return {field.name: to_data(getattr(value, field.name)) for field in fields(kind)}


def array_data(values: ArrayLike) -> dict[str, Data]:
    """Numbers of any shape as JSON data. Raises TypeError or ValueError if they are none."""
    array = np.asarray(values, dtype="<f8")
    if 0 < array.size <= SMALL:
        return {"array": array.tolist()}
    return {"base64": b64encode(array.tobytes()).decode("ascii"), "shape": list(array.shape)}


def is_array(data: Data) -> bool:
    """Whether data are those of an array."""
    return isinstance(data, dict) and (data.keys() == {"array"} or data.keys() == {"base64", "shape"})


def array_from(data: Data) -> Array:
    """The array, read-only. Raises InputError for other data."""
    if not is_array(data):
        raise InputError(f" = {_short(data)}: must be an array")
    try:
        if "array" in data:
            array = np.array(data["array"], dtype=np.float64)
        else:
            content = np.frombuffer(b64decode(data["base64"], validate=True), dtype="<f8")
            array = content.reshape(data["shape"]).astype(np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f": not an array of numbers ({error})") from None
    array.setflags(write=False)
    return array


def decoder(hint: Any) -> Decoder:
    """What makes a value of the hinted type from JSON data; raises InputError for other data."""
    origin, arguments = get_origin(hint), get_args(hint)
    if origin in (Union, UnionType):
        return _optional(arguments)
    if origin is np.ndarray:
        return array_from
    if origin is tuple:
        return _tuple(arguments)
    if origin is dict:
        return _dict(decoder(arguments[1]))
    if hint in _NUMBERS:
        return _NUMBERS[hint]
    if issubclass(hint, Enum):
        return _enum(hint)
    if issubclass(hint, Settings):
        return _settings(hint)
    if is_dataclass(hint):
        return _dataclass(hint)
    if issubclass(hint, tuple):
        return _named_tuple(hint)
    raise TypeError(f"no decoder for {hint!r}")


def _float(data: Data) -> float:
    if type(data) not in (float, int):
        raise InputError(f" = {_short(data)}: must be a number")
    # One object for all: a tuple with a NaN equals another one if it is the same object.
    return float(data) if data == data else nan


def _exactly(kind: type) -> Decoder:
    def decode(data: Data) -> Any:
        if type(data) is not kind:
            raise InputError(f" = {_short(data)}: must be a {kind.__name__}")
        return data

    return decode


_NUMBERS: dict[Any, Decoder] = {float: _float, int: _exactly(int), bool: _exactly(bool), str: _exactly(str)}


def _optional(arguments: tuple[Any, ...]) -> Decoder:
    kinds = [argument for argument in arguments if argument is not NoneType]
    if len(kinds) != 1:
        raise TypeError(f"no decoder for a choice of {kinds}")
    decode = decoder(kinds[0])
    return lambda data: None if data is None else decode(data)


def _tuple(arguments: tuple[Any, ...]) -> Decoder:
    if arguments[1:] == (Ellipsis,):
        each = decoder(arguments[0])
        return lambda data: tuple(at(i, each, item) for i, item in enumerate(_list(data)))
    decoders = [decoder(argument) for argument in arguments]

    def decode(data: Data) -> tuple[Any, ...]:
        if len(_list(data)) != len(decoders):
            raise InputError(f" has {len(data)} items: must have {len(decoders)}")
        return tuple(at(i, each, data[i]) for i, each in enumerate(decoders))

    return decode


def _named_tuple(kind: Any) -> Decoder:
    values = _tuple(tuple(get_type_hints(kind).values()))
    return lambda data: kind(*values(data))


def _dict(each: Decoder) -> Decoder:
    return lambda data: {key: at(key, each, item) for key, item in _mapping(data).items()}


def _enum(kind: type[Enum]) -> Decoder:
    def decode(data: Data) -> Enum:
        try:
            return kind(data)
        except ValueError:
            raise InputError(f" = {_short(data)}: is no {kind.__name__}") from None

    return decode


def _settings(kind: type[Settings]) -> Decoder:
    def decode(data: Data) -> Settings:
        try:
            return kind(**_mapping(data))
        except InputError as error:
            raise InputError(f": {error}") from None

    return decode


def _dataclass(kind: Any) -> Decoder:
    hints = get_type_hints(kind)
    decoders = {
        field.name: decoder(_HINTS.get((kind, field.name), hints[field.name])) for field in fields(kind)
    }

    def decode(data: Data) -> Any:
        if _mapping(data).keys() != decoders.keys():
            odd = ", ".join(sorted(data.keys() ^ decoders.keys()))
            raise InputError(f": missing or unknown in a {kind.__name__}: {odd}")
        made = object.__new__(kind)
        for name, each in decoders.items():
            object.__setattr__(made, name, at(name, each, data[name]))
        return made

    return decode


def at(place: str | int, decode: Decoder, data: Data) -> Any:
    """What a decoder makes of the data at a field or an index, which its error then names."""
    try:
        return decode(data)
    except InputError as error:
        name = f"[{place}]" if isinstance(place, int) else f".{place}"
        raise InputError(f"{name}{error}") from None


def _list(data: Data) -> list[Data]:
    if not isinstance(data, list):
        raise InputError(f" = {_short(data)}: must be a list")
    return data


def _mapping(data: Data) -> dict[str, Data]:
    if not isinstance(data, dict):
        raise InputError(f" = {_short(data)}: must be an object with named fields")
    return data


def _short(data: Data) -> str:
    text = repr(data)
    return text if len(text) <= 60 else f"{text[:57]}..."
