"""The command `rti-mpcc`: list the built-in scenarios, run one (contract 3.2)."""

from __future__ import annotations

import argparse
import logging
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from rti_mpcc.errors import RtiMpccError
from rti_mpcc.report.files import write_files
from rti_mpcc.report.table import summary_table
from rti_mpcc.simulation import (
    GoalSource,
    RunResult,
    Scenario,
    builtin_names,
    load_scenario,
    simulate,
    summary,
)
from rti_mpcc.simulation.closed_loop import METHODS
from rti_mpcc.simulation.goal_feed import source_in
from rti_mpcc.simulation.scenario import PRESETS

DOCKED, NOT_DOCKED, BAD_INPUT = 0, 1, 2
"""Exit status."""
_INTERRUPTED = 130
_PROGRAM = "rti-mpcc"
_TABLE_WIDTH = 100


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command with `argv` (default: the process's own) and return the exit status, without exiting.

    0: docked; 1: not docked, or the body crossed a boundary; 2: bad input, told in one message on stderr.
    """
    try:
        arguments = _parser().parse_args(argv)
    except SystemExit as leaving:  # argparse has told what is wrong, or printed the help
        return leaving.code if isinstance(leaving.code, int) else BAD_INPUT
    with _warnings_on_stderr():
        try:
            status: int = arguments.command(arguments)
        except RtiMpccError as error:
            return _refuse(str(error))
        except OSError as error:
            return _refuse(f"{error.filename}: {error.strerror}" if error.filename else str(error))
        except KeyboardInterrupt:
            _refuse("interrupted")
            return _INTERRUPTED
    return status


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog=_PROGRAM, description="Dock car-like vehicles with a real-time-iteration MPCC, in simulation."
    )
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    listing = commands.add_parser("scenarios", help="list the built-in scenarios")
    listing.set_defaults(command=_scenarios)
    run = commands.add_parser(
        "run",
        help="run a scenario, print its figures, write its files",
        epilog="Exit status: 0 docked, 1 not docked or a boundary was crossed, 2 bad input.",
    )
    run.add_argument("scenario", metavar="SCENARIO", help="name of a built-in scenario, or a .toml file")
    run.add_argument("--method", choices=METHODS, default="dynamic", help="default: %(default)s")
    run.add_argument("--preset", choices=PRESETS, default="default", help="default: %(default)s")
    run.add_argument("--seed", type=_seed, default=0, metavar="N", help="of all noise; default: %(default)s")
    run.add_argument("--out", type=Path, metavar="DIR", help="where files go; default: runs/<name>")
    run.add_argument(
        "--goal-source",
        choices=[source.value for source in GoalSource],
        default=GoalSource.DETECTED.value,
        help="what tells the goal in a scenario with [goal.measurement]: filtered detections, the newest "
        "detection as it is, or the truth; default: %(default)s",
    )
    run.add_argument("--no-plots", action="store_true", help="write no pictures")
    run.add_argument(
        "--discs", action="store_true", help="draw the discs that cover the body in the overview"
    )
    run.set_defaults(command=_run)
    return parser


def _seed(text: str) -> int:
    if not text.isascii() or not text.isdigit():
        raise argparse.ArgumentTypeError(f"{text!r} must be an integer >= 0")
    return int(text)


def _scenarios(arguments: argparse.Namespace) -> int:
    names = builtin_names()
    width = max(map(len, names))
    console = Console(highlight=False)
    for name in names:
        line = f"{name:{width}}  {load_scenario(name).description}"
        console.print(line, markup=False, soft_wrap=True)
    return DOCKED


def _run(arguments: argparse.Namespace) -> int:
    scenario = load_scenario(arguments.scenario)
    # simulate() would find it, too, but after the folder was made.
    source_in(
        scenario.name,
        GoalSource(arguments.goal_source),
        detector=scenario.goal.measurement is not None,
    )
    folder = arguments.out if arguments.out is not None else Path("runs") / scenario.name
    _make_writable(folder)
    result = _with_progress(scenario, arguments)
    figures = summary(result)
    written = write_files(result, figures, folder, plots=not arguments.no_plots, discs=arguments.discs)
    _tell(figures, written)
    crossed = figures["min_clearance_m"] is not None and figures["min_clearance_m"] < 0.0
    return DOCKED if figures["docked"] and not crossed else NOT_DOCKED


def _make_writable(folder: Path) -> None:
    """Before the run, so that it is not driven in vain. Raises OSError."""
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryFile(dir=folder):
        pass


def _with_progress(scenario: Scenario, arguments: argparse.Namespace) -> RunResult:
    def run(progress: Callable[[float], None] | None) -> RunResult:
        return simulate(
            scenario,
            preset=arguments.preset,
            method=arguments.method,
            seed=arguments.seed,
            progress=progress,
            goal_source=GoalSource(arguments.goal_source),
        )

    console = Console(stderr=True)
    if not console.is_terminal:
        return run(None)
    columns = (
        TextColumn(scenario.name),
        BarColumn(),
        TextColumn("{task.completed:.1f} s"),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=console, transient=True, refresh_per_second=4) as bar:
        task = bar.add_task("", total=scenario.simulation.duration)
        return run(lambda time: bar.update(task, completed=time))


def _tell(figures: dict[str, Any], written: Sequence[Path]) -> None:
    console = Console(highlight=False)
    # Piped into a file the table keeps its width: a guess of 80 columns would cut it.
    width = None if console.is_terminal else _TABLE_WIDTH
    console.print(summary_table(figures), width=width)
    console.print(f"written: {', '.join(map(str, written))}", markup=False, soft_wrap=True)


def _refuse(message: str) -> int:
    for line in message.splitlines():
        sys.stderr.write(f"{_PROGRAM}: error: {line}\n")
    return BAD_INPUT


@contextmanager
def _warnings_on_stderr() -> Iterator[None]:
    """Show the package's log from warnings up while a command runs."""
    handler = logging.StreamHandler(sys.stderr)
    handler.setLevel(logging.WARNING)
    handler.setFormatter(logging.Formatter(f"{_PROGRAM}: warning: %(message)s"))
    # The controller tells again what the check of the file has told with the file's name.
    handler.addFilter(lambda record: record.name != "rti_mpcc.planning.surroundings")
    logger = logging.getLogger("rti_mpcc")
    logger.addHandler(handler)
    try:
        yield
    finally:
        logger.removeHandler(handler)
