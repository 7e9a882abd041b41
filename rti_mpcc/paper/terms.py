"""Cost terms of the published code, and what blended weights add to the gradient.

(W7)  q_lat a_lat² + sum over left and right of
      q_d max(0, 2 m - distance)² + q_v v² max(0, 2.5 m - distance)²,   a_lat = v² tan(delta)/L

for the distance of the rear axle to the boundary. The slopes of weights that are functions of their stage's
theta, where sigma blends them, are in the gradient: a plan that knows that a reward ends does not hurry where
hurrying gains nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import tan
from typing import NamedTuple

import numpy as np

from geometry.compiled import Array2, Out1, Out2, Out3, kernel
from geometry.contacts import ACROSS, ALONG, APART
from geometry.corridor import space_around
from geometry.free_space import contacts_in
from geometry.shape_grid import POINT
from rti_mpcc.model.layout import DELTA, PHI, POSE, STATES, THETA, THETA_DOT, V, X, Y
from rti_mpcc.ocp.frenet import CONTOURING, HEADING, FrenetErrors
from rti_mpcc.ocp.objectives import Linearised, StageWeights
from rti_mpcc.ocp.stage_cost import add_square
from rti_mpcc.types import Array

DISTANCE_REACH, SPEED_REACH = 2.0, 2.5  # the two terms of a boundary act nearer than this [m]


class WeightSlopes(NamedTuple):
    """How the weights that are blended by sigma change with their stage's own progress [1/m], (N+1,) each."""

    contouring: Out1
    heading: Out1
    bound_distance: Out1
    progress_reward: Out1


@dataclass(frozen=True, slots=True, kw_only=True)
class PaperWeights(StageWeights):
    """Weights of stages with those of (W7), (N+1,) each; `by_progress`: their slopes where they are
    blended."""

    lateral_acceleration: Array
    bound_distance: Array
    bound_speed: Array
    by_progress: WeightSlopes | None = None


class SoftWalls(NamedTuple):
    """Signed distances (N+1, 2) of the rear axle to the left and the right [m], normals (N+1, 2, 2)."""

    distance: Out2
    normal: Out3


def walls_of(plan: Linearised) -> SoftWalls:
    """Boundaries nearest to the rear axle at stages 0..N, at infinity where (W7) has no weights on them."""
    weights = plan.weights
    assert isinstance(weights, PaperWeights)
    if not (weights.bound_distance.any() or weights.bound_speed.any()):
        return SoftWalls(np.full((len(plan.states), 2), np.inf), np.zeros((len(plan.states), 2, 2)))
    reach = max(DISTANCE_REACH, SPEED_REACH)
    poses, space = plan.states[:, :POSE].copy(), space_around(plan.corridor, plan.index)
    found = contacts_in(space, POINT, poses, within=reach, outward=0.0)[:, 0, :2]
    normal = (found[..., ALONG] + 1j * found[..., ACROSS]) * np.exp(1j * plan.local[:, PHI])[:, None]
    return SoftWalls(
        distance=np.ascontiguousarray(found[..., APART]),
        normal=normal.view(np.float64).reshape(*normal.shape, 2),
    )


def add_paper_terms(
    states: Array, weights: PaperWeights, walls: SoftWalls, wheelbase: float, hessian: Array, gradient: Array
) -> None:
    """Add (W7) at `states` (N+1, 6)."""
    on_terms = np.array((weights.lateral_acceleration, weights.bound_distance, weights.bound_speed))
    _add_terms(states, walls, on_terms, wheelbase, hessian, gradient)


def add_weight_slopes(
    errors: FrenetErrors | None, controls: Array, walls: SoftWalls, weights: PaperWeights, gradient: Array
) -> None:
    """Add what the slopes of the weights make of the errors and of `controls` (N, 3)."""
    if weights.by_progress is not None and errors is not None:
        _add_slopes(errors.values, controls, walls.distance, weights.by_progress, gradient)


@kernel
def _add_terms(
    states: Array2, walls: SoftWalls, weights: Array2, wheelbase: float, hessian: Out3, gradient: Out2
) -> None:
    """Equation (W7), `weights` (3, N+1) on lateral acceleration, distance and speed by a boundary."""
    distances, normals = walls
    for k in range(len(states)):
        v, tangent = states[k, V], tan(states[k, DELTA])
        slopes = np.zeros(STATES)
        slopes[V] = 2.0 * v * tangent / wheelbase
        slopes[DELTA] = v * v * (1.0 + tangent * tangent) / wheelbase
        add_square(hessian, gradient, k, weights[0, k], v * v * tangent / wheelbase, slopes)
        for side in range(2):
            near = max(DISTANCE_REACH - distances[k, side], 0.0)
            slow = max(SPEED_REACH - distances[k, side], 0.0)
            slopes[:] = 0.0
            if near > 0.0:
                slopes[X], slopes[Y] = -normals[k, side, X], -normals[k, side, Y]
                add_square(hessian, gradient, k, weights[1, k], near, slopes)
            if slow > 0.0:
                slopes[X], slopes[Y] = -normals[k, side, X] * v, -normals[k, side, Y] * v
                slopes[V] = slow
                add_square(hessian, gradient, k, weights[2, k], v * slow, slopes)


@kernel
def _add_slopes(
    errors: Array2, controls: Array2, distances: Array2, by: WeightSlopes, gradient: Out2
) -> None:
    """What the cost of each stage gains by progress as its weights change with it."""
    for k in range(len(errors)):
        gain = by.contouring[k] * errors[k, CONTOURING] ** 2 + by.heading[k] * errors[k, HEADING] ** 2
        if k < len(controls):
            gain -= by.progress_reward[k] * controls[k, THETA_DOT]
        gradient[k, THETA] += gain
        for side in range(2):
            near = max(DISTANCE_REACH - distances[k, side], 0.0)
            gradient[k, THETA] += by.bound_distance[k] * near**2
