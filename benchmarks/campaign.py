"""A study of random problems: drive N of them, keep a row of each, report.

    python -m benchmarks.campaign --count N --level nominal|noisy|mismatched|hard --seed S \\
        --out DIR [--scenes] [--ride brisk] [--method M] [--preset P] [--deadline S] [--only I ...] \\
        [--jobs K | --dask ADDRESS] [--worst N]

Writes DIR/rows.jsonl, timed.jsonl, report.json, report.html and the worst cases in DIR/worst. With --only I
these cases are driven alone. Workers of a Dask cluster need this folder on their PYTHONPATH.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import get_args

from benchmarks.problems.case import CampaignCase, Problems
from benchmarks.problems.levels import Level
from benchmarks.tables import command_line, origin
from rti_mpcc.cli import exit_status
from rti_mpcc.cli.arguments import integer
from rti_mpcc.cli.campaign import add_campaign_options, drive_and_report
from rti_mpcc.config import ControllerConfig, Ride
from rti_mpcc.paper import METHODS
from rti_mpcc.simulation.scenario import PRESETS


def parser() -> argparse.ArgumentParser:
    asked = command_line(__doc__, "python -m benchmarks.campaign")
    add_campaign_options(asked)
    levels = "|".join(level.value for level in Level)
    asked.add_argument(
        "--level", type=Level, default=Level.NOMINAL, metavar=levels, help="disturbances; default: nominal"
    )
    asked.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder of the written files")
    asked.add_argument("--scenes", action="store_true", help="problems without a path; default: courses")
    asked.add_argument("--ride", choices=get_args(Ride), help="kind of ride; default: the scenario's own")
    asked.add_argument("--method", choices=METHODS, default="dynamic", help="default: dynamic")
    asked.add_argument("--preset", choices=PRESETS, default="default", help="default: default")
    asked.add_argument(
        "--deadline", type=float, metavar="S", help="deadline of each cycle [s]; default: none"
    )
    asked.add_argument(
        "--only", type=integer(0), nargs="+", metavar="I", help="cases that are driven; default: all"
    )
    asked.set_defaults(command=run)
    return asked


def run(asked: argparse.Namespace) -> int:
    ControllerConfig(deadline=asked.deadline)
    indices = asked.only or range(asked.count)
    problems = Problems.SCENES if asked.scenes else Problems.COURSES
    kind = {"method": asked.method, "preset": asked.preset, "deadline": asked.deadline, "ride": asked.ride}

    cases = [
        CampaignCase(seed=asked.seed, level=asked.level, index=index, problems=problems, **kind)
        for index in indices
    ]
    source = origin("python -m benchmarks.campaign")
    settings = {
        "count": len(cases),
        "level": asked.level.value,
        "seed": asked.seed,
        "problems": problems.value,
        **kind,
        **{name: source[name] for name in ("commit", "changed", "date")},
    }
    return drive_and_report(cases, settings, asked, "campaign")


if __name__ == "__main__":
    sys.exit(exit_status(parser(), None))
