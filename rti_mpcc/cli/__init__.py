"""The command `rti-mpcc`: scenarios, run, plan, docks, compare, campaigns, replay, watch, warm (3.2, 3.4)."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from geometry import compiled
from rti_mpcc import __version__
from rti_mpcc.cli import (
    campaign,
    compare,
    docks,
    plan,
    replay,
    run,
    watch,
)
from rti_mpcc.cli.arguments import BAD_INPUT, DOCKED
from rti_mpcc.errors import RtiMpccError
from rti_mpcc.kernels import make_ready
from rti_mpcc.report.console import tell_lines, warnings_on_stderr
from rti_mpcc.simulation import builtin_names, load_scenario

_INTERRUPTED = 130


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command with `argv` (default: the process's own) and return the exit status, without exiting.

    0: docked, or a route was found, or a replay is identical; 1: not docked, or the body crossed a boundary,
    or a step of a mission failed for good, or no route was found, or a replay differs; 2: bad input, in one
    message on stderr.
    """
    return exit_status(_parser(), argv)


def exit_status(parser: argparse.ArgumentParser, argv: Sequence[str] | None) -> int:
    """Parse, run what the parser has set as `command`, and turn bad input into one message on stderr."""
    try:
        arguments = parser.parse_args(argv)
    except SystemExit as leaving:  # argparse has told what is wrong, or printed the help
        return leaving.code if isinstance(leaving.code, int) else BAD_INPUT
    with warnings_on_stderr(parser.prog):
        try:
            status: int = arguments.command(arguments)
        except RtiMpccError as error:
            return _refuse(parser.prog, str(error))
        except OSError as error:
            said = f"{error.filename}: {error.strerror}" if error.filename else str(error)
            return _refuse(parser.prog, said)
        except KeyboardInterrupt:
            _refuse(parser.prog, "interrupted")
            return _INTERRUPTED
    return status


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="rti-mpcc", description="Dock car-like vehicles with a real-time-iteration MPCC, in simulation."
    )
    parser.add_argument("--version", action="version", version=f"{parser.prog} {__version__}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    listing = commands.add_parser("scenarios", help="list the built-in scenarios")
    listing.set_defaults(command=_scenarios)
    for module in (run, plan, docks, compare, campaign, replay, watch):
        module.add_to(commands)
    warm = commands.add_parser(
        "warm",
        help="compile the kernels now",
        description="Compile the kernels that this machine has not compiled yet. The first controller of a "
        "process does it otherwise, before its first cycle.",
    )
    warm.set_defaults(command=_warm)
    return parser


def _warm(arguments: argparse.Namespace) -> int:
    count, problem = make_ready(), compiled.not_kept()
    said = f"compiled {count} kernels" if count else "all kernels are ready"
    where = f"but they are not kept: {problem}" if problem else f"kept in {compiled.directory()}"
    tell_lines([f"{said}, {where}"])
    return DOCKED


def _scenarios(arguments: argparse.Namespace) -> int:
    names = builtin_names()
    width = max(map(len, names))
    tell_lines([f"{name:{width}}  {load_scenario(name).description}" for name in names])
    return DOCKED


def _refuse(program: str, message: str) -> int:
    for line in message.splitlines():
        sys.stderr.write(f"{program}: error: {line}\n")
    return BAD_INPUT
