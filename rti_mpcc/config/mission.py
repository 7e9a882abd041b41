"""How missions are driven."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from geometry.settings import NonNegative, Settings, Short


class MissionSettings(Settings):
    """When a step of a mission is over, and what a retry does.

    Attributes:
        settled: a step is over once the vehicle has stood at its end for so long [s].
        back_off: distance that a vehicle drives out of a dock, at least, before it tries again [m].
    """

    settled: NonNegative = 0.5
    back_off: Annotated[Short, Field(gt=0.0)] = 3.0
