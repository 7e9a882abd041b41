"""Lines of a recording: JSON objects, each sealed with a checksum of its text.

A recording is a JSON Lines file: a header, a line a cycle, an end mark. Values become JSON, and values of the
same kind again, by the type hints of their dataclasses; numbers keep every bit. The last entry "crc" of a
line is the CRC-32, in hexadecimal, of the text before.
"""

from __future__ import annotations

from typing import Any, TypeVar, get_origin
from zlib import crc32

import numpy as np
from cattrs import BaseValidationError, transform_error
from cattrs.preconf.json import make_converter
from cattrs.strategies import configure_tagged_union
from numpy.typing import ArrayLike

from geometry import Area, Pose2
from geometry.files import from_json
from geometry.pose import unchecked_pose
from geometry.settings import Settings
from rti_mpcc.errors import InputError
from rti_mpcc.qp.solver import Stop
from rti_mpcc.steps import AnyStep, Signal
from rti_mpcc.types import Array

T = TypeVar("T")
Data = Any
"""What `json` reads: dicts, lists, strings, numbers, booleans, None."""


def to_data(value: object) -> Data:
    """The JSON data of a value."""
    return _converter.unstructure(value)


def to_line(value: object) -> bytes:
    """The text of a line, with its checksum and its end."""
    return _sealed(_converter.dumps(value, separators=(",", ":")).encode()[:-1]) + b"\n"


def from_line(line: bytes) -> tuple[dict[str, Data], bool]:
    """The data of a line, and whether its checksum fits; no data if it is no JSON object."""
    try:
        data = from_json(line.decode())
    except ValueError:
        data = None
    if not isinstance(data, dict):
        return {}, False
    data.pop("crc", None)
    return data, line == _sealed(line[: -len(_sealed(b""))])


def structured(data: Data, kind: type[T]) -> T:
    """The value of a kind that JSON data describe. Raises InputError, which names the place of each fault."""
    try:
        value: T = _converter.structure(data, kind)
    except BaseValidationError as error:
        raise InputError("; ".join(transform_error(error))) from None
    return value


def prepare_codec(*kinds: Any) -> None:
    """Generate the code that writes and reads these kinds: the first value would do it in a cycle."""
    for kind in kinds:
        _converter.get_unstructure_hook(kind)
        _converter.get_structure_hook(kind)


def as_recorded(value: object, kind: Any, instead: T) -> T:
    """Any value as a recording gives it back, or `instead` if a recording cannot hold it. Never raises."""
    try:
        found: T = _converter.structure(_converter.unstructure(value, unstructure_as=kind), kind)
    except Exception:  # whatever comes of looking at an odd value: the cycle has to go on
        return instead
    return found


def _sealed(text: bytes) -> bytes:
    return text + b',"crc":"%08x"}' % crc32(text)


def _to_list(array: ArrayLike | None) -> Data:
    """Nested lists; the shape of an array without entries, which lists would lose."""
    if array is None:
        return None
    array = np.asarray(array, dtype=np.float64)
    return array.tolist() if array.size else {"shape": array.shape}


def _to_array(data: Data, _: object) -> Array | None:
    if data is None:  # of a covariance or a body
        return None
    array = np.zeros(data["shape"]) if isinstance(data, dict) else np.array(data, dtype=np.float64)
    array.setflags(write=False)
    return array


def _played_back(given: bool, _: object) -> Signal | None:
    """Stands for the `until` of a step: a recording holds that there is one, and each cycle its answer."""
    return (lambda: False) if given else None


def _is_array(kind: Any) -> bool:
    return kind is np.ndarray or get_origin(kind) is np.ndarray or kind == ArrayLike | None


_converter = make_converter(forbid_extra_keys=True)
for _kind in (bool, int, float):
    _converter.register_unstructure_hook(_kind, _kind)  # NumPy's are no JSON
_converter.register_structure_hook(Pose2, lambda data, _: unchecked_pose(**data))
# The library doesn't read the hints of named tuples.
_converter.register_structure_hook(Stop, lambda data, _: Stop(*_converter.structure(data, tuple[str, int])))
for _fits, _to, _back in (
    (_is_array, _to_list, _to_array),
    (
        lambda kind: isinstance(kind, type) and issubclass(kind, Settings),
        lambda group: group.model_dump(mode="json"),
        lambda data, kind: kind(**data),
    ),
    (lambda kind: kind == Signal | None, lambda until: until is not None, _played_back),
    (
        lambda kind: kind is Area,
        lambda area: to_data({"boundary": area.boundary, "obstacles": area.obstacles}),
        lambda data, _: Area(**data),
    ),
):
    _converter.register_unstructure_hook_func(_fits, _to)
    _converter.register_structure_hook_func(_fits, _back)
configure_tagged_union(
    AnyStep, _converter, tag_generator=lambda kind: str(vars(kind)["word"]), tag_name="step"
)
