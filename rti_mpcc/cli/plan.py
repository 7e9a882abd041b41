"""`rti-mpcc plan` and `rti-mpcc docks`: the route of a scenario, or the docks of a file, without driving."""

from __future__ import annotations

import argparse
from pathlib import Path

from rti_mpcc import plan_manoeuvre
from rti_mpcc.cli.arguments import DONE, FAILED, Commands, add_folder, add_options, writable_folder
from rti_mpcc.errors import InputError
from rti_mpcc.report.text import docks_table, plan_table, print_lines, print_tables, print_written
from rti_mpcc.simulation import load_scenario, read_docks


def add_plan(commands: Commands) -> None:
    """Add `plan`."""
    plan = commands.add_parser(
        "plan",
        help="plan the route of a scenario in an area, without driving it",
        description="Plan the route of a scenario that gives [start], [area] and a goal pose, and write "
        "route.csv, plan.json and plan.png.",
        epilog="Exit status: 0 a route was found, 1 there is none, 2 bad input.",
    )
    add_options(plan, "scenario")
    add_folder(plan, "runs/<name>")
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

    folder = writable_folder(arguments.out, scenario.name)
    manoeuvre = plan_manoeuvre(scenario.start_pose(), goal, area, config)
    figures, written = write_plan(scenario.name, manoeuvre, area, config, folder)
    if manoeuvre.found:
        print_tables([plan_table(scenario.name, figures)])
    else:
        print_lines([f"{scenario.name}: {line}" for line in no_route(manoeuvre)])
    print_written(written)
    return DONE if manoeuvre.found else FAILED


def add_docks(commands: Commands) -> None:
    """Add `docks`."""
    docks = commands.add_parser(
        "docks",
        help="check a file of docks and draw them",
        description="Check a file of docks (TOML), list them, and write docks.png.",
        epilog="Exit status: 0 all can be used, 2 bad input, with a line for each problem.",
    )
    docks.add_argument("file", metavar="FILE", type=Path, help="a .toml file of docks")
    add_folder(docks, "runs/<file>")
    docks.set_defaults(command=_docks)


def _docks(arguments: argparse.Namespace) -> int:
    docks, name = read_docks(arguments.file), arguments.file.name
    picture = writable_folder(arguments.out, arguments.file.stem) / "docks.png"
    # Not at the top: matplotlib takes long to load.
    from rti_mpcc.report import draw
    from rti_mpcc.report.plan import docks_figure

    draw.save(docks_figure(name, docks), picture)
    print_tables([docks_table(name, docks)])
    print_written([picture])
    return DONE
