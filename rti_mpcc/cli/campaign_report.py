"""`rti-mpcc campaign-report`: what a campaign came to, as a page and numbers."""

from __future__ import annotations

import argparse
from pathlib import Path

from rti_mpcc.cli.arguments import DONE, Commands, seed
from rti_mpcc.report.console import progress_bar, tell_lines, tell_tables, tell_written
from rti_mpcc.report.files import make_writable


def add_to(commands: Commands) -> None:
    """Add the command."""
    parser = commands.add_parser(
        "campaign-report",
        help="report on a campaign: how often it docked, against difficulty, its worst cases",
        description="Report on the rows of a campaign, finished or not: success rate with its interval, "
        "collisions, times, clearance, solver failures, all against what makes cases hard, and the worst "
        "cases, driven again, with pictures. Writes DIR/report.html and DIR/report.json.",
        epilog="Exit status: 0 written, 2 bad input.",
    )
    parser.add_argument("folder", type=Path, metavar="DIR", help="of the campaign")
    parser.add_argument(
        "--against",
        type=Path,
        metavar="DIR2",
        help="another campaign of the same seed, to compare with case by case: ratios are DIR / DIR2",
    )
    parser.add_argument(
        "--worst",
        type=seed,
        default=10,
        metavar="N",
        help="so many of the worst cases are driven again and shown, 0 for none; default: %(default)s",
    )
    parser.set_defaults(command=_report)


def _report(arguments: argparse.Namespace) -> int:
    # Not at the top: matplotlib and scipy.stats take longer to load than other commands need.
    from rti_mpcc.report.campaign.pairs import paired
    from rti_mpcc.report.campaign.report import write_report
    from rti_mpcc.report.campaign.rows import read_campaign

    campaign = read_campaign(arguments.folder)
    pairs = None
    if arguments.against is not None:
        pairs = paired(campaign, read_campaign(arguments.against))
    make_writable(arguments.folder)
    with progress_bar("worst cases", "{task.completed:.0f} driven again") as progress:
        report = write_report(
            campaign, arguments.folder, pairs=pairs, worst=arguments.worst, progress=progress
        )
    tell_tables([report.table])
    tell_lines(report.told)
    tell_written(report.files)
    return DONE
