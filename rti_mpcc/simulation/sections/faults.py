"""[[faults]]: what goes wrong, from when to when, and how much.

A fault acts in every cycle at or after `from` and before `to` [s]; the two of the vehicle act in between
cycles too. Several may act at once: sizes of one kind add up. Nothing is random.

docs/scenario.md says what each kind does, and what its size is.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Literal, NamedTuple

from pydantic import Field

from rti_mpcc.simulation.plant import SAME_TIME, PlantFault
from rti_mpcc.simulation.sections.base import KeyProblem, Section

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


class Size(NamedTuple):
    """The size of a kind of fault: by default, and the open range that it has to lie in."""

    default: float
    above: float
    below: float


SIZES: dict[Kind, Size] = {
    "state_jump": Size(0.5, -100.0, 100.0),
    "late_cycles": Size(0.1, 0.0, 10.0),
    "clock_back": Size(3.0, 0.0, 1e6),
    "goal_jump": Size(0.5, -100.0, 100.0),
    "blocked": Size(5.0, 0.0, 1e3),
    "weak_brakes": Size(0.4, 0.0, 1.0),
}
"""Kinds that are not here have no size."""


class FaultSection(Section):
    """One fault, see the table of this module; it acts from `begin` until before `end` [s]."""

    kind: Kind
    begin: float = Field(alias="from", ge=0.0)
    end: float = Field(alias="to")
    size: float | None = None

    def _problems(self) -> Iterator[KeyProblem]:
        if self.end <= self.begin:
            yield KeyProblem("to", self.end, f"must be > from = {self.begin}")
        size = SIZES.get(self.kind)
        if size is not None and not size.above < self.amount < size.below:
            allowed = f"must be > {size.above:g} and < {size.below:g} for {self.kind}"
            yield KeyProblem("size", self.size, allowed)

    @property
    def amount(self) -> float:
        """The size, by default that of the kind; 0 where the kind has none."""
        if self.kind not in SIZES:
            return 0.0
        return SIZES[self.kind].default if self.size is None else self.size

    def acts(self, time: float) -> bool:
        """Whether it acts at this time [s]."""
        return self.begin <= time + SAME_TIME < self.end


def plant_faults(faults: Iterable[FaultSection]) -> tuple[PlantFault, ...]:
    """The faults of the vehicle itself, as the plant takes them."""
    made = []
    for fault in faults:
        if fault.kind == "stuck_steering":
            made.append(PlantFault(begin=fault.begin, end=fault.end, steering_share=0.0))
        if fault.kind == "weak_brakes":
            made.append(PlantFault(begin=fault.begin, end=fault.end, braking_share=fault.amount))
    return tuple(made)
