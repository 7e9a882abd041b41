"""What the commands share: exit statuses, options, and the values that an argument may have."""

from __future__ import annotations

import argparse
from math import isfinite
from pathlib import Path
from typing import Any

from rti_mpcc.paper import METHODS
from rti_mpcc.simulation.scenario import PRESETS

DOCKED, NOT_DOCKED, BAD_INPUT = 0, 1, 2
DONE = 0
"""Exit status."""
IDENTICAL, DIFFERENT = 0, 1
"""Exit status of a replay."""
FOUND, NOT_FOUND = 0, 1
"""Exit status of a search for a route."""
Commands = Any
"""The type that argparse adds commands to; its own name for it is private."""
SCENARIO: dict[str, Any] = {"metavar": "SCENARIO", "help": "name of a built-in scenario, or a .toml file"}
"""Of an argument that names scenarios."""


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


def add_method_and_preset(parser: argparse.ArgumentParser) -> None:
    """`--method METHOD` and `--preset PRESET`."""
    parser.add_argument("--method", choices=METHODS, default="dynamic", help="default: dynamic")
    parser.add_argument("--preset", choices=PRESETS, default="default", help="default: default")


def add_seed(parser: argparse.ArgumentParser) -> None:
    """`--seed N`."""
    told = "random seed for all noise; default: 0"
    parser.add_argument("--seed", type=seed, default=0, metavar="N", help=told)


def add_dump_failed(parser: argparse.ArgumentParser) -> None:
    """`--dump-failed DIR`."""
    told = "write the QP of each failed cycle there, as .npz"
    parser.add_argument("--dump-failed", type=Path, metavar="DIR", help=told)
