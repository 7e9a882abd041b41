"""Cases on a Dask cluster. Its library, `distributed`, is loaded when one is asked for."""

from __future__ import annotations

import logging
from collections.abc import Generator, Iterable, Iterator
from contextlib import ExitStack, closing, contextmanager, suppress
from itertools import islice
from types import ModuleType, TracebackType
from typing import Any, Self

from rti_mpcc.errors import CampaignError, InputError, MissingExtraError
from rti_mpcc.simulation.campaign.case import CampaignCase
from rti_mpcc.simulation.campaign.engine import AHEAD, Driven, LinesOf
from rti_mpcc.simulation.campaign.settings import versions

CONNECTING = 10.0
"""So long it may take to reach the scheduler [s]."""
FIRST_WORKER = 60.0
"""And so long until it has a worker [s]."""
POLL = 1.0
"""Between two looks at whether the scheduler is still there [s]."""
_LOG = logging.getLogger(__name__)


class DaskEngine:
    """The workers of a Dask scheduler; see `Engine`.

    A worker that ends is the scheduler's affair: it gives the case to another one, as often as its setting
    distributed.scheduler.allowed-failures says, before it tells.
    """

    def __init__(self, address: str) -> None:
        """`address` of the scheduler, such as tcp://host:8786. Raises MissingExtraError without Dask."""
        self.address = address
        self._dask = _distributed()
        self._client: Any = None
        self._stack = ExitStack()
        self._threads = 1  # of all workers, when last asked

    def __enter__(self) -> Self:
        """Raises CampaignError where there is no scheduler, no worker, or one with another program."""
        with ExitStack() as stack:
            stack.enter_context(_quiet())
            self._client = stack.enter_context(closing(self._connected()))
            self._same_everywhere()
            self._stack = stack.pop_all()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stack.close()  # with its client the scheduler forgets what is under way

    def driven(self, lines_of: LinesOf, cases: Iterator[CampaignCase]) -> Generator[Driven]:
        """See `Engine`."""
        under_way: dict[Any, CampaignCase] = {}
        while True:
            for case in islice(cases, max(self._window() - len(under_way), 0)):
                under_way[self._client.submit(lines_of, case, pure=False)] = case
            if not under_way:
                return
            for future in self._ended(under_way):
                case = under_way.pop(future)
                if future.status == "finished":
                    yield case, future.result()
                elif future.status == "error" and not self._killed(error := future.exception()):
                    raise error
                else:  # its workers have ended, or the scheduler has dropped it
                    self._check()
                    yield case, None

    def _window(self) -> int:
        """So many cases may be under way now; workers may come and go."""
        self._check()
        threads = self._threads
        with suppress(OSError, TimeoutError):  # one that is lost will be seen to be
            threads = sum(self._client.nthreads().values())
        if threads == 0 < self._threads:
            _LOG.warning("the Dask scheduler at %s has no worker: waiting for one", self.address)
        self._threads = threads
        return max(AHEAD * threads, 1)

    def _ended(self, under_way: Iterable[Any]) -> list[Any]:
        """Those that have ended, one way or another, after a while at the latest."""
        with self._client.as_current(), suppress(TimeoutError, self._dask.CancelledError):
            self._dask.wait(list(under_way), timeout=POLL, return_when="FIRST_COMPLETED")
        return [future for future in under_way if future.status != "pending"]

    def _killed(self, error: BaseException) -> bool:
        return isinstance(error, self._dask.scheduler.KilledWorker)

    def _check(self) -> None:
        if self._client.status != "running":
            raise CampaignError(f"the Dask scheduler at {self.address} is lost")

    def _connected(self) -> Any:
        """A client of a scheduler that has a worker."""
        try:
            # First: a client that was not told a good address does not end well.
            self._dask.comm.get_address_host_port(self.address)
            client = self._dask.Client(self.address, timeout=CONNECTING, set_as_default=False)
        except ValueError as error:
            raise InputError(f"dask = {self.address!r}: {error}") from error
        except OSError as error:
            raise CampaignError(f"no Dask scheduler at {self.address}: {error}") from error
        try:
            client.wait_for_workers(1, timeout=FIRST_WORKER)
        except TimeoutError:
            client.close()
            told = f"the Dask scheduler at {self.address} has no worker for {FIRST_WORKER:g} s"
            raise CampaignError(told) from None
        return client

    def _same_everywhere(self) -> None:
        """Rows must not depend on who drives them; those that come later are not asked."""
        mine = versions()
        try:
            theirs = self._client.run(versions)
        except ImportError as error:
            raise CampaignError(f"the Dask workers cannot load this program: {error}") from error
        for worker, found in theirs.items():
            for name, value in mine.items():
                if found.get(name) != value:
                    other = "another code" if name == "source" else f"{name} {found.get(name)}, not {value}"
                    raise CampaignError(f"the Dask worker at {worker} has {other}: rows would be mixed")
        if any(threads > 1 for threads in self._client.nthreads().values()):
            _LOG.warning("Dask workers with several threads are slow here: begin them with --nthreads 1")


@contextmanager
def _quiet() -> Iterator[None]:
    """A lost scheduler is told in one sentence, not in the library's log besides."""
    loggers = [logging.getLogger(f"distributed.{name}") for name in ("client", "utils")]
    before = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        for logger, level in zip(loggers, before, strict=True):
            logger.setLevel(level)


def _distributed() -> ModuleType:
    """Raises MissingExtraError."""
    try:
        import distributed
    except ImportError as error:
        raise MissingExtraError(
            "a Dask cluster needs the library distributed: pip install '.[cluster]' in rti-mpcc's folder"
        ) from error
    return distributed
