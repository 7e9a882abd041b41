"""The command `rti-mpcc`: list the built-in scenarios, run, record, replay, watch (contract 3.2)."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from contextlib import ExitStack
from math import isfinite
from pathlib import Path
from typing import Any

from rich.console import Console

from rti_mpcc.errors import InputError, RtiMpccError
from rti_mpcc.recording import Recorder, replay
from rti_mpcc.report.console import progress_bar, tell_run, warnings_on_stderr
from rti_mpcc.report.files import make_writable, write_files
from rti_mpcc.report.film import Film, film_of_recording, film_of_run
from rti_mpcc.report.looks import Onlooker, Seen
from rti_mpcc.report.replay_lines import replay_lines
from rti_mpcc.simulation import (
    Controller,
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
Commands = Any
"""What argparse adds commands to; its own name for it is private."""
_INTERRUPTED = 130
_PROGRAM = "rti-mpcc"


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command with `argv` (default: the process's own) and return the exit status, without exiting.

    0: docked, or identical in replay; 1: not docked, or the body crossed a boundary, or a replay differs;
    2: bad input, told in one message on stderr.
    """
    try:
        arguments = _parser().parse_args(argv)
    except SystemExit as leaving:  # argparse has told what is wrong, or printed the help
        return leaving.code if isinstance(leaving.code, int) else BAD_INPUT
    with warnings_on_stderr(_PROGRAM):
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
    run.add_argument(
        "--animate",
        nargs="?",
        const="",
        metavar="FILE",
        help="write a moving picture, .mp4 or .gif; default: animation.mp4 beside the other files, .gif "
        "where ffmpeg is not installed",
    )
    run.add_argument("--record", type=Path, metavar="FILE", help="record all cycles, for `replay`")
    _add_dump_failed(run)
    run.set_defaults(command=_run)
    _add_replay(commands)
    _add_watch(commands)
    return parser


def _add_replay(commands: Commands) -> None:
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


def _add_watch(commands: Commands) -> None:
    watch = commands.add_parser(
        "watch",
        help="open a window on a run or a recording: play it, look into the solver at any cycle",
        epilog="Keys: space plays and pauses, left and right go by a cycle, up and down by 1 s, page up and "
        "page down by 5 s, home and end to the ends.",
    )
    watch.add_argument(
        "what",
        metavar="RECORDING_OR_SCENARIO",
        help="what `run --record` wrote, name of a built-in scenario, or a .toml file",
    )
    watch.add_argument("--preset", choices=PRESETS, help="of a scenario; default: default")
    watch.add_argument("--seed", type=_seed, metavar="N", help="of a scenario; default: 0")
    watch.set_defaults(
        command=_watch,
        method="dynamic",
        goal_source=GoalSource.DETECTED.value,
        record=None,
        dump_failed=None,
        animate="",
    )


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
    animation = _animation(arguments.animate, folder)
    for place in [folder, *(file.parent for file in animation)]:
        make_writable(place)
    result, seen = _simulated(scenario, arguments)
    figures = summary(result)
    written = write_files(result, figures, folder, plots=not arguments.no_plots, discs=arguments.discs)
    for file in animation:
        _animate(result, seen, file)
    if arguments.record is not None:
        written = (*written, arguments.record)
    written = (*written, *animation)
    tell_run(figures, written)
    crossed = figures["min_clearance_m"] is not None and figures["min_clearance_m"] < 0.0
    return DOCKED if figures["docked"] and not crossed else NOT_DOCKED


def _animation(asked: str | None, folder: Path) -> tuple[Path, ...]:
    """The animation to write, if one is asked for: "" leaves the name open. Raises InputError."""
    if asked is None:
        return ()
    # Not at the top: matplotlib takes longer to load than a run without pictures needs it.
    from rti_mpcc.report.animation import animation_file

    return (animation_file(Path(asked) if asked else None, folder),)


def _animate(result: RunResult, seen: Sequence[Seen], file: Path) -> None:
    from rti_mpcc.report.animation import animate_run

    with progress_bar(file.name, "{task.completed:.1f} s") as progress:
        animate_run(result, seen, file, progress=progress)


def _simulated(scenario: Scenario, arguments: argparse.Namespace) -> tuple[RunResult, Sequence[Seen]]:
    """The run, recorded and looked at if that is asked for, and what was seen."""
    source, duration = GoalSource(arguments.goal_source), scenario.simulation.duration
    with ExitStack() as stack:
        controller: Controller | None = None
        onlooker = None
        if arguments.record is not None or arguments.animate is not None:
            core = docking_controller(
                scenario, preset=arguments.preset, method=arguments.method, goal_source=source
            )
            controller = core
            if arguments.record is not None:
                arguments.record.parent.mkdir(parents=True, exist_ok=True)
                recorder = Recorder(core, arguments.record, dump_failed=arguments.dump_failed)
                controller = stack.enter_context(recorder)
            if arguments.animate is not None:
                controller = onlooker = Onlooker(controller)
        progress = stack.enter_context(progress_bar(scenario.name, "{task.completed:.1f} s"))
        result = simulate(
            scenario,
            preset=arguments.preset,
            method=arguments.method,
            seed=arguments.seed,
            progress=progress and (lambda time: progress(time, duration)),
            controller=controller,
            goal_source=source,
        )
    return result, onlooker.seen if onlooker else ()


def _replay(arguments: argparse.Namespace) -> int:
    with progress_bar(arguments.file.name, "cycle {task.completed:.0f}") as progress:
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


def _watch(arguments: argparse.Namespace) -> int:
    from rti_mpcc.report.viewer import require_window, watch

    require_window()
    watch(_film(arguments))
    return DOCKED


def _film(arguments: argparse.Namespace) -> Film:
    """Of the recording, or of a run of the scenario."""
    file = Path(arguments.what)
    if file.suffix == ".jsonl" or (file.is_file() and file.suffix != ".toml"):
        if arguments.preset is not None or arguments.seed is not None:
            raise InputError(f"{file}: a recording has its own preset and seed, leave them out")
        with progress_bar(file.name, "cycle {task.completed:.0f}") as progress:
            return film_of_recording(file, progress=progress)
    arguments.preset, arguments.seed = arguments.preset or PRESETS[0], arguments.seed or 0
    result, seen = _simulated(load_scenario(arguments.what), arguments)
    return film_of_run(result, seen)


def _refuse(message: str) -> int:
    for line in message.splitlines():
        sys.stderr.write(f"{_PROGRAM}: error: {line}\n")
    return BAD_INPUT
