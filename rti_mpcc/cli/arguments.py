"""What the commands share: exit statuses, and what an argument may be."""

from __future__ import annotations

import argparse
from math import isfinite
from pathlib import Path
from typing import Any

DOCKED, NOT_DOCKED, BAD_INPUT = 0, 1, 2
DONE = 0
"""Exit status."""
IDENTICAL, DIFFERENT = 0, 1
"""The same of a replay."""
FOUND, NOT_FOUND = 0, 1
"""The same of a search for a way."""
Commands = Any
"""What argparse adds commands to; its own name for it is private."""


def seed(text: str) -> int:
    """Raises ArgumentTypeError for anything but an integer >= 0."""
    return _integer(text, 0)


def at_least_one(text: str) -> int:
    """Raises ArgumentTypeError for anything but an integer >= 1."""
    return _integer(text, 1)


def _integer(text: str, least: int) -> int:
    if not text.isascii() or not text.isdigit() or int(text) < least:
        raise argparse.ArgumentTypeError(f"{text!r} must be an integer >= {least}")
    return int(text)


def tolerance(text: str) -> float:
    """Raises ArgumentTypeError for anything but a number >= 0."""
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not (isfinite(value) and value >= 0.0):
        raise argparse.ArgumentTypeError(f"{text!r} must be a number >= 0")
    return value


def add_dump_failed(parser: argparse.ArgumentParser) -> None:
    """`--dump-failed DIR`."""
    parser.add_argument(
        "--dump-failed", type=Path, metavar="DIR", help="write the QP of each failed cycle there, as .npz"
    )
