"""`make reproduce`: the experiments of the paper, driven again, as a page with figures and tables."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from itertools import islice
from pathlib import Path

from benchmarks.reproduction.runs import (
    COURSE_SEED,
    Runs,
    comfort_cases,
    course_cases,
    experiment_cases,
    mission_case,
)
from rti_mpcc.cli import exit_status
from rti_mpcc.cli.arguments import add_options, integer
from rti_mpcc.report.files import make_writable
from rti_mpcc.report.text import print_lines, print_written, progress_bar
from rti_mpcc.simulation.batch import drive_all

REPRODUCED = 0
"""Exit status."""


def main(argv: Sequence[str] | None = None) -> int:
    """Drive the experiments and write the report; returns the exit status."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.reproduction",
        description="Drive the paper's experiments again, each by the paper's methods and by preset "
        "default, and write one page with all figures and tables: what is published, what the published "
        "code does, and what is measured here.",
        epilog="The docking mission needs OpenCV. Exit status: 0 all ran, 2 bad input.",
    )
    parser.add_argument(
        "--out",
        type=Path,
        default=Path("runs/reproduce"),
        metavar="DIR",
        help="folder of reproduce.html, reproduce.json and the pictures; default: %(default)s",
    )
    parser.add_argument(
        "--courses",
        type=integer(0),
        default=24,
        metavar="N",
        help=f"number of random courses of seed {COURSE_SEED}, each with presets default and paper, "
        "0 for none; default: %(default)s",
    )
    add_options(parser, "--jobs")
    parser.set_defaults(command=_reproduce)
    return exit_status(parser, argv)


def _reproduce(arguments: argparse.Namespace) -> int:
    make_writable(arguments.out)
    experiments, comforts = experiment_cases(), comfort_cases()
    with progress_bar("reproduce", "{task.completed:.0f} runs") as progress:
        courses = course_cases(arguments.courses)
        cases = [*experiments, *comforts, mission_case(), *courses]
        driven = iter(drive_all(cases, jobs=arguments.jobs, progress=progress))
    # Not at the top: matplotlib takes longer to load than a refusal needs.
    from benchmarks.reproduction.report import write_report

    runs = Runs(
        experiments=list(islice(driven, len(experiments))),
        comforts=list(islice(driven, len(comforts))),
        mission=next(driven),
        courses=list(driven),
    )
    report = write_report(runs, arguments.out)
    print_lines(report.told)
    print_written(report.files)
    return REPRODUCED


if __name__ == "__main__":
    sys.exit(main())
