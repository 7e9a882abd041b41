"""How missions are driven."""

from __future__ import annotations

from typing import Annotated, ClassVar

from pydantic import Field

from geometry.settings import CONSTANT, NonNegative, Settings, Short


class MissionSettings(Settings):
    """When a step of a mission is over, and what a retry does.

    Attributes:
        settled: a step is over once the vehicle has stood at its end for so long [s].
        back_off: distance that a vehicle drives out of a dock, at least, before it tries again [m].
    """

    former: ClassVar = {
        "body_moved straight_end out_tolerance out_straights out_bends out_undone out_sides out_ends spacing "
        "beside headings": CONSTANT,
    }

    settled: NonNegative = 0.5
    back_off: Annotated[Short, Field(gt=0.0)] = 3.0
