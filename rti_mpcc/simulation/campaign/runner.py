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
    died_line,
    drive_case,
    driven_line,
)
from rti_mpcc.simulation.campaign.engine import Engine, LineOf
from rti_mpcc.simulation.campaign.lock import locked
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
            with engine, closing(lines(cases, drive, engine)) as found:
                for done, line in enumerate(found, start=1):
                    rows.append(line)
                    if progress is not None:
                        progress(done, to_do)
    return rows.tally


def lines(cases: Iterator[CampaignCase], drive: Drive, engine: Engine) -> Generator[str]:
    """The line of each case, as they end."""
    suspects = []
    with closing(engine.driven(partial(driven_line, drive), cases)) as driven:
        for case, line in driven:
            if line is None:
                suspects.append(case)
            else:
                yield line
    for case in suspects:
        line = _alone(engine, partial(driven_line, drive), case)
        if line is None:  # its course is drawn once more, by another worker, if it can be
            line = _alone(engine, died_line, case) or died_line(case, drawn=False)
        yield line


def _alone(engine: Engine, line_of: LineOf, case: CampaignCase) -> str | None:
    """The line of a case with no other one under way."""
    ((_, line),) = engine.driven(line_of, iter([case]))
    return line
