"""Exceptions raised on purpose by this project, all with one base, and values as their messages show them."""

from __future__ import annotations

from importlib.util import find_spec

BAD_INPUT = (TypeError, ValueError, OverflowError)
"""What Python and numpy raise for a value that is no number, or no array of numbers."""

_NAMES = {"cv2": "OpenCV"}
"""Names of libraries in messages, where they differ from the name that is imported."""


class RtiMpccError(Exception):
    """Base of every exception this project raises on purpose."""


class InputError(RtiMpccError, ValueError):
    """A value given by the user is not usable; the message names field, value and allowed range."""


class PathError(InputError):
    """A reference path cannot be built from what was given."""


class CorridorError(InputError):
    """A corridor cannot be built from what was given."""


class AreaError(InputError):
    """An area cannot be built from what was given, or its map file cannot be read."""


class ConfigError(InputError):
    """A setting is missing, unknown, of the wrong type or out of range."""


class MissingExtraError(RtiMpccError, ImportError):
    """A library that only an optional extra brings is not installed; the message says how to get it."""


def shown(value: object, most: int = 80) -> str:
    """Return a value for a message: one line of at most so many characters."""
    if isinstance(value, str) and " " in value and value.isprintable():
        said = value
    else:
        try:
            said = " ".join(repr(value).split())
        except ValueError:  # a whole number of thousands of digits
            said = f"a {type(value).__name__}"
    return said if len(said) <= most else f"{said[: most - 3]}..."


def check_extra(extra: str, need: str, *libraries: str) -> None:
    """Raise MissingExtraError if one of the libraries is not installed. None of them is loaded.

    Args:
        extra: the extra that brings the libraries.
        need: start of the message, with its verb: "an MCAP file needs".
        libraries: top-level names as they are imported.
    """
    for library in libraries:
        if find_spec(library) is None:
            raise missing_extra(extra, f"{need} {_NAMES.get(library, library)}, which is not installed")


def missing_extra(extra: str, problem: str) -> MissingExtraError:
    """The error that names a problem and the extra that solves it."""
    return MissingExtraError(f"{problem}: pip install '.[{extra}]' in rti-mpcc's folder")
