"""Campaigns: all cases that have no row yet, driven by an engine, a row each as they end.

A case that ends its worker takes others with it: all that were under way are suspects then, and are driven
again behind all others, one at a time, alone. The one that ends its worker once more is a row of its own, the
others are driven as if nothing had been.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator
from contextlib import closing
from functools import partial
from pathlib import Path

from rti_mpcc.simulation.campaign.case import (
    CampaignCase,
    Drive,
    died_lines,
    drive_case,
    driven_lines,
)
from rti_mpcc.simulation.campaign.engine import Engine, LinesOf
from rti_mpcc.simulation.campaign.lock import locked
from rti_mpcc.simulation.campaign.row import Lines
from rti_mpcc.simulation.campaign.rows_file import RowsFile, Tally
from rti_mpcc.simulation.campaign.settings import CampaignSettings, keep_settings

Progress = Callable[[int, int], None]


def run_campaign(
    settings: CampaignSettings,
    folder: Path,
    *,
    engine: Engine,
    drive: Drive = drive_case,
    progress: Progress | None = None,
) -> Tally:
    """Drive all cases that have no row in FOLDER/rows.jsonl yet, and count all that have one then.

    The folder is made where it is missing. What this process holds does not grow with the number of cases
    but for one byte each.

    Args:
        engine: begun here, and only where there is something to do.
        drive: makes a row of a case, by default the real one; workers import it.
        progress: told (done, to do in all) by this call, after each case.

    Raises InputError where the folder is another campaign's or another process runs it, CampaignError where
    the engine is lost, OSError where the rows cannot be written. Rows so far are kept then, also where the
    process is interrupted or killed: the same call goes on behind them.
    """
    folder.mkdir(parents=True, exist_ok=True)
    with locked(folder):
        keep_settings(settings, folder)
        with RowsFile(folder, settings.count) as rows:
            to_do = settings.count - rows.tally.cases
            if to_do == 0:
                return rows.tally
            cases = (settings.case(index) for index in range(settings.count) if not rows.done[index])
            with engine, closing(kept(cases, drive, engine)) as found:
                for done, lines in enumerate(found, start=1):
                    rows.append(lines)
                    if progress is not None:
                        progress(done, to_do)
    return rows.tally


def kept(cases: Iterator[CampaignCase], drive: Drive, engine: Engine) -> Generator[Lines]:
    """The lines of each case, as they end."""
    suspects = []
    with closing(engine.driven(partial(driven_lines, drive), cases)) as driven:
        for case, lines in driven:
            if lines is None:
                suspects.append(case)
            else:
                yield lines
    for case in suspects:
        lines = _alone(engine, partial(driven_lines, drive), case)
        if lines is None:  # its course is drawn once more, by another worker, if it can be
            lines = _alone(engine, died_lines, case) or died_lines(case, drawn=False)
        yield lines


def _alone(engine: Engine, lines_of: LinesOf, case: CampaignCase) -> Lines | None:
    """The lines of a case with no other one under way."""
    ((_, lines),) = engine.driven(lines_of, iter([case]))
    return lines
