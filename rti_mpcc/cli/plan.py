"""`rti-mpcc plan`: the route of a scenario in an area, without driving it."""

from __future__ import annotations

import argparse
from pathlib import Path

from rti_mpcc import plan_manoeuvre
from rti_mpcc.cli.arguments import FOUND, NOT_FOUND, SCENARIO, Commands
from rti_mpcc.errors import InputError
from rti_mpcc.report.console import tell_lines, tell_tables, tell_written
from rti_mpcc.report.files import make_writable
from rti_mpcc.report.table import plan_table
from rti_mpcc.simulation import load_scenario


def add_to(commands: Commands) -> None:
    """Add the command."""
    plan = commands.add_parser(
        "plan",
        help="plan the route of a scenario in an area, without driving it",
        description="Plan the route of a scenario that gives [start], [area] and a goal pose, and write "
        "route.csv, plan.json and plan.png.",
        epilog="Exit status: 0 a route was found, 1 there is none, 2 bad input.",
    )
    plan.add_argument("scenario", **SCENARIO)
    plan.add_argument("--out", type=Path, metavar="DIR", help="folder of the files; default: runs/<name>")
    plan.set_defaults(command=_plan)


def _plan(arguments: argparse.Namespace) -> int:
    scenario = load_scenario(arguments.scenario)
    if not scenario.in_area:
        needed = "a route is planned only for a scenario with [start], [area] and goal.pose"
        raise InputError(f"{arguments.scenario}: has a [path], which is driven as it is: {needed}")
    area, config = scenario.build_area(), scenario.controller_config()
    goal = scenario.planned_goal()
    assert goal is not None
    # Not at the top: matplotlib takes long to load.
    from rti_mpcc.report.plan import no_route, write_plan

    folder = arguments.out if arguments.out is not None else Path("runs") / scenario.name
    make_writable(folder)
    manoeuvre = plan_manoeuvre(scenario.start_pose(), goal, area, config)
    figures, written = write_plan(scenario.name, manoeuvre, area, config, folder)
    if manoeuvre.found:
        tell_tables([plan_table(scenario.name, figures)])
    else:
        tell_lines([f"{scenario.name}: {line}" for line in no_route(manoeuvre)])
    tell_written(written)
    return FOUND if manoeuvre.found else NOT_FOUND
