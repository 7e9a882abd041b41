"""`rti-mpcc warm`: compile the kernels before they are needed."""

from __future__ import annotations

import argparse

from geometry import compiled
from rti_mpcc.cli.arguments import DOCKED, Commands
from rti_mpcc.kernels import make_ready
from rti_mpcc.report.console import tell_lines


def add_to(commands: Commands) -> None:
    """Add the command."""
    warm = commands.add_parser(
        "warm",
        help="compile the kernels now",
        description="Compile the kernels that this machine has not compiled yet. The first controller of a "
        "process does it otherwise, before its first cycle.",
    )
    warm.set_defaults(command=_warm)


def _warm(arguments: argparse.Namespace) -> int:
    compiled_now = make_ready()
    said = f"compiled {compiled_now} kernels" if compiled_now else "all kernels are ready"
    problem = compiled.not_kept()
    where = f", but they are not kept: {problem}" if problem else f", kept in {compiled.directory()}"
    tell_lines([f"{said}{where}"])
    return DOCKED
