"""What the faults of a run make of all that passes between the vehicle and its controller."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import cos, inf, nan, sin

from estimation import GoalMeasurement
from geometry import Pose2
from rti_mpcc.simulation.faults import FaultSection, Kind
from rti_mpcc.simulation.forced_clock import ForcedClock
from rti_mpcc.simulation.goal_feed import Given
from rti_mpcc.simulation.plant import SAME_TIME
from rti_mpcc.types import VehicleState


@dataclass(slots=True, kw_only=True)
class Disturbances:
    """The faults of a run on its clock, but for those of plant and scenery, which know them themselves.

    Attributes:
        faults: all of the run.
        frozen: the measured state that each `frozen_state` holds.
    """

    faults: tuple[FaultSection, ...]
    frozen: dict[FaultSection, VehicleState] = field(default_factory=dict)

    def acting(self, kind: Kind, now: float) -> list[FaultSection]:
        """Those of a kind that act at `now` [s]."""
        return [fault for fault in self.faults if fault.kind == kind and fault.acts(now)]

    def total(self, kind: Kind, now: float) -> float:
        """Sum of the sizes of those that act."""
        return sum(fault.amount for fault in self.acting(kind, now))

    def measured(self, state: VehicleState, now: float) -> VehicleState:
        """What the controller is told of the state that was measured. To be asked in every cycle."""
        for fault in self.acting("frozen_state", now):
            state = self.frozen.setdefault(fault, state)
        if self.acting("nan_state", now):
            return VehicleState(x=nan, y=nan, phi=nan, v=nan, delta=nan)
        if self.acting("infinite_state", now):
            return VehicleState(x=inf, y=inf, phi=inf, v=inf, delta=inf)
        x, y = _beside(state.x, state.y, state.phi, self.total("state_jump", now))
        return replace(state, x=x, y=y)

    def given(self, given: Given, now: float, path_end: Pose2, *, detected: bool) -> Given:
        """What the controller is told of the goal, by its detections or as it is.

        No goal at all is the path's end, which has to be said once another one was told.
        """
        if detected:
            return given._replace(measurements=tuple(self._detected(m, now) for m in given.measurements))
        if not any(f.kind in ("goal_jump", "goal_nan") and f.begin <= now + SAME_TIME for f in self.faults):
            return given
        if self.acting("goal_nan", now):
            return given._replace(goal=_pose_without_numbers())
        aside = Pose2(0.0, self.total("goal_jump", now), 0.0)
        return given._replace(goal=(given.goal or path_end).compose(aside))

    def _detected(self, measurement: GoalMeasurement, now: float) -> GoalMeasurement:
        """A detection that arrives `now` [s]; its stamp is by the clock at the exposure."""
        if behind := self.total("clock_back", measurement.stamp):
            measurement = replace(measurement, stamp=measurement.stamp - behind)
        if self.acting("goal_nan", now):
            return replace(measurement, x=nan, y=nan, phi=nan)
        if aside := self.total("goal_jump", now):
            x, y = _beside(measurement.x, measurement.y, measurement.phi, aside)
            return replace(measurement, x=x, y=y)
        return measurement

    def clock(self, now: float, deadline: float | None) -> ForcedClock | None:
        """The clock of a cycle whose QPs go wrong, None in the others."""
        timed_out = bool(self.acting("solver_timeout", now))
        forced = timed_out or self.acting("solver_fail", now)
        return ForcedClock(deadline, timed_out=timed_out) if forced else None


def _beside(x: float, y: float, phi: float, left: float) -> tuple[float, float]:
    """The point so far to the left of a pose [m]."""
    return x - left * sin(phi), y + left * cos(phi)


def _pose_without_numbers() -> Pose2:
    """A pose of NaN, made around the check that refuses it: as one that was read from a broken message."""
    pose = object.__new__(Pose2)
    for name in ("x", "y", "phi"):
        object.__setattr__(pose, name, nan)
    return pose
