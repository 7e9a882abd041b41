"""Exit statuses, and arguments that several commands have."""

from __future__ import annotations

import argparse
from math import isfinite
from pathlib import Path
from typing import Any

from rti_mpcc.paper import METHODS
from rti_mpcc.report.files import make_writable
from rti_mpcc.simulation.scenario import PRESETS

DONE, FAILED, BAD_INPUT = 0, 1, 2
"""Exit status; 1: not docked, no route found, or a difference."""
Commands = Any
"""The type that argparse adds commands to; its own name for it is private."""


def non_negative(text: str) -> int:
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


OPTIONS: dict[str, dict[str, Any]] = {
    "scenario": {"metavar": "SCENARIO", "help": "name of a built-in scenario, or a .toml file"},
    "--method": {
        "choices": METHODS,
        "default": "dynamic",
        "help": "method of the objective; default: dynamic",
    },
    "--preset": {
        "choices": PRESETS,
        "default": "default",
        "help": "preset of all settings; default: default",
    },
    "--seed": {
        "type": non_negative,
        "default": 0,
        "metavar": "N",
        "help": "random seed for all noise; default: 0",
    },
    "--dump-failed": {
        "type": Path,
        "metavar": "DIR",
        "help": "folder for the QP of each failed cycle, as .npz",
    },
    "--jobs": {"type": at_least_one, "metavar": "K", "help": "number of processes; default: one a core"},
}
"""Arguments that several commands have, as argparse takes them."""


def add_options(parser: argparse.ArgumentParser, *names: str) -> None:
    """Add some of `OPTIONS`."""
    for name in names:
        parser.add_argument(name, **OPTIONS[name])


def add_folder(parser: argparse.ArgumentParser, usual: str) -> None:
    """`--out DIR`."""
    told = f"folder of the written files; default: {usual}"
    parser.add_argument("--out", type=Path, metavar="DIR", help=told)


def writable_folder(asked: Path | None, name: str) -> Path:
    """The folder that was asked for, or runs/<name>, made and writable. Raises OSError."""
    folder = Path("runs") / name if asked is None else asked
    make_writable(folder)
    return folder
