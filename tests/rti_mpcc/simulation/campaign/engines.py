"""An engine for the tests of campaigns: one thread of this process, going wrong as asked."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from threading import Lock, Timer
from types import TracebackType
from typing import Any, Self

from rti_mpcc.errors import CampaignError
from rti_mpcc.simulation.campaign import CampaignCase
from rti_mpcc.simulation.campaign.case import died_line

Call = tuple[Future[str], Callable[..., str], tuple[Any, ...]]


class Death(Exception):
    """A worker has ended."""


class Puppet:
    """Runs calls a moment after they are begun, the last one first.

    Attributes:
        deadly: indices of cases that end their worker, and with it all calls under way.
        undrawable: whether to draw such a course ends it too.
        deaths: so many workers end besides, while they have nothing to do.
        dropped: indices of cases that are dropped once.
        lost: nothing ends any more.
        begun: cases in the order in which they were run; together: how many were under way at most.
        renewed: how often; left_by: what it was left by, each time.
    """

    def __init__(self, window: int = 3) -> None:
        self.deadly: set[int] = set()
        self.undrawable = False
        self.deaths = 0
        self.dropped: set[int] = set()
        self.lost = False
        self.begun: list[int] = []
        self.together = 0
        self.renewed = 0
        self.left_by: list[type[BaseException] | None] = []
        self._window = window
        self._waiting: list[Call] = []
        self._lock = Lock()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.left_by.append(kind)

    def window(self) -> int:
        return self._window

    def submit(self, call: Callable[..., str], *arguments: Any) -> Future[str]:
        if self.deaths:
            self.deaths -= 1
            raise Death
        future: Future[str] = Future()
        with self._lock:
            self._waiting.append((future, call, arguments))
            self.together = max(self.together, len(self._waiting))
        Timer(0.01, self._run).start()
        return future

    def died(self, error: BaseException) -> bool:
        return isinstance(error, Death)

    def renew(self) -> None:
        assert not self._waiting
        self.renewed += 1

    def check(self) -> None:
        if self.lost:
            raise CampaignError("the engine is lost")

    def _run(self) -> None:
        with self._lock:
            if self.lost or not self._waiting:
                return
            future, call, arguments = self._waiting.pop()
            case: CampaignCase = arguments[-1]
            if case.index in self.dropped:
                self.dropped.remove(case.index)
                future.cancel()
                future.set_running_or_notify_cancel()
                return
            if call is not died_line:
                self.begun.append(case.index)
            if case.index in self.deadly and (self.undrawable or call is not died_line):
                others = [waiting for waiting, _, _ in self._waiting]
                self._waiting.clear()
                for one in [future, *others]:
                    one.set_exception(Death())
                return
            future.set_result(call(*arguments))
