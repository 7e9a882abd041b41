"""`rti-mpcc replay` and `rti-mpcc watch`: a recording compared, or in a window."""

from __future__ import annotations

import argparse
from pathlib import Path

from rti_mpcc.cli.arguments import (
    DONE,
    FAILED,
    Commands,
    add_options,
    tolerance,
)
from rti_mpcc.cli.run import simulated
from rti_mpcc.errors import InputError
from rti_mpcc.recording import replay
from rti_mpcc.report.ride import Ride, ride_of_recording
from rti_mpcc.report.text import progress_bar, replay_lines, tell_lines
from rti_mpcc.simulation import GoalSource, load_scenario

_OF_SCENARIO = {"method": "dynamic", "preset": "default", "seed": 0}


def add_replay(commands: Commands) -> None:
    """Add `replay`."""
    parser = commands.add_parser(
        "replay",
        help="run the controller on a recording and compare",
        description="Drive the controller with the inputs of a recording, and print the first cycle that "
        "differs from the recorded one.",
        epilog="Exit status: 0 identical, 1 a difference, 2 bad input.",
    )
    parser.add_argument("file", metavar="FILE", type=Path, help="file of `run --record`")
    usual = "tolerated difference; 0: bit for bit; "
    usual += "default: 0 on the machine and versions of the recording, 1e-9 elsewhere"
    parser.add_argument("--tolerance", type=tolerance, metavar="X", help=usual)
    whole = "replay the whole cycles of a truncated recording"
    parser.add_argument("--partial", action="store_true", help=whole)
    add_options(parser, "--dump-failed")
    parser.set_defaults(command=_replay)


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
    return DONE if report.identical else FAILED


def add_watch(commands: Commands) -> None:
    """Add `watch`."""
    parser = commands.add_parser(
        "watch",
        help="open a window on a run or a recording, with a time slider",
        description="Open a window on a run, which is simulated first, or on a recording: the plane and the "
        "plan at the time of a slider, and speed, steering, acceleration and progress over time.",
    )
    what = "file of `run --record`, name of a built-in scenario, or a .toml file"
    parser.add_argument("what", metavar="RECORDING_OR_SCENARIO", help=what)
    add_options(parser, "--method", "--preset", "--seed")
    unset = dict.fromkeys(_OF_SCENARIO)  # a recording has its own
    usual = {"goal_source": GoalSource.DETECTED.value, "record": None, "animate": ""}
    parser.set_defaults(command=_watch, **usual, **unset)


def _watch(arguments: argparse.Namespace) -> int:
    from rti_mpcc.report.scene import open_window, watch

    watch(open_window(), _ride(arguments))
    return DONE


def _ride(arguments: argparse.Namespace) -> Ride:
    file, given = Path(arguments.what), vars(arguments)
    if file.suffix == ".jsonl" or (file.is_file() and file.suffix != ".toml"):
        if any(given[name] is not None for name in _OF_SCENARIO):
            raise InputError(f"{file}: a recording has its own method, preset and seed, leave them out")
        with progress_bar(file.name, "cycle {task.completed:.0f}") as progress:
            return ride_of_recording(file, progress=progress)
    options = {name: usual if given[name] is None else given[name] for name, usual in _OF_SCENARIO.items()}
    return simulated(load_scenario(arguments.what), argparse.Namespace(**given | options))[1]
