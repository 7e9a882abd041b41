"""The command `rti-mpcc`: list the built-in scenarios, run and record one, replay it (contract 3.2)."""

from __future__ import annotations

import argparse
import logging
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from math import isfinite
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from rti_mpcc.errors import InputError, RtiMpccError
from rti_mpcc.recording import Recorder, replay
from rti_mpcc.report.files import write_files
from rti_mpcc.report.replay_lines import replay_lines
from rti_mpcc.report.table import summary_table
from rti_mpcc.simulation import (
    GoalSource,
    RunResult,
    Scenario,
    builtin_names,
    docking_controller,
    load_scenario,
    simulate,
    summary,
)
from rti_mpcc.simulation.goal_feed import source_in
from rti_mpcc.simulation.methods import METHODS
from rti_mpcc.simulation.scenario import PRESETS

DOCKED, NOT_DOCKED, BAD_INPUT = 0, 1, 2
"""Exit status."""
IDENTICAL, DIFFERENT = 0, 1
"""The same of a replay."""
_INTERRUPTED = 130
_PROGRAM = "rti-mpcc"
_TABLE_WIDTH = 100


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command with `argv` (default: the process's own) and return the exit status, without exiting.

    0: docked, or identical in replay; 1: not docked, or the body crossed a boundary, or a replay differs;
    2: bad input, told in one message on stderr.
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
    run.add_argument("--record", type=Path, metavar="FILE", help="record all cycles, for `replay`")
    _add_dump_failed(run)
    run.set_defaults(command=_run)
    again = commands.add_parser(
        "replay",
        help="run the controller on a recording and compare",
        epilog="Exit status: 0 identical, 1 a difference, 2 bad input.",
    )
    again.add_argument("file", metavar="FILE", type=Path, help="what `run --record` wrote")
    again.add_argument(
        "--tolerance",
        type=_tolerance,
        metavar="X",
        help="of numbers, relative above 1; 0 is bit for bit; default: 0 on the machine and with the "
        "versions of the recording, 1e-9 elsewhere",
    )
    again.add_argument("--partial", action="store_true", help="replay what is whole of a truncated recording")
    _add_dump_failed(again)
    again.set_defaults(command=_replay)
    return parser


def _add_dump_failed(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--dump-failed", type=Path, metavar="DIR", help="write the QP of each failed cycle there, as .npz"
    )


def _tolerance(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not (isfinite(value) and value >= 0.0):
        raise argparse.ArgumentTypeError(f"{text!r} must be a number >= 0")
    return value


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
    if arguments.dump_failed is not None and arguments.record is None:
        raise InputError("--dump-failed needs --record: what is recorded is looked through for failed cycles")
    folder = arguments.out if arguments.out is not None else Path("runs") / scenario.name
    _make_writable(folder)
    result = _simulated(scenario, arguments)
    figures = summary(result)
    written = write_files(result, figures, folder, plots=not arguments.no_plots, discs=arguments.discs)
    if arguments.record is not None:
        written = (*written, arguments.record)
    _tell(figures, written)
    crossed = figures["min_clearance_m"] is not None and figures["min_clearance_m"] < 0.0
    return DOCKED if figures["docked"] and not crossed else NOT_DOCKED


def _make_writable(folder: Path) -> None:
    """Before the run, so that it is not driven in vain. Raises OSError."""
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryFile(dir=folder):
        pass


def _simulated(scenario: Scenario, arguments: argparse.Namespace) -> RunResult:
    source = GoalSource(arguments.goal_source)
    with ExitStack() as stack:
        recorder = None
        if arguments.record is not None:
            controller = docking_controller(
                scenario, preset=arguments.preset, method=arguments.method, goal_source=source
            )
            arguments.record.parent.mkdir(parents=True, exist_ok=True)
            recorder = Recorder(controller, arguments.record, dump_failed=arguments.dump_failed)
            stack.enter_context(recorder)
        duration = scenario.simulation.duration
        progress = stack.enter_context(_progress_bar(scenario.name, "{task.completed:.1f} s"))
        return simulate(
            scenario,
            preset=arguments.preset,
            method=arguments.method,
            seed=arguments.seed,
            progress=progress and (lambda time: progress(time, duration)),
            controller=recorder,
            goal_source=source,
        )


def _replay(arguments: argparse.Namespace) -> int:
    with _progress_bar(arguments.file.name, "cycle {task.completed:.0f}") as progress:
        report = replay(
            arguments.file,
            tolerance=arguments.tolerance,
            allow_truncated=arguments.partial,
            dump_failed=arguments.dump_failed,
            progress=progress,
        )
    console = Console(highlight=False)
    for line in replay_lines(report):
        console.print(line, markup=False, soft_wrap=True)
    return IDENTICAL if report.identical else DIFFERENT


@contextmanager
def _progress_bar(name: str, done: str) -> Iterator[Callable[[float, float], None] | None]:
    """On a terminal a bar, told by (done, in all), with `done` as its text; None elsewhere."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield None
        return
    columns = (TextColumn(name), BarColumn(), TextColumn(done), TimeElapsedColumn())
    with Progress(*columns, console=console, transient=True, refresh_per_second=4) as bar:
        task = bar.add_task("", total=None)
        yield lambda completed, total: bar.update(task, completed=completed, total=total)


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
