"""What runs cases elsewhere: processes of this machine; in `cluster` those of others."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack
from multiprocessing import get_context, parent_process
from multiprocessing.connection import wait
from types import TracebackType
from typing import Any, Protocol, Self

from rti_mpcc.errors import CampaignError, InputError
from rti_mpcc.simulation.batch import end_when_interrupted, one_thread_each

AHEAD = 2
"""Calls under way for each worker: one that runs, one that waits, so that no worker has to."""


class Engine(Protocol):
    """Runs calls in other processes, through the interface of concurrent.futures; a context manager.

    Left by an exception it drops all calls that are under way.
    """

    def __enter__(self) -> Self: ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...

    def window(self) -> int:
        """So many calls may be under way now, at least 1."""
        ...

    def submit(self, call: Callable[..., str], *arguments: Any) -> Future[str]:
        """Begin a call. Raises what `died` knows where a worker has ended meanwhile."""
        ...

    def died(self, error: BaseException) -> bool:
        """Whether a call failed because its worker ended."""
        ...

    def renew(self) -> None:
        """Have workers again after one has ended, with no call under way. Raises CampaignError."""
        ...

    def check(self) -> None:
        """Raises CampaignError where no call that is under way can end any more."""
        ...


class ProcessEngine:
    """Processes of this machine, one thread each. They import the caller's main module, see `drive_all`."""

    def __init__(self, jobs: int | None = None) -> None:
        """`jobs`: so many processes; default: as many as there are cores. Raises InputError below 1."""
        if jobs is not None and jobs < 1:
            raise InputError(f"jobs = {jobs}: must be >= 1")
        self.jobs = jobs or os.cpu_count() or 1
        self._stack = ExitStack()
        self._pool: Executor | None = None

    def __enter__(self) -> Self:
        self._stack.enter_context(one_thread_each())
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        pool, self._pool = self._pool, None
        with self._stack:
            if pool is not None:
                # An interrupted worker has ended; one that was not is left to end its case by itself.
                pool.shutdown(wait=kind is None, cancel_futures=True)

    def window(self) -> int:
        """See `Engine`."""
        return AHEAD * self.jobs

    def submit(self, call: Callable[..., str], *arguments: Any) -> Future[str]:
        """See `Engine`."""
        if self._pool is None:
            self._pool = self._begun()
        return self._pool.submit(call, *arguments)

    def died(self, error: BaseException) -> bool:
        """See `Engine`."""
        return isinstance(error, BrokenProcessPool)

    def renew(self) -> None:
        """See `Engine`."""
        if self._pool is not None:
            self._pool.shutdown(wait=True)
        self._pool = self._begun()

    def check(self) -> None:
        """A pool tells by itself what has become of its calls."""

    def _begun(self) -> Executor:
        """A pool whose processes do start: else every case would be taken for one that ends them."""
        pool = ProcessPoolExecutor(self.jobs, mp_context=get_context("spawn"), initializer=_begin_worker)
        try:
            pool.submit(os.getpid).result()
        except BrokenProcessPool as error:
            raise CampaignError(f"worker processes cannot be started: {error}") from error
        return pool


def _begin_worker() -> None:
    """A worker ends when it is interrupted, and with its parent, whatever ended that."""
    end_when_interrupted()
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)
