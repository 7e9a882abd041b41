"""What an objective or a cost term of your own needs: all names of docs/tutorials/own_objective.md."""

from __future__ import annotations

from geometry.settings import NonNegative, Positive
from rti_mpcc.config import CostTerm, DockingObjective
from rti_mpcc.model.layout import DELTA, DELTA_DOT, PHI, THETA, THETA_DOT, A, V, X, Y
from rti_mpcc.ocp.objectives import (
    STAGE_LENGTH,
    Contouring,
    HorizonObjective,
    Linearised,
    StageWeights,
    Target,
    goal_pull,
)
from rti_mpcc.ocp.stage_cost import Residual

__all__ = [
    "DELTA",
    "DELTA_DOT",
    "PHI",
    "STAGE_LENGTH",
    "THETA",
    "THETA_DOT",
    "A",
    "Contouring",
    "CostTerm",
    "DockingObjective",
    "HorizonObjective",
    "Linearised",
    "NonNegative",
    "Positive",
    "Residual",
    "StageWeights",
    "Target",
    "V",
    "X",
    "Y",
    "goal_pull",
]
