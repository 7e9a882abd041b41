"""`rti-mpcc docks`: checks a file of docks and draws them."""

from __future__ import annotations

import argparse
from pathlib import Path

from rti_mpcc.cli.arguments import DONE, Commands
from rti_mpcc.report.console import tell_tables, tell_written
from rti_mpcc.report.files import make_writable
from rti_mpcc.report.table import docks_table
from rti_mpcc.simulation.docks_file import read_docks


def add_to(commands: Commands) -> None:
    """Add the command."""
    docks = commands.add_parser(
        "docks",
        help="check a file of docks and draw them",
        description="Check a file of docks (TOML), list them, and write docks.png.",
        epilog="Exit status: 0 all can be used, 2 bad input, with a line for each problem.",
    )
    docks.add_argument("file", metavar="FILE", type=Path, help="a .toml file of docks")
    docks.add_argument("--out", type=Path, metavar="DIR", help="folder of docks.png; default: runs/<file>")
    docks.set_defaults(command=_docks)


def _docks(arguments: argparse.Namespace) -> int:
    docks = read_docks(arguments.file)
    folder = arguments.out if arguments.out is not None else Path("runs") / arguments.file.stem
    make_writable(folder)
    # Not at the top: matplotlib takes long to load.
    from rti_mpcc.report.axes import save
    from rti_mpcc.report.docks_figure import docks_figure

    picture = folder / "docks.png"
    save(docks_figure(arguments.file.name, docks), picture)
    tell_tables([docks_table(arguments.file.name, docks)])
    tell_written((picture,))
    return DONE
