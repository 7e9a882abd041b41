"""What drives the cases: processes of this machine, by joblib; `cluster` has those of a Dask scheduler."""

from __future__ import annotations

import os
import threading
import warnings
from collections.abc import Callable, Generator, Iterator
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from time import sleep
from types import TracebackType
from typing import Protocol, Self, TypeVar

from rti_mpcc.errors import CampaignError, InputError
from rti_mpcc.simulation.batch import end_when_interrupted
from rti_mpcc.simulation.campaign.case import CampaignCase
from rti_mpcc.simulation.campaign.row import Lines

AHEAD = 2
"""Cases under way for each worker: one that is driven, one that waits, so that no worker has to."""
LOOKS = 0.5
"""So often a worker looks whether its parent is there [s]."""
LinesOf = Callable[[CampaignCase], Lines]
"""Gives the lines of a case; workers get it by its name."""
Driven = tuple[CampaignCase, Lines | None]
"""A case and its lines; None where a worker ended meanwhile, which may or may not be of the case's doing."""
T = TypeVar("T")
R = TypeVar("R")


class Engine(Protocol):
    """Drives cases in other processes; a context manager. Left by an exception it drops what is under way."""

    def __enter__(self) -> Self: ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...

    def driven(self, lines_of: LinesOf, cases: Iterator[CampaignCase]) -> Generator[Driven]:
        """All cases as they end; each is asked for as it is begun, few ahead.

        Raises CampaignError where there are no workers any more.
        """
        ...


class ProcessEngine:
    """Processes of this machine, one thread each, by joblib; see `Engine`.

    What joblib does not do: it tells that a process has ended, but not which case did it, so all that were
    under way are told to be lost; its processes would outlive a parent that was killed (`_begin_worker`); and
    a single job runs in the caller's process, which a case may end, so there a second process stands by idle.
    """

    def __init__(self, jobs: int | None = None) -> None:
        """`jobs`: so many processes; default: as many as there are cores. Raises InputError below 1."""
        if jobs is not None and jobs < 1:
            raise InputError(f"jobs = {jobs}: must be >= 1")
        self.jobs = jobs or os.cpu_count() or 1

    def __enter__(self) -> Self:
        """Raises CampaignError where processes cannot be started."""
        self._start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        # Joblib keeps its processes for a later call, which may never come.
        from joblib.externals.loky import get_reusable_executor

        get_reusable_executor(reuse=True).shutdown(wait=True, kill_workers=kind is not None)

    def driven(self, lines_of: LinesOf, cases: Iterator[CampaignCase]) -> Generator[Driven]:
        """See `Engine`."""
        while True:
            under_way: dict[CampaignCase, None] = {}
            results = self._results(partial(_with_case, lines_of), _noted(cases, under_way))
            try:
                for case, lines in results:
                    del under_way[case]
                    yield case, lines
                return
            except BrokenProcessPool:
                self._start()
                yield from ((case, None) for case in under_way)
            finally:
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore")  # of what is dropped
                    results.close()

    def _start(self) -> None:
        """Processes that end before their first case would make each case one that ends them."""
        try:
            list(self._results(str, iter([""])))
        except BrokenProcessPool as error:
            told = str(error).partition("\n")[0]
            raise CampaignError(f"worker processes cannot be started: {told}") from error

    def _results(self, call: Callable[[T], R], items: Iterator[T]) -> Generator[R]:
        """Results as they come. Raises BrokenProcessPool where a process has ended."""
        from joblib import Parallel, delayed, parallel_config

        ahead = AHEAD * self.jobs if self.jobs > 1 else 1
        options = {"inner_max_num_threads": 1, "initializer": _begin_worker, "initargs": (os.getpid(),)}
        with parallel_config("loky", n_jobs=max(self.jobs, 2), **options):
            parallel = Parallel(return_as="generator_unordered", pre_dispatch=ahead, batch_size=1)
            results: Generator[R] = parallel(delayed(call)(item) for item in items)
        return results


def _noted(cases: Iterator[CampaignCase], under_way: dict[CampaignCase, None]) -> Iterator[CampaignCase]:
    for case in cases:
        under_way[case] = None
        yield case


def _with_case(lines_of: LinesOf, case: CampaignCase) -> tuple[CampaignCase, Lines]:
    return case, lines_of(case)


def _begin_worker(parent: int) -> None:
    """A worker ends when it is interrupted, and with its parent, whatever ended that (not on Windows)."""
    end_when_interrupted()
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()


def _end_with(parent: int) -> None:
    while os.getppid() == parent:
        sleep(LOOKS)
    os._exit(1)
