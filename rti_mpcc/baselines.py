"""What the method is compared with (paper IV): segments, objectives and weights, put together here.

The controller knows none of them: a method is the segments that it makes of a path, each with objectives of
its own, and settings.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf
from typing import ClassVar

import numpy as np

from geometry import InputError, ReferencePath
from geometry.doors import door
from rti_mpcc.config import ControllerConfig, Method, Weights
from rti_mpcc.manoeuvre import CUSP_TOLERANCE, FinalObjective, SegmentEnd, Segments, along
from rti_mpcc.ocp.objectives import Contouring, StageWeights, pose_weights, stage_share
from rti_mpcc.ocp.targets import Target
from rti_mpcc.types import Array, Objective

CONSTANT = {f"constant_{weight}": float(weight) for weight in (1, 50, 100)}
"""Contouring weights that stay the same to the path's end, with no planned arrival."""
METHODS = (*(method.value for method in Method), *CONSTANT)


def with_method(config: ControllerConfig, name: str) -> ControllerConfig:
    """The settings with a method, by the name that the command line has for it.

    Raises:
        InputError: an unknown one.
    """
    if name not in METHODS:
        raise InputError(f"method = {name!r}: must be one of {', '.join(METHODS)}")
    if name not in CONSTANT:
        return config.changed(method=Method(name))
    same = {"contouring": CONSTANT[name], "contouring_at_end": CONSTANT[name], "heading_at_end": 0.0}
    weights = config.weights.changed(**same)
    return config.changed(weights=weights, arrival=False)


@door()
def segments_of(path: ReferencePath, config: ControllerConfig) -> Segments:
    """The manoeuvre along a path, to its end or to a goal near it, by the method of the settings."""
    *before, last = along(path, config)
    if config.method is Method.SEPARATED:
        tolerance = CUSP_TOLERANCE
        staging = replace(last, end=SegmentEnd.STAGING_POSE, tolerance=tolerance)
        return (*before, staging, replace(last, final=FinalObjective(CartesianPose(), within=inf)))
    if config.method is Method.SWITCHED:
        final = FinalObjective(CartesianPose(), within=config.weights.transition_reach)
        return (*before, replace(last, objective=Contouring(to_goal=False), final=final))
    return (*before, last)


@dataclass(frozen=True, slots=True)
class CartesianPose:
    """The target's pose at the end of the cruise horizon, either way, whatever path and corridor are."""

    kind: ClassVar[Objective] = Objective.CARTESIAN
    along_path: ClassVar[bool] = False

    def horizon(self, at: float, config: ControllerConfig) -> float:
        """The cruise horizon [s]."""
        return config.cruise_horizon

    def ends(self, config: ControllerConfig) -> bool:
        """It does."""
        return True

    def weights(self, config: ControllerConfig, target: Target, theta: Array, lengths: Array) -> StageWeights:
        """See `cartesian_weights`."""
        return cartesian_weights(config.weights, lengths)


def cartesian_weights(weights: Weights, lengths: Array) -> StageWeights:
    """The goal pose at the horizon's end, whatever the path.

    The progress costs its square, so that it is determined.

    Args:
        lengths: (N,) of the stages [s].
    """
    share, goal = stage_share(lengths, weights), np.array(weights.goal)
    found = pose_weights(
        weights,
        share,
        share,
        comfort=weights.comfort,
        goal=goal,
        goal_speed=0.0,
        goal_clipped=False,
        scale=1.0 / (max(float(goal.max()), weights.acceleration * float(share.max())) or 1.0),
    )
    return replace(found, virtual_speed=weights.lag * share[:-1])
