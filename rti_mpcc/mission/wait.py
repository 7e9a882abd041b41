"""Wait: stand for some seconds, or until a signal."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import inf

from rti_mpcc.mission.state import MissionState
from rti_mpcc.mission.step import MissionCycle, Signal, Started, Step, StepOutcome, StepStart, refuse_unless
from rti_mpcc.orders import Stand
from rti_mpcc.types import MissionResult


@dataclass(frozen=True, slots=True)
class Wait(Step):
    """Stand for some seconds, or until a signal; with both until the first of them."""

    word = "wait"
    seconds: float | None = None
    until: Signal | None = field(default=None, kw_only=True)

    def _check(self) -> None:
        finite = self.seconds is None or 0.0 <= self.seconds < inf
        refuse_unless(finite, self, "seconds", "must be >= 0, and finite")
        ends = self.seconds is not None or self.until is not None
        refuse_unless(ends, self, "seconds", "needs seconds, or a signal")

    @property
    def needs_routes(self) -> bool:
        """It stays where the vehicle is."""
        return False

    def start(self, at: StepStart) -> Started:
        """Stand."""
        return Started(at.mission_state, Stand())

    def judged(self, mission_state: MissionState, cycle: MissionCycle) -> StepOutcome:
        """SUCCEEDED after its seconds, or with its signal."""
        assert mission_state.started is not None
        over = self.seconds is not None and cycle.now - mission_state.started >= self.seconds
        if cycle.signal or over:
            return StepOutcome(mission_state, MissionResult.SUCCEEDED)
        return self.timed_out(mission_state, cycle.now)
