"""How a vehicle comes to its goal, and what its arrivals are like."""

from __future__ import annotations

from enum import Enum
from typing import Literal


class Method(Enum):
    """How a vehicle comes from the path to its goal pose: the method, and what it is compared with.

    All of it but the objective is the same code.
    """

    DYNAMIC = "dynamic"
    """Dynamic weights and objective (paper III), with no stop on the way."""
    SEPARATED = "separated"
    """Contouring to a stop at a staging pose on the path; from there a Cartesian objective (paper IV)."""
    SWITCHED = "switched"
    """Contouring, and from `Weights.transition_reach` of way left on a Cartesian objective (paper IV)."""


Ride = Literal["smooth", "brisk"]
"""What an arrival is to be like, within comfort.

smooth: of least acceleration energy; its acceleration falls evenly, and is that of comfort at either end.
brisk: of least time, with the comfort acceleration as far as its jerk allows; some 15 % shorter.
"""
