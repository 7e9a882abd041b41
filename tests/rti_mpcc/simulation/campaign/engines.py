"""An engine for the tests of campaigns: this process, the last case first, going wrong as asked."""

from __future__ import annotations

from collections.abc import Generator, Iterator
from itertools import islice
from types import TracebackType
from typing import Self

from rti_mpcc.errors import CampaignError
from rti_mpcc.simulation.campaign import CampaignCase
from rti_mpcc.simulation.campaign.case import died_lines
from rti_mpcc.simulation.campaign.engine import Driven, LinesOf


class Puppet:
    """Drives a few cases at a time, the last one first.

    Attributes:
        deadly: indices of cases that end their worker, and with it all that are under way.
        undrawable: whether to draw such a course ends it too.
        dropped: indices of cases whose lines are lost once.
        lost_after: so many cases are driven, then the engine is lost.
        begun: cases in the order in which they were run; together: how many were under way at most.
        left_by: what it was left by, each time.
    """

    def __init__(self, window: int = 3) -> None:
        self.deadly: set[int] = set()
        self.undrawable = False
        self.dropped: set[int] = set()
        self.lost_after = 1000
        self.begun: list[int] = []
        self.together = 0
        self.left_by: list[type[BaseException] | None] = []
        self._window = window

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.left_by.append(kind)

    def driven(self, lines_of: LinesOf, cases: Iterator[CampaignCase]) -> Generator[Driven]:
        under_way: list[CampaignCase] = []
        while True:
            under_way += islice(cases, self._window - len(under_way))
            if not under_way:
                return
            self.together = max(self.together, len(under_way))
            if len(self.begun) >= self.lost_after:
                raise CampaignError("the engine is lost")
            case = under_way.pop()
            if lines_of is not died_lines:
                self.begun.append(case.index)
            if case.index in self.deadly and (self.undrawable or lines_of is not died_lines):
                yield from ((one, None) for one in [case, *under_way])
                under_way.clear()
            elif case.index in self.dropped:
                self.dropped.remove(case.index)
                yield case, None
            else:
                yield case, lines_of(case)
