"""Lines of a recording: JSON objects, each sealed with a checksum of its text.

A recording is a JSON Lines file in UTF-8: a header, a line a cycle, an end mark. What is written is what
`pydantic_core` makes of the values: dataclasses become objects, enums their values, tuples and arrays lists,
and numbers come back to the last bit. The last entry "crc" is the CRC-32, in hexadecimal, of the text before.
"""

from __future__ import annotations

from typing import Any
from zlib import crc32

import numpy as np
from pydantic_core import to_json, to_jsonable_python

from geometry.files import from_json

Data = Any
"""What `json` reads: dicts, lists, strings, numbers, booleans, None."""

FORMAT = "rti-mpcc recording"
VERSION = 4
"""Of the format; grows with every change that older or newer programs could not read."""

END = "end"
"""Key of the end mark; its value is the number of cycles."""

_CHECKSUM = "crc"


def _array_data(array: np.ndarray[Any, Any] | np.generic) -> Data:
    """As nested lists; an array without entries by its shape, which lists would lose."""
    return array.tolist() if array.size else {"shape": array.shape}


_OPTIONS: dict[str, Any] = {"inf_nan_mode": "constants", "fallback": _array_data}


def to_data(value: object) -> Data:
    """What a line would say of a value."""
    return to_jsonable_python(value, **_OPTIONS)


def to_text(value: object) -> bytes:
    """A value as JSON text."""
    return to_json(value, **_OPTIONS)


def to_line(value: object) -> bytes:
    """The text of a line, with its checksum and its end."""
    return _sealed(to_text(value)[:-1]) + b"\n"


def from_line(line: bytes) -> tuple[dict[str, Data], bool]:
    """What a line says, and whether its checksum fits; nothing if it is no JSON object."""
    try:
        data = from_json(line.decode("utf-8"))
    except ValueError:
        data = None
    if not isinstance(data, dict):
        return {}, False
    data.pop(_CHECKSUM, None)
    return data, line == _sealed(line[: -len(_sealed(b""))])


def _sealed(text: bytes) -> bytes:
    return text + b',"%s":"%08x"}' % (_CHECKSUM.encode(), crc32(text))
