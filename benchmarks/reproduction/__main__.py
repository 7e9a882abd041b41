"""`make reproduce`: the experiments of the paper, driven again, as a page with figures and tables."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from benchmarks.reproduction.runs import COURSE_SEED, Cases, Runs
from rti_mpcc.cli import exit_status
from rti_mpcc.cli.arguments import add_options, integer
from rti_mpcc.report.files import make_writable
from rti_mpcc.report.text import print_lines, print_written, progress_bar

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
    reproduce(Cases.of(arguments.courses), arguments.out, arguments.jobs)
    return REPRODUCED


def reproduce(cases: Cases, folder: Path, jobs: int | None) -> None:
    """Drive the cases in so many processes, write their report, and print what came out."""
    with progress_bar("reproduce", "{task.completed:.0f} runs") as progress:
        runs = Runs.driven(cases, jobs, progress)
    # Not at the top: matplotlib takes longer to load than a refusal needs.
    from benchmarks.reproduction.report import write_report

    report = write_report(runs, folder)
    print_lines(report.told)
    print_written(report.files)


if __name__ == "__main__":
    sys.exit(main())
