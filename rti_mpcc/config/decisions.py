"""When the vehicle does what on its segments, and how its plans are sought."""

from __future__ import annotations

from enum import Enum


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
