"""Campaigns: all cases that have no row yet, driven by an engine, a row each as they end.

A case that ends its worker takes others with it: all that were under way are suspects then, and are driven
again one at a time, alone. The one that ends its worker once more is a row of its own, the others are driven
as if nothing had been.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass, field
from pathlib import Path

from rti_mpcc.simulation.campaign.case import (
    DIED,
    CampaignCase,
    Drive,
    bare_row,
    died_line,
    drive_case,
    driven_line,
)
from rti_mpcc.simulation.campaign.engine import Engine
from rti_mpcc.simulation.campaign.lock import locked
from rti_mpcc.simulation.campaign.row import CaseOutcome
from rti_mpcc.simulation.campaign.rows_file import RowsFile, Tally
from rti_mpcc.simulation.campaign.settings import CampaignSettings, keep_settings

POLL = 1.0
"""Between two looks at whether the engine is still there [s]."""
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
            with engine:
                for done, line in enumerate(lines(cases, drive, engine), start=1):
                    rows.append(line)
                    if progress is not None:
                        progress(done, to_do)
    return rows.tally


@dataclass(slots=True, kw_only=True)
class _Work:
    """What is under way.

    Attributes:
        flight: the cases that are being driven.
        suspects: those to be driven alone, because one of them ended its worker.
        alone: whether the one under way is such.
        broken: whether workers have to be had again before anything else is begun.
    """

    flight: dict[Future[str], CampaignCase] = field(default_factory=dict)
    suspects: deque[CampaignCase] = field(default_factory=deque)
    alone: bool = False
    broken: bool = False


def lines(cases: Iterator[CampaignCase], drive: Drive, engine: Engine) -> Iterator[str]:
    """The line of each case, as they end. Cases are asked for as they are begun, few ahead."""
    work = _Work()
    while True:
        _begin(work, cases, drive, engine)
        if not work.flight:
            if work.suspects:
                continue  # a worker had ended before it was given one of them
            return
        ended, _ = wait(work.flight, timeout=POLL, return_when=FIRST_COMPLETED)
        if not ended:
            engine.check()
        for future in ended:
            line = _taken(work, future, engine)
            if line is not None:
                yield line


def _begin(work: _Work, cases: Iterator[CampaignCase], drive: Drive, engine: Engine) -> None:
    """Begin as many cases as there may be under way; a suspect only when it is alone."""
    if work.broken and not work.flight:
        engine.renew()
        work.broken = False
    if work.suspects:
        if not work.flight:
            work.alone = True
            _submit(work, work.suspects.popleft(), drive, engine)
        return
    work.alone = work.alone and bool(work.flight)
    if work.alone or work.broken:
        return
    window = engine.window()
    while len(work.flight) < window and not work.broken and (case := next(cases, None)) is not None:
        _submit(work, case, drive, engine)


def _submit(work: _Work, case: CampaignCase, drive: Drive, engine: Engine) -> None:
    """Begin a case; where workers have ended meanwhile, it is none of its doing."""
    try:
        work.flight[engine.submit(driven_line, drive, case)] = case
    except Exception as error:
        if not engine.died(error):
            raise
        work.broken, work.alone = True, False
        work.suspects.append(case)


def _taken(work: _Work, future: Future[str], engine: Engine) -> str | None:
    """The line of a case that has ended; None where it is to be driven again."""
    case = work.flight.pop(future)
    if future.cancelled():
        engine.check()
        work.suspects.append(case)  # dropped by the engine, for no fault of its own
        return None
    error = future.exception()
    if error is None:
        return future.result()
    if not engine.died(error):
        raise error
    work.broken = True
    if not work.alone:
        work.suspects.append(case)
        return None
    engine.renew()
    work.broken = False
    return _died(case, engine)


def _died(case: CampaignCase, engine: Engine) -> str:
    """The line of a case that ends its workers, with its course drawn by another one."""
    future = engine.submit(died_line, case)
    while not wait([future], timeout=POLL).done:
        engine.check()
    error = None if future.cancelled() else future.exception()
    if not future.cancelled() and error is None:
        return future.result()
    if error is not None and not engine.died(error):
        raise error
    engine.renew()
    return bare_row(case, CaseOutcome.WORKER_DIED, DIED).line()
