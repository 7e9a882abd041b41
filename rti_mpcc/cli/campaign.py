"""`rti-mpcc campaign`: how often a scenario docks when its start, goal, noise and plant vary."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from typing import Any

from rich.markup import escape
from rich.table import Table

from rti_mpcc.cli.arguments import (
    DONE,
    OPTIONS,
    Commands,
    add_folder,
    add_options,
    at_least_one,
    non_negative,
    writable_folder,
)
from rti_mpcc.errors import InputError
from rti_mpcc.report.text import progress_bar, tell_tables, tell_written
from rti_mpcc.simulation import load_scenario
from rti_mpcc.simulation.campaign import MOST, ROWS, DrawnCase, run_campaign
from rti_mpcc.simulation.variation import PARTS, VariedCase


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
    parser.add_argument("--count", type=at_least_one, required=True, metavar="N", help="number of cases")
    told = "random seed for all random values; default: 0"
    parser.add_argument("--seed", type=non_negative, default=0, metavar="S", help=told)
    workers = parser.add_mutually_exclusive_group()
    workers.add_argument("--jobs", **OPTIONS["--jobs"])
    told = "address of a Dask cluster's scheduler, such as tcp://host:8786; needs the extra `cluster`"
    workers.add_argument("--dask", metavar="ADDRESS", help=told)
    told = "number of worst cases that are saved; default: 6"
    parser.add_argument("--worst", type=non_negative, default=6, metavar="N", help=told)


def drive_and_report(
    cases: Sequence[DrawnCase], settings: Mapping[str, Any], asked: argparse.Namespace, name: str
) -> int:
    """Drive the cases by the options of `add_campaign_options`, write to --out or runs/<name>, and print."""
    # Not at the top: pandas, matplotlib and scipy.stats take longer to load than other commands need.
    from rti_mpcc.report.campaign import write_report

    if len(cases) > MOST:
        raise InputError(f"count = {len(cases)}: must be <= {MOST}")
    folder = writable_folder(asked.out, name)
    with progress_bar("campaign", "{task.completed:.0f} cases") as progress:
        run_campaign(cases, folder, jobs=asked.jobs, dask=asked.dask, progress=progress)
    table, files = write_report(folder, settings, cases, worst=asked.worst)
    console = Table("", "value", title=f"Campaign {folder}", title_justify="left")
    for name, value in table.items():
        console.add_row(escape(name), value)
    tell_tables([console])
    tell_written([folder / ROWS, *files])
    return DONE


def _campaign(asked: argparse.Namespace) -> int:
    base = load_scenario(asked.scenario)
    drawn = {"vary": asked.vary, "seed": asked.seed}
    cases = [VariedCase(base=base, index=index, **drawn) for index in range(asked.count)]
    settings = {"scenario": asked.scenario, "count": asked.count, **drawn}
    cases[0].scenario()  # what can't be varied is refused before anything is driven
    return drive_and_report(cases, settings, asked, f"campaign-{base.name}")


def _parts(text: str) -> tuple[str, ...]:
    parts = tuple(text.split(","))
    if wrong := [part for part in parts if part not in PARTS]:
        raise argparse.ArgumentTypeError(f"unknown {wrong[0]!r}; must be some of {','.join(PARTS)}")
    return parts
