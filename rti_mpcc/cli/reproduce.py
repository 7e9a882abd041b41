"""`rti-mpcc reproduce`: the experiments of the paper, driven again, as a page with figures and tables."""

from __future__ import annotations

import argparse
from itertools import islice
from pathlib import Path

from rti_mpcc.cli.arguments import Commands, at_least_one, seed
from rti_mpcc.report.console import progress_bar, tell_lines, tell_written
from rti_mpcc.report.files import make_writable
from rti_mpcc.report.reproduction.runs import COURSE_SEED, Runs, comfort_cases, course_cases, experiment_cases
from rti_mpcc.simulation.batch import drive_all

REPRODUCED = 0
"""Exit status."""


def add_to(commands: Commands) -> None:
    """Add the command."""
    parser = commands.add_parser(
        "reproduce",
        help="drive the paper's experiments again, write a report beside the published figures",
        description="Drive the paper's experiments again, each by the paper's methods and by preset "
        "default, and write one page with all figures and tables: what is published, what the published "
        "code does, and what is measured here.",
        epilog="The CARLA docking mission is not in it. Exit status: 0 all ran, 2 bad input.",
    )
    parser.add_argument(
        "--out",
        type=Path,
        default=Path("runs/reproduce"),
        metavar="DIR",
        help="where reproduce.html, reproduce.json and the pictures go; default: %(default)s",
    )
    parser.add_argument(
        "--courses",
        type=seed,
        default=24,
        metavar="N",
        help=f"so many courses drawn from seed {COURSE_SEED} besides, each with preset default and paper, "
        "0 for none; default: %(default)s",
    )
    parser.add_argument("--jobs", type=at_least_one, metavar="K", help="runs at a time; default: one a core")
    parser.set_defaults(command=_reproduce)


def _reproduce(arguments: argparse.Namespace) -> int:
    make_writable(arguments.out)
    experiments, comforts = experiment_cases(), comfort_cases()
    with progress_bar("reproduce", "{task.completed:.0f} runs") as progress:
        courses = course_cases(arguments.courses)
        cases = [*experiments, *comforts, *courses]
        driven = iter(drive_all(cases, jobs=arguments.jobs, progress=progress))
    # Not at the top: matplotlib takes longer to load than a refusal needs.
    from rti_mpcc.report.reproduction.report import write_report

    runs = Runs(
        experiments=list(islice(driven, len(experiments))),
        comforts=list(islice(driven, len(comforts))),
        courses=list(driven),
    )
    report = write_report(runs, arguments.out)
    tell_lines(report.told)
    tell_written(report.files)
    return REPRODUCED
