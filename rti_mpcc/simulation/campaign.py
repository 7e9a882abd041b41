"""Campaigns: many cases, each driven and kept as a row, by processes of this machine or a Dask cluster.

Joblib distributes the cases. If a case ends its worker, it becomes a row, and the others are driven. A row is
the same on each machine and by any number of workers: what was timed goes to another file.
"""

from __future__ import annotations

import json
import re
import sys
from collections import Counter
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack, closing, contextmanager, suppress
from dataclasses import asdict, dataclass
from enum import Enum
from pathlib import Path
from typing import Any, Protocol, TextIO

from geometry.errors import check_extra
from geometry.files import RECORDING, content, from_json
from rti_mpcc.errors import CampaignError, InputError
from rti_mpcc.simulation.batch import Case, DrivenCase, checked_jobs, drive, joblib
from rti_mpcc.simulation.metrics import untimed
from rti_mpcc.simulation.result import RunResult
from rti_mpcc.simulation.scenario import Scenario
from rti_mpcc.types import Source, Status

ROWS, TIMES = "rows.jsonl", "timed.jsonl"
MOST = 1_000_000  # cases of a campaign, at most
AHEAD = 2  # number of cases under way for each worker: one is driven, one waits
SILENCE = 1800.0  # after this time without the end of a case the workers are lost [s]: joblib does not say so
DEATHS = 2  # a case that has ended this number of workers of a Dask cluster is not driven again
DIED = "its worker process ended while it was under way"
_ADDRESS = re.compile(r" at 0x[0-9a-f]+")

Drawn = Mapping[str, Any]  # what was drawn of a case: its `course` and `disturbances`


class RandomCase(Protocol):
    """A case that is drawn where it is driven: workers are sent its attributes only.

    `index`: 0 ... MOST - 1; `name` of its scenario; `run`: method, preset and seed, as `batch.Case` has them.
    The scenario is the same each time; InputError where it can't be drawn. `drawn`: what was drawn of it.
    """

    @property
    def index(self) -> int: ...  # noqa: D102
    @property
    def name(self) -> str: ...  # noqa: D102
    @property
    def run(self) -> Mapping[str, Any]: ...  # noqa: D102
    def scenario(self) -> Scenario: ...  # noqa: D102
    def drawn(self, scenario: Scenario) -> Drawn: ...  # noqa: D102


class CaseOutcome(Enum):
    """How a case ended; the worst last."""

    DOCKED = "docked"  # inside tolerance of the true goal, standing, at the end, and the controller says so
    UNCONFIRMED = "unconfirmed"  # docked, but the controller does not say so
    UNFINISHED = "unfinished"  # the time ran out
    STALLED = "stalled"  # the controller said so, and stood
    FAILED = "failed"  # the controller had no plan, and stood
    RAISED = "raised"  # an exception: an internal error
    WORKER_DIED = "worker_died"  # the process that drove the case ended


@dataclass(frozen=True, slots=True, kw_only=True)
class CampaignRow:
    """One case.

    `figures` are those of `metrics.summary` that are not timed, with cycles_by_status (counts) and
    failures_driven: cycles whose QP was refused and whose command is its solution all the same, there must be
    none. `timed`: cycle_ms and deadline_misses as in summary.json; misses, these by status; planning_s, the
    time of all searches [s].
    """

    index: int
    scenario: str  # its name
    outcome: CaseOutcome
    detail: str  # of what did not dock: the controller's last reason, or the exception
    course: Mapping[str, Any] | None = None  # what was drawn, by name; None where it could not be
    disturbances: Mapping[str, Any] | None = None  # likewise
    figures: Mapping[str, Any] | None = None  # None where nothing was driven to its end
    timed: Mapping[str, Any] | None = None  # no part of `table`

    def table(self) -> dict[str, Any]:
        """The row for JSON, without what was timed."""
        table = asdict(self) | {"outcome": self.outcome.value}
        del table["timed"]
        return table


def row_of(index: int, driven: DrivenCase, drawn: Drawn) -> CampaignRow:
    """The row of a case that was driven."""
    result, cycles = driven.result, driven.result.cycles
    statuses = Counter(status.value for status in cycles.status)
    outcome = outcome_of(result, docked=driven.figures["docked"])
    reasons = [] if outcome is CaseOutcome.DOCKED else [reason for reason in cycles.reason if reason]
    return CampaignRow(
        index=index,
        scenario=result.scenario.name,
        outcome=outcome,
        detail=reasons[-1] if reasons else "",
        **drawn,
        figures={
            **untimed(driven.figures),
            "cycles_by_status": dict(sorted(statuses.items())),
            "failures_driven": sum(source is Source.SOLUTION for source in cycles.source[cycles.failed]),
        },
        timed={
            **{name: driven.figures[name] for name in ("cycle_ms", "deadline_misses")},
            "misses": Counter(status.value for status in cycles.status[cycles.deadline_missed]),
            "planning_s": result.planning_seconds,
        },
    )


def outcome_of(result: RunResult, *, docked: bool) -> CaseOutcome:
    """How a run ended, by its figures and the controller's last status."""
    last = result.cycles.status[-1] if len(result.cycles) else None
    if docked:
        return CaseOutcome.DOCKED if last is Status.DOCKED else CaseOutcome.UNCONFIRMED
    if result.ended != "stopped":
        return CaseOutcome.UNFINISHED
    return CaseOutcome.FAILED if last is Status.FAILED else CaseOutcome.STALLED


Drive = Callable[[Any], CampaignRow]
"""Makes a row of a case. Workers get it by its name: it has to be defined at the top of a module."""


def drive_case(case: RandomCase) -> CampaignRow:
    """Draw and drive a case. Raises what either raises."""
    scenario = case.scenario()
    return row_of(case.index, drive(Case(scenario=scenario, **case.run)), case.drawn(scenario))


def run_campaign(
    cases: Sequence[RandomCase],
    folder: Path,
    *,
    jobs: int | None = None,
    dask: str | None = None,
    drive: Drive = drive_case,
    progress: Callable[[int, int], None] | None = None,
) -> None:
    """Drive all cases; keep a row of each in FOLDER/rows.jsonl, and what was timed in FOLDER/timed.jsonl.

    Args:
        folder: exists; files of an earlier campaign in it are replaced.
        jobs: number of processes, default: one a core; dask: address of a Dask cluster's scheduler instead.
        drive: makes a row of a case; progress: called with (done, in all).

    Raises InputError for jobs < 1, CampaignError for lost workers, MissingExtraError without Dask, OSError.
    """
    workers = checked_jobs(jobs)
    with ExitStack() as stack:
        files = ((folder / name).open("w", encoding="utf-8") for name in (ROWS, TIMES))
        rows, times = map(stack.enter_context, files)
        options = _workers(stack, workers, dask)
        driven = stack.enter_context(closing(_driven(drive, iter(cases), options)))
        for done, row in enumerate(driven, start=1):
            _write(rows, row.table())
            if row.timed is not None:
                _write(times, {"index": row.index, **row.timed})
            if progress is not None:
                progress(done, len(cases))


def read_rows(folder: Path, file: str = ROWS) -> list[dict[str, Any]]:
    """The rows of a campaign as they ended, without an incomplete last line. Raises InputError."""
    try:
        lines = content(folder / file, RECORDING).split(b"\n")[:-1]
        return [dict(from_json(line)) for line in lines]
    except (OSError, ValueError, TypeError) as error:
        raise InputError(f"{folder / file}: can't be read as rows of a campaign: {error}") from None


def _write(file: TextIO, table: Mapping[str, Any]) -> None:
    file.write(json.dumps(table, allow_nan=False, separators=(",", ":"), ensure_ascii=False) + "\n")
    file.flush()


def _workers(stack: ExitStack, jobs: int, dask: str | None) -> dict[str, Any]:
    """Options of joblib's `Parallel` for processes or, while `stack` is open, for a cluster."""
    if dask is None:
        # Joblib would drive a single job in this process, which a case may end: a second one stands by.
        stack.enter_context(joblib().parallel_config("loky", n_jobs=max(jobs, 2), inner_max_num_threads=1))
        return {"pre_dispatch": AHEAD * jobs if jobs > 1 else 1}
    check_extra("cluster", "a Dask cluster needs", "distributed")
    import distributed

    try:
        connected: Any = distributed.Client  # it has no types
        stack.enter_context(connected(dask, timeout=10.0))
        stack.enter_context(joblib().parallel_config("dask"))
    except (OSError, ValueError) as error:
        raise CampaignError(f"no Dask scheduler at {dask}: {error}") from error
    return {"pre_dispatch": f"{AHEAD} * n_jobs"}


def _driven(drive: Drive, cases: Iterator[RandomCase], options: Mapping[str, Any]) -> Generator[CampaignRow]:
    """Rows as they end. Where a process ended, those that were under way are driven again, each alone."""
    while True:
        under_way: dict[int, RandomCase] = {}
        try:
            yield from _parallel(drive, cases, under_way, options)
            return
        except BrokenProcessPool:
            suspects = list(under_way.values())
        for case in suspects:
            try:
                yield from _parallel(drive, iter([case]), {}, options)
            except BrokenProcessPool:
                yield undriven_row(case, CaseOutcome.WORKER_DIED, DIED)


def _parallel(
    drive: Drive, cases: Iterator[RandomCase], under_way: dict[int, RandomCase], options: Mapping[str, Any]
) -> Generator[CampaignRow]:
    """Rows as they end; `under_way` holds the others. Raises BrokenProcessPool where a process ended."""
    library = joblib()
    parallel = library.Parallel(return_as="generator_unordered", batch_size=1, timeout=SILENCE, **options)

    def tasks() -> Iterator[Any]:
        for case in cases:
            under_way[case.index] = case
            yield library.delayed(_row)(drive, case)

    try:
        for row in parallel(tasks()):
            del under_way[row.index]
            yield row
    except TimeoutError as error:
        raise CampaignError(f"no case has ended for {SILENCE:g} s: the workers are lost") from error


def _row(drive: Drive, case: RandomCase) -> CampaignRow:
    """The row of a case, in a worker; where `drive` raises, a row with the exception."""
    with _counted(case) as before:
        if before >= DEATHS:
            return undriven_row(case, CaseOutcome.WORKER_DIED, DIED)
        try:
            row = drive(case)
            json.dumps(row.table(), allow_nan=False)
        except (Exception, SystemExit) as error:
            # What differs from process to process is no part of a row.
            said = _ADDRESS.sub("", " ".join(f"{type(error).__name__}: {error}".split()))
            return undriven_row(case, CaseOutcome.RAISED, said)
        return row


@contextmanager
def _counted(case: RandomCase) -> Iterator[int]:
    """How many workers of a Dask cluster this case has ended before; 0 elsewhere.

    Joblib waits for ever for a case that Dask gives up, so a case has to be given up here before that.
    """
    try:
        client = sys.modules["distributed"].get_worker().client
    except (KeyError, ValueError):  # not in a worker
        yield 0
        return
    key = ["rti-mpcc campaign", case.name]
    before: int = client.get_metadata(key, default=0)
    client.set_metadata(key, before + 1)
    yield before
    client.set_metadata(key, 0)


def undriven_row(case: RandomCase, outcome: CaseOutcome, detail: str) -> CampaignRow:
    """A row without figures, and without what was drawn where it can't be."""
    drawn: Drawn = {}
    if outcome is CaseOutcome.RAISED:  # what ended one process may end another
        with suppress(Exception):
            drawn = case.drawn(case.scenario())
    return CampaignRow(index=case.index, scenario=case.name, outcome=outcome, detail=detail, **drawn)
