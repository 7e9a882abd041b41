"""The command `rti-mpcc`: scenarios, run, plan, docks, compare, campaign, replay, show, identify, warm."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from geometry import compiled
from rti_mpcc import __version__
from rti_mpcc.cli.arguments import BAD_INPUT, DONE
from rti_mpcc.cli.campaign import add_campaign, add_compare
from rti_mpcc.cli.plan import add_docks, add_plan
from rti_mpcc.cli.recordings import add_identify, add_replay, add_show
from rti_mpcc.cli.run import add_run
from rti_mpcc.errors import RtiMpccError
from rti_mpcc.kernels import make_ready
from rti_mpcc.report.text import print_lines, warnings_on_stderr
from rti_mpcc.simulation import builtin_names, load_scenario

_INTERRUPTED = 130


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command with `argv` (default: the process's own) and return the exit status, without exiting.

    0: docked, or a route was found, or a replay is identical; 1: not docked, or the body crossed a boundary,
    or a step of a mission failed for good, or no route was found, or a replay differs; 2: bad input, in one
    message on stderr.
    """
    parser = argparse.ArgumentParser(
        prog="rti-mpcc", description="Dock car-like vehicles with a real-time-iteration MPCC, in simulation."
    )
    parser.add_argument("--version", action="version", version=f"{parser.prog} {__version__}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    commands.add_parser("scenarios", help="list the built-in scenarios").set_defaults(command=_scenarios)
    for add in (add_run, add_plan, add_docks, add_compare, add_campaign, add_replay, add_show, add_identify):
        add(commands)
    about = "Compile the kernels that this machine has not compiled yet. Otherwise the first controller of a "
    about += "process does it, before its first cycle."
    warm = commands.add_parser("warm", help="compile the kernels now", description=about)
    warm.set_defaults(command=_warm)
    return exit_status(parser, argv)


def exit_status(parser: argparse.ArgumentParser, argv: Sequence[str] | None) -> int:
    """Parse, run what the parser has set as `command`, and turn bad input into one message on stderr."""
    try:
        arguments = parser.parse_args(argv)
    except SystemExit as leaving:  # argparse has printed an error or the help
        return leaving.code if isinstance(leaving.code, int) else BAD_INPUT
    with warnings_on_stderr(parser.prog):
        try:
            status: int = arguments.command(arguments)
        except RtiMpccError as error:
            return _refuse(parser.prog, str(error))
        except OSError as error:
            message = f"{error.filename}: {error.strerror}" if error.filename else str(error)
            return _refuse(parser.prog, message)
        except KeyboardInterrupt:
            _refuse(parser.prog, "interrupted")
            return _INTERRUPTED
    return status


def _warm(arguments: argparse.Namespace) -> int:
    count, problem = make_ready(second_process=True), compiled.not_kept()
    said = f"compiled {count} kernels" if count else "all kernels are ready"
    where = f"but they are not kept: {problem}" if problem else f"kept in {compiled.directory()}"
    print_lines([f"{said}, {where}"])
    return DONE


def _scenarios(arguments: argparse.Namespace) -> int:
    width = max(map(len, builtin_names()))
    print_lines([f"{name:{width}}  {load_scenario(name).description}" for name in builtin_names()])
    return DONE


def _refuse(program: str, message: str) -> int:
    for line in message.splitlines():
        sys.stderr.write(f"{program}: error: {line}\n")
    return BAD_INPUT
