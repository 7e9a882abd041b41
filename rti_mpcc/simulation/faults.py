"""[[faults]]: what goes wrong, from when to when, and how much.

A fault acts in every cycle at or after `from` and before `to` [s]; the two of the vehicle (`plant_faults`)
act in between cycles too, the others between the vehicle and its controller (`Disturbances`). Several may act
at once: sizes of one kind add up. Nothing is random.

docs/scenario.md says what each kind does, and what its size is.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from math import cos, inf, nan, sin
from typing import Literal, TypeVar

from pydantic import Field

from estimation import GoalMeasurement
from geometry import Pose2
from geometry.pose import unchecked_pose
from rti_mpcc.clock import TIME_IS_UP, CycleClock
from rti_mpcc.qp.solver import Stop
from rti_mpcc.simulation.plant import SAME_TIME, PlantFault
from rti_mpcc.simulation.sections.base import KeyProblem, Section
from rti_mpcc.types import VehicleState

Placed = TypeVar("Placed", VehicleState, GoalMeasurement)
Kind = Literal[
    "nan_state",
    "infinite_state",
    "frozen_state",
    "state_jump",
    "lost_cycles",
    "late_cycles",
    "clock_back",
    "solver_fail",
    "solver_timeout",
    "goal_jump",
    "goal_nan",
    "blocked",
    "stuck_steering",
    "weak_brakes",
]
SIZES: dict[Kind, tuple[float, float, float]] = {
    "state_jump": (0.5, -100.0, 100.0),
    "late_cycles": (0.1, 0.0, 10.0),
    "clock_back": (3.0, 0.0, 1e6),
    "goal_jump": (0.5, -100.0, 100.0),
    "blocked": (5.0, 0.0, 1e3),
    "weak_brakes": (0.4, 0.0, 1.0),
}
"""Default size and the open range it has to lie in; other kinds have no size."""

FAILED = Stop("forced to fail", 0)
_TIMED_OUT = Stop(TIME_IS_UP, 0)  # after no iteration: after a few iterations a QP may be solved


class FaultSection(Section):
    """One fault; it acts from `begin` until before `end` [s]."""

    kind: Kind
    begin: float = Field(alias="from", ge=0.0)
    end: float = Field(alias="to")
    size: float | None = None

    def _problems(self) -> Iterator[KeyProblem]:
        if self.end <= self.begin:
            yield KeyProblem("to", self.end, f"must be > from = {self.begin}")
        if self.kind in SIZES:
            _, above, below = SIZES[self.kind]
            if not above < self.amount < below:
                yield KeyProblem("size", self.size, f"must be > {above:g} and < {below:g} for {self.kind}")

    @property
    def amount(self) -> float:
        """The size, by default that of the kind; 0 where the kind has none."""
        if self.kind not in SIZES:
            return 0.0
        return SIZES[self.kind][0] if self.size is None else self.size

    def acts(self, time: float) -> bool:
        """Whether it acts at this time [s]."""
        return self.begin <= time + SAME_TIME < self.end


def plant_faults(faults: Iterable[FaultSection]) -> tuple[PlantFault, ...]:
    """The faults of the vehicle itself, as the plant takes them."""
    shares = {"stuck_steering": "steering_share", "weak_brakes": "braking_share"}
    some = [fault for fault in faults if fault.kind in shares]
    return tuple(PlantFault(begin=f.begin, end=f.end, **{shares[f.kind]: f.amount}) for f in some)


class ForcedClock(CycleClock):
    """A wall clock that ends every QP before it starts.

    The QPs fail, or, if `timed_out`, are stopped by their time limit and the deadline [s] is missed.
    """

    def __init__(self, deadline: float | None, *, timed_out: bool) -> None:
        super().__init__(deadline)
        self._timed_out, self._late = timed_out, timed_out or None

    def stop(self) -> Stop:
        """How every QP ends."""
        return _TIMED_OUT if self._timed_out else FAILED


@dataclass(slots=True, kw_only=True)
class Disturbances:
    """The faults of a run between vehicle and controller; `frozen`: the state of each `frozen_state`."""

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
            return VehicleState(nan, nan, nan, nan, nan)
        if self.acting("infinite_state", now):
            return VehicleState(inf, inf, inf, inf, inf)
        return _beside(state, self.total("state_jump", now))

    def goal(self, goal: Pose2 | None, now: float, path_end: Pose2) -> Pose2 | None:
        """The goal that the controller is given: the path's end where none is given after another one was."""
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
        aside = self.total("goal_jump", now)
        return _beside(measurement, aside) if aside else measurement

    def clock(self, now: float, deadline: float | None) -> ForcedClock | None:
        """The clock of a cycle whose QPs go wrong, None in the others."""
        timed_out = bool(self.acting("solver_timeout", now))
        forced = timed_out or self.acting("solver_fail", now)
        return ForcedClock(deadline, timed_out=timed_out) if forced else None


def _beside(placed: Placed, left: float) -> Placed:
    x, y = placed.x - left * sin(placed.phi), placed.y + left * cos(placed.phi)
    return replace(placed, x=x, y=y)
