"""`rti-mpcc compare`: scenarios by several methods and presets, side by side."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path

from rti_mpcc.cli.arguments import (
    DONE,
    OPTIONS,
    Commands,
    add_folder,
    add_options,
    writable_folder,
)
from rti_mpcc.errors import InputError
from rti_mpcc.paper import METHODS
from rti_mpcc.report.files import write_json
from rti_mpcc.report.ride import Observer, Ride, ride_of_run
from rti_mpcc.report.text import (
    compared,
    comparison_tables,
    progress_bar,
    run_label,
    tell_tables,
    tell_written,
)
from rti_mpcc.simulation import docking_controller, load_scenario
from rti_mpcc.simulation.batch import Case, DrivenCase, drive, drive_all
from rti_mpcc.simulation.scenario import PRESETS, Scenario


def add_compare(commands: Commands) -> None:
    """Add `compare`."""
    parser = commands.add_parser(
        "compare",
        help="run scenarios by several methods and presets, print their figures side by side",
        description="Run each scenario by each method and preset, print the figures of the paper's Tables II "
        "and III and some more side by side, and write all to DIR/comparison.json.",
        # SCENARIO first: after --methods it would be taken for one.
        usage="%(prog)s [-h] SCENARIO [SCENARIO ...] [--methods METHOD ...] [--presets PRESET ...]\n"
        "                        [--seed N] [--out DIR] [--jobs K] [--animate]",
        epilog="By default the paper's three methods, default preset; ratios are to the first method and "
        "preset named. With several jobs the cycle times are longer. Exit status: 0 all ran, 2 bad input.",
    )
    parser.add_argument("scenarios", nargs="+", **OPTIONS["scenario"])
    several = {"nargs": "+", "metavar": "NAME"}
    usual, one = ["dynamic", "separated", "switched"], ["default"]
    names = ", ".join(METHODS)
    parser.add_argument("--methods", choices=METHODS, default=usual, help=f"some of {names}", **several)
    names = ", ".join(PRESETS)
    parser.add_argument("--presets", choices=PRESETS, default=one, help=f"some of {names}", **several)
    add_options(parser, "--seed", "--jobs")
    add_folder(parser, "runs/compare")
    animated = "also animate each scenario's runs side by side, run one by one"
    parser.add_argument("--animate", action="store_true", help=animated)
    parser.set_defaults(command=_compare)


def _compare(arguments: argparse.Namespace) -> int:
    cases = [
        Case(scenario=scenario, method=method, preset=preset, seed=arguments.seed)
        for scenario in _scenarios(arguments.scenarios)
        for preset in dict.fromkeys(arguments.presets)
        for method in dict.fromkeys(arguments.methods)
    ]
    folder = writable_folder(arguments.out, "compare")
    written: list[Path] = []
    with progress_bar("compare", "{task.completed:.0f} runs") as progress:
        if arguments.animate:
            outcomes, written = _animated(cases, folder, progress)
        else:
            outcomes = drive_all(cases, jobs=arguments.jobs, progress=progress)
    figures = compared([outcome.figures for outcome in outcomes])
    file = folder / "comparison.json"
    write_json(figures, file)
    tell_tables(comparison_tables(figures))
    tell_written([file, *written])
    return DONE


def _scenarios(asked: Sequence[str]) -> list[Scenario]:
    """Raises InputError for two of the same name: their runs could not be told apart."""
    found: dict[str, tuple[str, Scenario]] = {}
    for one in dict.fromkeys(asked):
        scenario = load_scenario(one)
        other, _ = found.setdefault(scenario.name, (one, scenario))
        if other != one:
            raise InputError(f"{other} and {one} have the same name, {scenario.name!r}: give each its own")
    return [scenario for _, scenario in found.values()]


def _animated(
    cases: Sequence[Case], folder: Path, progress: Callable[[int, int], None] | None
) -> tuple[list[DrivenCase], list[Path]]:
    # Not at the top: matplotlib takes longer to load than a comparison without pictures needs it.
    from rti_mpcc.report.animation import animation_file, write_animation

    outcomes: list[DrivenCase] = []
    rides: dict[str, list[Ride]] = {}
    for case in cases:
        observer = Observer(docking_controller(case.scenario, preset=case.preset, method=case.method))
        outcome = drive(case, observer)
        outcomes.append(outcome)
        ride = ride_of_run(outcome.result, observer.moments, title=run_label(outcome.figures))
        rides.setdefault(case.scenario.name, []).append(ride)
        if progress is not None:
            progress(len(outcomes), len(cases))
    files = {name: animation_file(None, folder).with_stem(name) for name in rides}
    for name, file in files.items():
        write_animation(rides[name], file)
    return outcomes, list(files.values())
