"""When a run ends."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from rti_mpcc.simulation.faults import FaultSection, last_end
from rti_mpcc.simulation.plant import SAME_TIME
from rti_mpcc.types import Status

STANDSTILL_SPEED = 0.02
"""Slower than this [m/s] is standing."""
DOCK_TIME = 0.5
"""So long [s] inside tolerance and standing is docked."""
AFTER_DOCKING = 0.5
"""The run goes on so long after docking [s]."""
WORD = 5.0
"""So long [s] a docked vehicle is watched for the controller to say so."""
AFTER_STOP = 5.0
"""The run goes on so long after a latched stop [s]."""
LATCHED = (Status.STALLED, Status.GOAL_BEHIND, Status.GOAL_REJECTED, Status.FAILED)


@dataclass(frozen=True, slots=True)
class Ending:
    """Since when the vehicle has been docked in truth, and stopped for good by its own word [s].

    `said`: the controller says that it has docked; `over_since`: since when a mission is over, at rest [s].
    """

    docked_since: float | None = None
    stopped_since: float | None = None
    said: bool = False
    over_since: float | None = None

    def after(self, time: float, *, docked: bool, stopped: bool, said: bool) -> Ending:
        """One sample later."""
        return Ending(
            (time if self.docked_since is None else self.docked_since) if docked else None,
            (time if self.stopped_since is None else self.stopped_since) if stopped else None,
            said,
        )

    def after_mission(self, time: float, *, over: bool) -> Ending:
        """One sample later, of a run that ends with its mission."""
        return Ending(over_since=(time if self.over_since is None else self.over_since) if over else None)

    def reason(self, time: float, faults: Iterable[FaultSection]) -> str | None:
        """Why the run ends now, or None.

        A docked vehicle is watched until its controller says so, but no longer than `WORD`, and to the end of
        the faults that act on it, not until others that come much later. One that has stopped may go on when
        the last fault is over.
        """
        docked, stopped = self.docked_since, self.stopped_since
        if self.over_since is not None and time - self.over_since >= AFTER_DOCKING - SAME_TIME:
            return "mission over"
        acting = any(fault.acts(time) for fault in faults)
        most = DOCK_TIME + (AFTER_DOCKING if self.said else WORD)
        if docked is not None and not acting and time - docked >= most - SAME_TIME:
            return "docked"
        if stopped is not None and time - max(stopped, last_end(faults)) >= AFTER_STOP - SAME_TIME:
            return "stopped"
        return None
