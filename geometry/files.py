"""Where every file comes in that somebody else may have written: nothing takes far more than its size.

A file is regular and not too large, its text is UTF-8 with or without a byte order mark. What it says is
bounded before it is used: no deep nesting, no endless keys or numbers. The functions raise OSError for a file
and ValueError for its content, worded as what the file is or has; each caller makes one line in its own error
class of both.
"""

from __future__ import annotations

import errno
import json
import os
import re
import stat
import tomllib
from os import PathLike
from typing import Any, BinaryIO

File = str | PathLike[str]

TEXT = 2_000_000  # [bytes] of a TOML or JSON file, at most
YAML = 20_000  # [bytes] of a YAML file: PyYAML is slow
TABLE = 200_000_000  # [bytes] of a CSV file or a picture
RECORDING = 2_000_000_000  # [bytes] of a recording: hours of driving
PIXELS = 64_000_000  # of a picture: 8,000 by 8,000
DEPTH = 32  # of lists and tables in one another, and keys that are joined by dots

_TOO_DEEP = f"is nested more than {DEPTH} deep"
_WHOLE = 2**63  # whole numbers are less: TOML has 64 bits, and long ones cannot even be printed
_OPAQUE = re.compile(
    r'"""(?:[^\\]|\\.)*?"{3,5}' r"|'''.*?'{3,5}" r'|"(?:[^"\\\n]|\\.)*+"' r"|'[^'\n]*+'" r"|\#[^\n]*+",
    re.DOTALL,
)  # strings and comments of TOML
_DOTTED = re.compile(r"(?<![\w-])(?:[\w-]++[ \t]*+\.[ \t]*+){" + str(DEPTH) + "}")


def opened(file: File, most: int) -> BinaryIO:
    """Open a file to read it, if it is a regular one of at most so many bytes. Raises OSError."""

    def at_once(name: str, flags: int) -> int:  # to open a pipe would wait for who writes to it
        return os.open(name, flags | getattr(os, "O_NONBLOCK", 0))

    try:
        stream = open(file, "rb", opener=at_once)  # noqa: SIM115
    except ValueError as error:  # a null byte in its name
        raise OSError(errno.EINVAL, str(error)) from None
    found = os.fstat(stream.fileno())
    if stat.S_ISREG(found.st_mode) and found.st_size <= most:
        return stream
    stream.close()
    if not stat.S_ISREG(found.st_mode):
        raise OSError(errno.EINVAL, "it is no regular file")
    raise OSError(errno.EFBIG, f"it has {found.st_size / 1e6:.1f} MB, {most / 1e6:g} MB are allowed")


def content(file: File, most: int) -> bytes:
    """Return the bytes of a regular file, at most so many. Raises OSError."""
    with opened(file, most) as stream:
        return stream.read(os.fstat(stream.fileno()).st_size)


def text(file: File, most: int = TEXT) -> str:
    """Return the text of a file in UTF-8. Raises OSError or UnicodeDecodeError."""
    return content(file, most).decode("utf-8-sig")


def from_toml(said: str) -> dict[str, Any]:
    """Return the table that a TOML text says. Raises ValueError."""
    if _DOTTED.search(_OPAQUE.sub("s", said)):
        raise ValueError(f"has a key of more than {DEPTH} parts")
    try:
        found = tomllib.loads(said)
    except RecursionError:
        raise ValueError(_TOO_DEEP) from None
    check_plain(found)
    return found


def from_json(said: str | bytes) -> Any:
    """Return what a JSON text says. Raises ValueError."""
    try:
        return json.loads(said)
    except RecursionError:
        raise ValueError(_TOO_DEEP) from None


def check_plain(data: Any, depth: int = DEPTH) -> None:
    """Raise ValueError for data that are nested too deep, or have a number that is too long."""
    if depth == 0:
        raise ValueError(_TOO_DEEP)
    if isinstance(data, int) and not -_WHOLE <= data < _WHOLE:
        raise ValueError("has a whole number of more than 64 bits")
    inner = data.values() if isinstance(data, dict) else data if isinstance(data, list | tuple) else ()
    for each in inner:
        check_plain(each, depth - 1)
