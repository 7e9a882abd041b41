"""A clock by which every QP of a cycle goes wrong."""

from __future__ import annotations

from rti_mpcc.planning.clock import TIME_IS_UP, CycleClock
from rti_mpcc.qp.solver import Stop

FAILED = Stop("forced to fail", 0)
TIMED_OUT = Stop(TIME_IS_UP, 0)
"""After no iteration: after a few a QP may have come to an end of its own."""


class ForcedClock(CycleClock):
    """Ends every QP before it starts; runs on the wall clock in all else.

    Args:
        deadline: of the cycle [s], or None.
        timed_out: the QPs are stopped by their time limit and the deadline is missed; else they fail.
    """

    def __init__(self, deadline: float | None, *, timed_out: bool) -> None:
        super().__init__(deadline)
        self._timed_out = timed_out

    def stop(self) -> Stop:
        """How every QP ends."""
        return TIMED_OUT if self._timed_out else FAILED

    def _passed(self, passed: bool) -> bool:
        return passed or self._timed_out
