"""`rti-mpcc compare` and `rti-mpcc campaign`: scenarios side by side, and random variations of one."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.markup import escape
from rich.table import Table

from rti_mpcc.cli.arguments import DONE, OPTIONS, Commands, add_folder, add_options, integer, writable_folder
from rti_mpcc.errors import InputError
from rti_mpcc.kernels import make_ready
from rti_mpcc.paper import METHODS
from rti_mpcc.report import text
from rti_mpcc.report.files import write_json
from rti_mpcc.report.ride import Observer, Ride, ride_of_run
from rti_mpcc.simulation import driver_of, load_scenario
from rti_mpcc.simulation.batch import Case, DrivenCase, drive, drive_all
from rti_mpcc.simulation.campaign import MOST, ROWS, RandomCase, run_campaign
from rti_mpcc.simulation.scenario import PRESETS, Scenario
from rti_mpcc.simulation.variation import PARTS, VariedCase


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
    for name, choices, usual in (
        ("--methods", METHODS, ["dynamic", "separated", "switched"]),
        ("--presets", PRESETS, ["default"]),
    ):
        some = f"some of {', '.join(choices)}"
        parser.add_argument(name, choices=choices, default=usual, help=some, nargs="+", metavar="NAME")
    add_options(parser, "--seed", "--jobs")
    add_folder(parser, "runs/compare")
    animated = "also animate each scenario's runs side by side, run one by one"
    parser.add_argument("--animate", action="store_true", help=animated)
    parser.set_defaults(command=_compare)


def _compare(args: argparse.Namespace) -> int:
    scenarios: dict[str, tuple[str, Scenario]] = {}
    for given in dict.fromkeys(args.scenarios):
        scenario = load_scenario(given)
        other, _ = scenarios.setdefault(scenario.name, (given, scenario))
        if other != given:  # their runs could not be told apart
            raise InputError(f"{other} and {given} have the same name, {scenario.name!r}: give each its own")
    cases = [
        Case(scenario=scenario, method=method, preset=preset, seed=args.seed)
        for _, scenario in scenarios.values()
        for preset in dict.fromkeys(args.presets)
        for method in dict.fromkeys(args.methods)
    ]
    folder = writable_folder(args.out, "compare")
    make_ready(second_process=True)  # before the workers, each of which would compile
    written: list[Path] = []
    with text.progress_bar("compare", "{task.completed:.0f} runs") as progress:
        if args.animate:
            outcomes, written = _animated(cases, folder, progress)
        else:
            outcomes = drive_all(cases, jobs=args.jobs, progress=progress)
    figures = text.compared([outcome.figures for outcome in outcomes])
    file = folder / "comparison.json"
    write_json(figures, file)
    text.print_tables(text.comparison_tables(figures))
    text.print_written([file, *written])
    return DONE


def _animated(
    cases: Sequence[Case], folder: Path, progress: Callable[[int, int], None] | None
) -> tuple[list[DrivenCase], list[Path]]:
    # Not at the top: matplotlib takes longer to load than a comparison without pictures needs it.
    from rti_mpcc.report.animation import animation_file, write_animation

    outcomes: list[DrivenCase] = []
    rides: dict[Path, list[Ride]] = {}
    for case in cases:
        observer = Observer(driver_of(case.scenario, preset=case.preset, method=case.method))
        outcomes.append(drive(case, observer))
        ride = ride_of_run(outcomes[-1].result, observer.moments, title=text.run_label(outcomes[-1].figures))
        rides.setdefault(animation_file(None, folder).with_stem(case.scenario.name), []).append(ride)
        if progress is not None:
            progress(len(outcomes), len(cases))
    for file, some in rides.items():
        write_animation(some, file)
    return outcomes, list(rides)


def add_campaign(commands: Commands) -> None:
    """Add `campaign`."""
    parser = commands.add_parser(
        "campaign",
        help="drive random variations of a scenario, say how often it docks",
        description="Drive N random variations of a scenario: keep a row of each in DIR/rows.jsonl, write "
        "DIR/report.json and DIR/report.html, and save the worst cases as scenario files in DIR/worst.",
        epilog="Exit status: 0 all cases were driven, with any outcome, 2 bad input or a lost cluster.",
    )
    add_options(parser, "scenario")
    parts = f"parts that vary, some of {','.join(PARTS)}; default: all of them"
    parser.add_argument("--vary", type=_parts, default=PARTS, metavar="PARTS", help=parts)
    add_campaign_options(parser)
    add_folder(parser, "runs/campaign-<name>")
    parser.set_defaults(command=_campaign)


def add_campaign_options(parser: argparse.ArgumentParser) -> None:
    """How many cases of which seed, and the workers."""
    parser.add_argument("--count", type=integer(1), required=True, metavar="N", help="number of cases")
    add_options(parser, "--seed")
    workers = parser.add_mutually_exclusive_group()
    workers.add_argument("--jobs", **OPTIONS["--jobs"])
    address = "address of a Dask cluster's scheduler, such as tcp://host:8786; needs the extra `cluster`"
    workers.add_argument("--dask", metavar="ADDRESS", help=address)
    worst = "number of worst cases that are saved; default: 6"
    parser.add_argument("--worst", type=integer(0), default=6, metavar="N", help=worst)


def _parts(given: str) -> tuple[str, ...]:
    parts = tuple(given.split(","))
    if wrong := [part for part in parts if part not in PARTS]:
        raise argparse.ArgumentTypeError(f"unknown {wrong[0]!r}; must be some of {','.join(PARTS)}")
    return parts


def _campaign(args: argparse.Namespace) -> int:
    base = load_scenario(args.scenario)
    drawn = {"vary": args.vary, "seed": args.seed}
    cases = [VariedCase(base=base, index=index, **drawn) for index in range(args.count)]
    settings = {"scenario": args.scenario, "count": args.count, **drawn}
    cases[0].scenario()  # what can't be varied is refused before anything is driven
    return drive_and_report(cases, settings, args, f"campaign-{base.name}")


def drive_and_report(
    cases: Sequence[RandomCase], settings: Mapping[str, Any], args: argparse.Namespace, name: str
) -> int:
    """Drive the cases by the options of `add_campaign_options`, write to --out or runs/<name>, and print."""
    # Not at the top: pandas, matplotlib and scipy.stats take longer to load than other commands need.
    from rti_mpcc.report.campaign import write_report

    if len(cases) > MOST:
        raise InputError(f"count = {len(cases)}: must be <= {MOST}")
    folder = writable_folder(args.out, name)
    make_ready(second_process=True)
    with text.progress_bar("campaign", "{task.completed:.0f} cases") as progress:
        run_campaign(cases, folder, jobs=args.jobs, dask=args.dask, progress=progress)
    table, files = write_report(folder, settings, cases, worst=args.worst)
    console = Table("", "value", title=f"Campaign {folder}", title_justify="left")
    for name, value in table.items():
        console.add_row(escape(name), value)
    text.print_tables([console])
    text.print_written([folder / ROWS, *files])
    return DONE
