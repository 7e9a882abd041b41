"""The faults of a run that act between the vehicle and its controller."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import cos, inf, nan, sin
from typing import TypeVar

from estimation import GoalMeasurement
from geometry import Pose2
from geometry.pose import unchecked_pose
from rti_mpcc.planning.clock import TIME_IS_UP, CycleClock
from rti_mpcc.qp.solver import Stop
from rti_mpcc.simulation.plant import SAME_TIME
from rti_mpcc.simulation.sections.faults import FaultSection, Kind
from rti_mpcc.types import VehicleState

Placed = TypeVar("Placed", VehicleState, GoalMeasurement)

FAILED = Stop("forced to fail", 0)
_TIMED_OUT = Stop(TIME_IS_UP, 0)
"""After no iteration: after a few iterations a QP may be solved."""


class ForcedClock(CycleClock):
    """A wall clock that ends every QP before it starts.

    The QPs fail, or, if `timed_out`, are stopped by their time limit and the deadline [s] is missed.
    """

    def __init__(self, deadline: float | None, *, timed_out: bool) -> None:
        super().__init__(deadline)
        self._timed_out = timed_out

    def stop(self) -> Stop:
        """How every QP ends."""
        return _TIMED_OUT if self._timed_out else FAILED

    def _passed(self, passed: bool) -> bool:
        return passed or self._timed_out


@dataclass(slots=True, kw_only=True)
class Disturbances:
    """The faults of a run that act between vehicle and controller.

    `frozen`: the state of each `frozen_state`.
    """

    faults: tuple[FaultSection, ...]
    frozen: dict[FaultSection, VehicleState] = field(default_factory=dict)

    def acting(self, kind: Kind, now: float) -> list[FaultSection]:
        """The faults of a kind that act at `now` [s]."""
        return [fault for fault in self.faults if fault.kind == kind and fault.acts(now)]

    def total(self, kind: Kind, now: float) -> float:
        """Sum of the sizes of those that act."""
        return sum(fault.amount for fault in self.acting(kind, now))

    def measured(self, state: VehicleState, now: float) -> VehicleState:
        """The state that the controller is given for the measured one. To be called in every cycle."""
        for fault in self.acting("frozen_state", now):
            state = self.frozen.setdefault(fault, state)
        if self.acting("nan_state", now):
            return VehicleState(x=nan, y=nan, phi=nan, v=nan, delta=nan)
        if self.acting("infinite_state", now):
            return VehicleState(x=inf, y=inf, phi=inf, v=inf, delta=inf)
        return _beside(state, self.total("state_jump", now))

    def goal(self, goal: Pose2 | None, now: float, path_end: Pose2) -> Pose2 | None:
        """The goal that the controller is given.

        The path's end where no goal is given after another one was.
        """
        if not any(f.kind in ("goal_jump", "goal_nan") and f.begin <= now + SAME_TIME for f in self.faults):
            return goal
        if self.acting("goal_nan", now):
            return unchecked_pose(nan, nan, nan)
        return (goal or path_end).compose(Pose2(0.0, self.total("goal_jump", now), 0.0))

    def detection(self, measurement: GoalMeasurement, now: float) -> GoalMeasurement:
        """A detection that arrives `now` [s]; its stamp is by the clock at the exposure."""
        if behind := self.total("clock_back", measurement.stamp):
            measurement = replace(measurement, stamp=measurement.stamp - behind)
        if self.acting("goal_nan", now):
            return replace(measurement, x=nan, y=nan, phi=nan)
        if aside := self.total("goal_jump", now):
            return _beside(measurement, aside)
        return measurement

    def clock(self, now: float, deadline: float | None) -> ForcedClock | None:
        """The clock of a cycle whose QPs go wrong, None in the others."""
        timed_out = bool(self.acting("solver_timeout", now))
        forced = timed_out or self.acting("solver_fail", now)
        return ForcedClock(deadline, timed_out=timed_out) if forced else None


def _beside(placed: Placed, left: float) -> Placed:
    x, y = placed.x - left * sin(placed.phi), placed.y + left * cos(placed.phi)
    return replace(placed, x=x, y=y)
