"""Lines of a recording: JSON objects, each with the checksum of its own canonical text.

A recording is a JSON Lines file in UTF-8: a header, a line a cycle, an end mark. The checksum "crc" is the
CRC-32, in hexadecimal, of the object without it, written by `json` without blanks in the order it stands in.
"""

from __future__ import annotations

import json
from zlib import crc32

from rti_mpcc.recording.codec import Data

FORMAT = "rti-mpcc recording"
VERSION = 1
"""Of the format; grows when older programs could not read it."""

END = "end"
"""Key of the end mark; its value is the number of cycles."""

_CHECKSUM = "crc"


def to_line(data: dict[str, Data]) -> str:
    """The text of a line, with its checksum and its end."""
    text = _canonical(data)
    return f'{text[:-1]},"{_CHECKSUM}":"{_checksum(text)}"}}\n'


def from_line(line: bytes) -> tuple[dict[str, Data], bool]:
    """What a line says, and whether its checksum fits. Raises ValueError if it is no JSON object.

    The checksum is that of numbers as they are written here: 1E-5 says the same as 1e-05, but does not fit.
    """
    others: list[str] = []

    def number(text: str) -> float:
        value = float(text)
        if repr(value) != text:
            others.append(text)
        return value

    data = json.loads(line.decode("utf-8"), parse_float=number)
    if not isinstance(data, dict):
        raise ValueError("not a JSON object")
    checksum = data.pop(_CHECKSUM, None)
    return data, not others and checksum == _checksum(_canonical(data))


def _canonical(data: dict[str, Data]) -> str:
    return json.dumps(data, ensure_ascii=False, separators=(",", ":"))


def _checksum(text: str) -> str:
    return f"{crc32(text.encode('utf-8')):08x}"
