"""Exit statuses, and arguments that several commands have."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Any

from rti_mpcc.paper import METHODS
from rti_mpcc.report.files import make_writable
from rti_mpcc.simulation.scenario import PRESETS

DONE, FAILED, BAD_INPUT = 0, 1, 2  # exit status; 1: not docked, no route found, or a difference
Commands = Any  # the type that argparse adds commands to; its own name for it is private


def integer(least: int) -> Callable[[str], int]:
    """Type of an argument: an integer, `least` or more."""

    def checked(text: str) -> int:
        if not text.isascii() or not text.isdigit() or int(text) < least:
            raise argparse.ArgumentTypeError(f"{text!r} must be an integer >= {least}")
        return int(text)

    return checked


OPTIONS: dict[str, dict[str, Any]] = {
    "scenario": {"metavar": "SCENARIO", "help": "name of a built-in scenario, or a .toml file"},
    "--method": {"choices": METHODS, "help": "objective's method; default: the scenario's, or dynamic"},
    "--preset": {"choices": PRESETS, "default": "default", "help": "preset of settings; default: default"},
    "--seed": {
        "type": integer(0),
        "default": 0,
        "metavar": "N",
        "help": "random seed for all noise; default: 0",
    },
    "--dump-failed": {"type": Path, "metavar": "DIR", "help": "folder for the QPs of failed cycles, as .npz"},
    "--mcap": {"type": Path, "metavar": "FILE", "help": "write an MCAP file, which Foxglove and Rerun open"},
    "--jobs": {"type": integer(1), "metavar": "K", "help": "number of processes; default: one a core"},
    "--no-plots": {"action": "store_true", "help": "write no pictures"},
    "recording": {"metavar": "RECORDING", "type": Path, "help": "file of a `Recorder` or `run --record`"},
    "--partial": {"action": "store_true", "help": "use the whole cycles of a truncated recording"},
}
"""Arguments that several commands have, as argparse takes them."""


def add_options(parser: argparse.ArgumentParser, *names: str) -> None:
    """Add some of `OPTIONS`."""
    for name in names:
        parser.add_argument(name, **OPTIONS[name])


def add_folder(parser: argparse.ArgumentParser, usual: str) -> None:
    """`--out DIR`."""
    text = f"folder of the written files; default: {usual}"
    parser.add_argument("--out", type=Path, metavar="DIR", help=text)


def writable_folder(given: Path | None, name: str) -> Path:
    """The folder that was asked for, or runs/<name>, made and writable. Raises OSError."""
    folder = Path("runs") / name if given is None else given
    make_writable(folder)
    return folder
