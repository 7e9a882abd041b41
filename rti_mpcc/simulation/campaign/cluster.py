"""Cases on a Dask cluster. Its library, `distributed`, is loaded when one is asked for."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from contextlib import ExitStack, contextmanager
from types import ModuleType, TracebackType
from typing import Any, Self

from rti_mpcc.errors import CampaignError, InputError, MissingExtraError
from rti_mpcc.simulation.campaign.engine import AHEAD
from rti_mpcc.simulation.campaign.settings import versions

CONNECTING = 10.0
"""So long it may take to reach the scheduler [s]."""
FIRST_WORKER = 60.0
"""And so long until it has a worker [s]."""
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
        self._executor: Executor | None = None
        self._stack = ExitStack()
        self._window = AHEAD
        self._deserted = False

    def __enter__(self) -> Self:
        """Raises CampaignError where there is no scheduler, no worker, or one with another program."""
        self._stack.enter_context(_quiet())
        try:
            self._client = self._connected()
            self._stack.callback(self._client.close)
            self._executor = self._client.get_executor(pure=False)
            self._same_everywhere()
        except BaseException:
            self._stack.close()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with self._stack:
            if self._executor is not None and self._client.status == "running":
                self._executor.shutdown(wait=kind is None)  # without waiting it cancels

    def window(self) -> int:
        """See `Engine`; workers may come and go."""
        try:
            threads = sum(self._client.nthreads().values())
        except (OSError, TimeoutError):
            self.check()
            return self._window
        if threads == 0 and not self._deserted:
            _LOG.warning("the Dask scheduler at %s has no worker: waiting for one", self.address)
        self._deserted = threads == 0
        self._window = max(AHEAD * threads, 1)
        return self._window

    def submit(self, call: Callable[..., str], *arguments: Any) -> Future[str]:
        """See `Engine`."""
        if self._executor is None:
            raise RuntimeError("a DaskEngine is a context manager: enter it first")
        return self._executor.submit(call, *arguments)

    def died(self, error: BaseException) -> bool:
        """See `Engine`."""
        return isinstance(error, self._dask.scheduler.KilledWorker)

    def renew(self) -> None:
        """The cluster has workers again by itself."""
        self.check()

    def check(self) -> None:
        """See `Engine`."""
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
            "a Dask cluster needs the library distributed: pip install 'rti-mpcc[cluster]'"
        ) from error
    return distributed
