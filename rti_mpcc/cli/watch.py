"""`rti-mpcc watch`: a window on a run or a recording."""

from __future__ import annotations

import argparse
from pathlib import Path

from rti_mpcc.cli.arguments import DOCKED, Commands, seed
from rti_mpcc.cli.run import simulated
from rti_mpcc.errors import InputError
from rti_mpcc.paper import METHODS
from rti_mpcc.report.console import progress_bar
from rti_mpcc.report.film import Film, film_of_recording, film_of_run
from rti_mpcc.simulation import GoalSource, load_scenario
from rti_mpcc.simulation.scenario import PRESETS


def add_to(commands: Commands) -> None:
    """Add the command."""
    watch = commands.add_parser(
        "watch",
        help="open a window on a run or a recording: play it, look into the solver at any cycle",
        description="Open a window on a run, which is simulated first, or on a recording: play it, and "
        "look into the solver at any cycle.",
        epilog="Keys: space plays and pauses, left and right go by a cycle, up and down by 1 s, page up and "
        "page down by 5 s, home and end to the ends.",
    )
    watch.add_argument(
        "what",
        metavar="RECORDING_OR_SCENARIO",
        help="what `run --record` wrote, name of a built-in scenario, or a .toml file",
    )
    watch.add_argument("--method", choices=METHODS, help="of a scenario; default: dynamic")
    watch.add_argument("--preset", choices=PRESETS, help="of a scenario; default: default")
    watch.add_argument("--seed", type=seed, metavar="N", help="of a scenario; default: 0")
    watch.set_defaults(
        command=_watch,
        goal_source=GoalSource.DETECTED.value,
        record=None,
        dump_failed=None,
        animate="",
    )


def _watch(arguments: argparse.Namespace) -> int:
    from rti_mpcc.report.viewer import require_window, watch

    require_window()
    watch(_film(arguments))
    return DOCKED


def _film(arguments: argparse.Namespace) -> Film:
    """Of the recording, or of a run of the scenario."""
    file = Path(arguments.what)
    if file.suffix == ".jsonl" or (file.is_file() and file.suffix != ".toml"):
        if any(given is not None for given in (arguments.method, arguments.preset, arguments.seed)):
            raise InputError(f"{file}: a recording has its own method, preset and seed, leave them out")
        with progress_bar(file.name, "cycle {task.completed:.0f}") as progress:
            return film_of_recording(file, progress=progress)
    arguments.method = arguments.method or "dynamic"
    arguments.preset, arguments.seed = arguments.preset or PRESETS[0], arguments.seed or 0
    run = simulated(load_scenario(arguments.what), arguments)
    return film_of_run(run.result, run.observed)
