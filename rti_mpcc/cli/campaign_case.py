"""`rti-mpcc campaign-case`: one case of a campaign as a scenario file, and run like one."""

from __future__ import annotations

import argparse
from pathlib import Path

from rti_mpcc.cli.arguments import DOCKED, Commands, seed
from rti_mpcc.cli.campaign import add_level, add_problems
from rti_mpcc.cli.run import add_run_options, run_scenario
from rti_mpcc.report.console import tell_lines, tell_written
from rti_mpcc.simulation import save_scenario
from rti_mpcc.simulation.campaign import CampaignCase, Level


def add_to(commands: Commands) -> None:
    """Add the command."""
    parser = commands.add_parser(
        "campaign-case",
        help="write one case of a campaign as a scenario file, and run it",
        description="Draw problem I of a seed and level, write it to DIR/<name>.toml, and run it as `run` "
        "does with that file.",
        epilog="Exit status: 0 docked, or only written; 1 not docked or a boundary was crossed, 2 bad input.",
    )
    add_level(parser)
    parser.add_argument(
        "--seed", type=seed, default=0, metavar="S", help="of the campaign; default: %(default)s"
    )
    parser.add_argument("--index", type=seed, required=True, metavar="I", help="of the case")
    parser.add_argument("--no-run", action="store_true", help="write the scenario file only")
    add_problems(parser)
    add_run_options(parser)
    parser.set_defaults(command=_campaign_case)


def _campaign_case(arguments: argparse.Namespace) -> int:
    case = CampaignCase(
        seed=arguments.seed,
        level=Level(arguments.level),
        index=arguments.index,
        method=arguments.method,
        preset=arguments.preset,
        problems=arguments.problems,
        deadline=arguments.deadline,
    )
    folder = Path("runs") / case.name if arguments.out is None else arguments.out
    scenario = case.scenario()
    file = save_scenario(scenario, folder)
    tell_written([file])
    options = f"--method {case.method} --preset {case.preset} --seed {case.run_seed}"
    tell_lines([f"The same run from the file: rti-mpcc run {file} {options}"])
    if arguments.no_run:
        return DOCKED
    return run_scenario(scenario, argparse.Namespace(**{**vars(arguments), "seed": case.run_seed}))
