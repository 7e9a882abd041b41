"""`rti-mpcc watch`: a window on a run or a recording."""

from __future__ import annotations

import argparse
from pathlib import Path

from rti_mpcc.cli.arguments import DOCKED, Commands, add_method_and_preset, add_seed
from rti_mpcc.cli.run import simulated
from rti_mpcc.errors import InputError
from rti_mpcc.report.console import progress_bar
from rti_mpcc.report.ride import Ride, ride_of_recording
from rti_mpcc.simulation import GoalSource, load_scenario

_OF_SCENARIO = {"method": "dynamic", "preset": "default", "seed": 0}


def add_to(commands: Commands) -> None:
    """Add the command."""
    watch = commands.add_parser(
        "watch",
        help="open a window on a run or a recording, with a time slider",
        description="Open a window on a run, which is simulated first, or on a recording: the plane and the "
        "plan at the time of a slider, and speed, steering, acceleration and progress over time.",
    )
    what = "file of `run --record`, name of a built-in scenario, or a .toml file"
    watch.add_argument("what", metavar="RECORDING_OR_SCENARIO", help=what)
    add_method_and_preset(watch)
    add_seed(watch)
    unset = dict.fromkeys(_OF_SCENARIO)  # a recording has its own
    usual = {"goal_source": GoalSource.DETECTED.value, "record": None, "animate": ""}
    watch.set_defaults(command=_watch, **usual, **unset)


def _watch(arguments: argparse.Namespace) -> int:
    from rti_mpcc.report.viewer import open_window, watch

    watch(open_window(), _ride(arguments))
    return DOCKED


def _ride(arguments: argparse.Namespace) -> Ride:
    """Of the recording, or of a run of the scenario."""
    file, given = Path(arguments.what), vars(arguments)
    if file.suffix == ".jsonl" or (file.is_file() and file.suffix != ".toml"):
        if any(given[name] is not None for name in _OF_SCENARIO):
            raise InputError(f"{file}: a recording has its own method, preset and seed, leave them out")
        with progress_bar(file.name, "cycle {task.completed:.0f}") as progress:
            return ride_of_recording(file, progress=progress)
    options = {name: usual if given[name] is None else given[name] for name, usual in _OF_SCENARIO.items()}
    return simulated(load_scenario(arguments.what), argparse.Namespace(**given | options))[1]
