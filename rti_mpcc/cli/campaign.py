"""`rti-mpcc campaign`: many drawn docking problems, on this machine's cores or on a Dask cluster."""

from __future__ import annotations

import argparse
from pathlib import Path

from rti_mpcc.cli.arguments import DONE, Commands, at_least_one, seed
from rti_mpcc.errors import CampaignError
from rti_mpcc.paper import METHODS
from rti_mpcc.report.campaign_tally import tally_table
from rti_mpcc.report.console import rate_bar, tell_lines, tell_tables, tell_written
from rti_mpcc.report.files import make_writable
from rti_mpcc.simulation.campaign import (
    CampaignSettings,
    Engine,
    Level,
    Problems,
    ProcessEngine,
    run_campaign,
)
from rti_mpcc.simulation.campaign.rows_file import FILE as ROWS
from rti_mpcc.simulation.campaign.settings import FILE as SETTINGS
from rti_mpcc.simulation.scenario import PRESETS


def add_to(commands: Commands) -> None:
    """Add the command."""
    parser = commands.add_parser(
        "campaign",
        help="draw and drive many docking problems, keep a row of each",
        description="Draw and drive docking problems 0 to N - 1 of a seed and level, and keep a row of each "
        "in DIR/rows.jsonl. A campaign that was interrupted or killed is gone on with by the same command, "
        "also with a larger --count.",
        epilog="Exit status: 0 all were driven, whatever became of them, 2 bad input.",
    )
    parser.add_argument(
        "--count", type=at_least_one, required=True, metavar="N", help="so many problems in all"
    )
    add_level(parser)
    parser.add_argument(
        "--seed", type=seed, default=0, metavar="S", help="of all that is drawn; default: %(default)s"
    )
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="where the rows go")
    workers = parser.add_mutually_exclusive_group()
    workers.add_argument(
        "--jobs", type=at_least_one, metavar="K", help="so many processes; default: one a core"
    )
    workers.add_argument(
        "--dask",
        metavar="ADDRESS",
        help="of the scheduler of a Dask cluster, such as tcp://host:8786; needs the extra `cluster`",
    )
    parser.add_argument("--method", choices=METHODS, default="dynamic", help="default: %(default)s")
    parser.add_argument("--preset", choices=PRESETS, default="default", help="default: %(default)s")
    add_problems(parser)
    parser.set_defaults(command=_campaign)


def add_level(parser: argparse.ArgumentParser) -> None:
    """`--level LEVEL`."""
    parser.add_argument(
        "--level",
        choices=[level.value for level in Level],
        default=Level.NOMINAL.value,
        help="what disturbs the vehicle: nothing, noise, a plant that is not the model, all of it; "
        "default: %(default)s",
    )


def add_problems(parser: argparse.ArgumentParser) -> None:
    """`--scenes` and `--deadline S`."""
    parser.add_argument(
        "--scenes",
        dest="problems",
        action="store_const",
        const=Problems.SCENES,
        default=Problems.COURSES,
        help="problems without a path: a start, a goal and what stands there; default: courses, with a path",
    )
    parser.add_argument(
        "--deadline", type=float, metavar="S", help="of each cycle of the controllers [s]; default: none"
    )


def _campaign(arguments: argparse.Namespace) -> int:
    settings = CampaignSettings(
        count=arguments.count,
        level=Level(arguments.level),
        seed=arguments.seed,
        method=arguments.method,
        preset=arguments.preset,
        problems=arguments.problems,
        deadline=arguments.deadline,
    )
    engine = _engine(arguments)
    folder: Path = arguments.out
    make_writable(folder)
    try:
        with rate_bar("campaign", "cases") as progress:
            tally = run_campaign(settings, folder, engine=engine, progress=progress)
    except (KeyboardInterrupt, CampaignError):
        tell_lines([f"The rows so far are kept in {folder}; the same command goes on behind them."])
        raise
    tell_tables([tally_table(settings, tally)])
    tell_written([folder / SETTINGS, folder / ROWS])
    return DONE


def _engine(arguments: argparse.Namespace) -> Engine:
    if arguments.dask is None:
        return ProcessEngine(arguments.jobs)
    # Not at the top: only a cluster needs it.
    from rti_mpcc.simulation.campaign.cluster import DaskEngine

    return DaskEngine(arguments.dask)
