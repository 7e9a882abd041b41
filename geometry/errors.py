"""Exceptions raised on purpose by this project, all with one base, and values as their messages show them."""

from __future__ import annotations

BAD_INPUT = (TypeError, ValueError, OverflowError)
"""What Python and numpy raise for a value that is no number, or no array of numbers."""


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
