"""How missions are driven."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from geometry.settings import NonNegative, Positive, Settings, Short, Tolerance

Share = Annotated[float, Field(ge=0.0, lt=1.0)]
Bend = Annotated[float, Field(ge=-1.0, le=1.0)]


class MissionSettings(Settings):
    """When a step of a mission is over, and how it is begun.

    Attributes:
        settled: so long a vehicle stands where a step ends before that is over [s].
        body_moved: what is docked at is told anew where the dock is detected so far from where it was told:
            longitudinal [m], lateral [m], heading [rad].
        straight_end: how near to its end a straight move stands [m]: what is to be touched is no farther.
        back_off: so far a vehicle drives out of a dock, at least, before it docks there once more [m].
        out_tolerance: what counts as the end of a way out: longitudinal [m], lateral [m], heading [rad].
        out_straights: shares of a way out before its bend, other than all of it; out_bends: in the sharpest
            bend that ways take, to the left or the right; out_undone: shares of a bend that go to the other
            side; out_sides: how far off the way straight on its end may be where it is not driven to directly
            [rad]; all in the order in which they are tried.
        out_ends: so many ends of ways out are tried at most.
        spacing: of the poses on a straight move or a way out at which the room is looked at [m]; beside:
            what is farther from the body is not beside it [m].
        headings: so many headings at the end of a straight move are looked at.
    """

    settled: NonNegative = 0.5
    body_moved: Tolerance = (0.1, 0.1, 0.05)
    straight_end: Positive = 0.03
    back_off: Annotated[Short, Field(gt=0.0)] = 3.0
    out_tolerance: Tolerance = (0.2, 0.2, 0.1)
    out_straights: tuple[Share, ...] = (0.75, 0.5, 0.25, 0.0)
    out_bends: tuple[Bend, ...] = (0.5, -0.5, 1.0, -1.0)
    out_undone: tuple[Annotated[float, Field(ge=0.0, le=0.5)], ...] = (0.0, 0.5, 0.35)
    out_sides: tuple[Annotated[float, Field(ge=-1.5, le=1.5)], ...] = (0.4, -0.4, 0.7, -0.7, 1.0, -1.0)
    out_ends: Annotated[int, Field(ge=1, le=1000)] = 8
    spacing: Annotated[float, Field(ge=0.001, le=1.0)] = 0.05
    beside: Positive = 1.0
    headings: Annotated[int, Field(ge=2, le=10_000)] = 21
