"""`rti-mpcc replay`: drive a controller with the inputs of a recording and compare."""

from __future__ import annotations

import argparse
from pathlib import Path

from rti_mpcc.cli.arguments import DIFFERENT, IDENTICAL, Commands, add_dump_failed, tolerance
from rti_mpcc.recording import replay
from rti_mpcc.report.console import progress_bar, tell_lines
from rti_mpcc.report.table import replay_lines


def add_to(commands: Commands) -> None:
    """Add the command."""
    again = commands.add_parser(
        "replay",
        help="run the controller on a recording and compare",
        description="Drive the controller with the inputs of a recording, and print the first cycle that "
        "differs from the recorded one.",
        epilog="Exit status: 0 identical, 1 a difference, 2 bad input.",
    )
    again.add_argument("file", metavar="FILE", type=Path, help="file of `run --record`")
    usual = "0: bit for bit; default: 0 on the machine and versions of the recording, 1e-9 elsewhere"
    again.add_argument("--tolerance", type=tolerance, metavar="X", help=usual)
    again.add_argument(
        "--partial", action="store_true", help="replay the whole cycles of a truncated recording"
    )
    add_dump_failed(again)
    again.set_defaults(command=_replay)


def _replay(arguments: argparse.Namespace) -> int:
    with progress_bar(arguments.file.name, "cycle {task.completed:.0f}") as progress:
        report = replay(
            arguments.file,
            tolerance=arguments.tolerance,
            allow_truncated=arguments.partial,
            dump_failed=arguments.dump_failed,
            progress=progress,
        )
    tell_lines(replay_lines(report))
    return IDENTICAL if report.identical else DIFFERENT
