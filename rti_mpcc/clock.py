"""All decisions of a cycle that depend on time, in one place, so that they can be recorded and played back.

There are three: whether another iteration may begin, when a QP is stopped before it is solved, and whether
the plan came too late. A `CycleClock` decides by the wall clock and keeps its decisions.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from time import perf_counter

from rti_mpcc.config import EXIT
from rti_mpcc.qp.solver import Ends, Stop

TIME_IS_UP = "run time limit reached"


@dataclass(frozen=True, slots=True, kw_only=True)
class Decisions:
    """What the clock decided in one cycle.

    Attributes:
        granted: for each iteration that was asked for, in order, whether it could begin.
        stops: for each QP, in order, what ended it from outside; None where it came to an end of its own.
        late: whether the deadline had passed when it was decided what is driven.
    """

    granted: tuple[bool, ...] = ()
    stops: tuple[Stop | None, ...] = ()
    late: bool = False


class CycleClock:
    """Runs from the begin of a cycle; answers by the wall clock.

    Args:
        deadline: of the cycle [s], or None.
    """

    def __init__(self, deadline: float | None = None) -> None:
        self._started = self._asked = perf_counter()
        self._until = inf if deadline is None else self._started + deadline
        self._longest = 0.0
        self._granted: list[bool] = []
        self._stops: list[Stop | None] = []
        self._late: bool | None = None

    @property
    def seconds(self) -> float:
        """Since the begin of the cycle [s]."""
        return perf_counter() - self._started

    @property
    def decisions(self) -> Decisions:
        """What was decided so far."""
        return Decisions(granted=tuple(self._granted), stops=tuple(self._stops), late=bool(self._late))

    def grants(self, least: float = 0.0) -> bool:
        """Whether there is time for an iteration as long as the longest of this cycle, and `least` [s]."""
        now = perf_counter()
        if self._granted:
            self._longest = max(self._longest, now - self._asked)
        self._asked = now
        self._granted.append(self._until - EXIT - now > max(self._longest, least))
        return self._granted[-1]

    def ends(self) -> Ends:
        """For the next QP: what ends it after so many iterations, "" if it may go on.

        The time does not end the first one of a cycle: its plan may come late, but the search gets on.
        """
        stop, first = self.stop(), not self._stops

        def word(iterations: int) -> str:
            if stop is not None and iterations >= stop.iterations:
                return stop.status
            return TIME_IS_UP if perf_counter() >= self._until - EXIT and not first else ""

        return word

    def stop(self) -> Stop | None:
        """What is to end the next QP whatever the time is, or None."""
        return None

    def took(self, stop: Stop | None) -> None:
        """Keep what ended a QP from outside, None if nothing did."""
        self._stops.append(stop)

    def late(self) -> bool:
        """Whether the deadline has passed. Decided once: asked again, the answer stays."""
        if self._late is None:
            self._late = perf_counter() > self._until
        return self._late


class PlayedBack(CycleClock):
    """Answers as another clock did. Asked more often than that one, it grants nothing."""

    def __init__(self, decisions: Decisions) -> None:
        super().__init__()
        self._played, self._late = decisions, decisions.late

    def stop(self) -> Stop | None:
        """What ended this QP when it was recorded."""
        place = len(self._stops)
        return self._played.stops[place] if place < len(self._played.stops) else None

    def grants(self, least: float = 0.0) -> bool:
        """Whether an iteration could begin when it was recorded."""
        place = len(self._granted)
        self._granted.append(place < len(self._played.granted) and self._played.granted[place])
        return self._granted[-1]
