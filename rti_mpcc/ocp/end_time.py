"""The end T of a plan that arrives at rest, as a variable of the QP.

(T4)  J = sum over stages of h_k E_k + w_T T,   E_k the cost of effort and comfort of stage k a second.

With E = w_a a² and a free end the Hamiltonian is 0 at the end: a straight arrival ends at a² = w_T / w_a. So
w_T = w_a a_planned² asks for an end at the planned acceleration, whatever the speed at its start, and bends,
narrow places and comfort set T by themselves.

All stages but the first, which lasts a cycle, are stretched alike, h_k' = h_k / (T - h_0):

(T5)  F_T = h_k' f(z_k+1, u_k),   dJ/dT = w_T + sum of h_k' E_k,   d²J/dT² = 2 / (T - h_0)² sum of h_k E_k,

f being (M1). The progress keeps to its stages: its rate is scaled with them, so that what holds the progress
does not hold T. The curvature is what keeps a full step from overshooting: over a given way the effort goes
with 1 / T³.
"""

from __future__ import annotations

from math import tan
from typing import NamedTuple

import numpy as np

from geometry.compiled import Array1, Array2, Out1, Out2, kernel
from rti_mpcc.config import Comfort
from rti_mpcc.model.bicycle import pose_rate
from rti_mpcc.model.layout import DELTA, DELTA_DOT, PHI, A, V, X, Y
from rti_mpcc.ocp.horizon import PlanStages
from rti_mpcc.ocp.objectives import ComfortWeights, StageWeights
from rti_mpcc.ocp.stage_cost import excess_cost
from rti_mpcc.types import Array

LEAST_TIME = 1.0
"""To go, at least: closer in, the plan always ends this far ahead [s]."""
LARGEST_CHANGE = 0.1
"""Of T, in one iteration."""


class EndTime(NamedTuple):
    """What the QP needs of dT: (T5).

    Attributes:
        stretches: (N, 5) F_T, of x, y, phi, v, delta [1/s].
        gradient, curvature: of J; least, most: bounds on dT [s].
    """

    stretches: Out2
    gradient: float
    curvature: float
    least: float
    most: float


FIXED_END = EndTime(np.empty((0, 5)), 0.0, 0.0, 0.0, 0.0)
"""Where dT = 0."""


def end_time(
    stages: PlanStages,
    reached: Array,
    weights: StageWeights,
    comfort: Comfort,
    wheelbase: float,
    latest: float,
) -> EndTime:
    """(T5) about a plan.

    Args:
        reached: (N, 6) ends of the stages; latest: that the plan may take [s].
    """
    lengths, on_controls = stages.lengths, np.array((weights.acceleration, weights.steering_rate))
    total = float(lengths.sum())
    stretches, effort = _stretched(stages, reached, on_controls, weights.comfort, comfort, wheelbase)
    rest = total - float(lengths[0])
    least = min(max(-LARGEST_CHANGE * total, LEAST_TIME - total), 0.0)
    longest = min(LARGEST_CHANGE * total, max(latest - total, least))
    return EndTime(stretches, weights.time + effort / rest, 2.0 * effort / rest**2, least, longest)


@kernel
def _stretched(
    stages: PlanStages, reached: Array2, on_controls: Array2, beyond: ComfortWeights, comfort: Comfort,
    wheelbase: float,
) -> tuple[Out2, float]:  # fmt: skip
    """F_T, and the sum of h_k E_k over all stages but the first; `on_controls` (2, N): a and delta_dot."""
    states, controls, lengths = stages
    stretches, effort, rest = np.zeros((len(lengths), 5)), 0.0, np.sum(lengths[1:])
    for k in range(1, len(lengths)):
        a, rate, v = controls[k, A], controls[k, DELTA_DOT], states[k, V]
        dx, dy, turn = pose_rate(reached[k], wheelbase)
        share = lengths[k] / rest
        stretches[k, X], stretches[k, Y], stretches[k, PHI] = share * dx, share * dy, share * turn
        stretches[k, V], stretches[k, DELTA] = share * a, share * rate
        effort += on_controls[A, k] * a * a + on_controls[DELTA_DOT, k] * rate * rate
        effort += excess_cost(a, beyond.acceleration[k], comfort.acceleration)
        effort += excess_cost(rate, beyond.steering_rate[k], comfort.steering_rate)
        lateral = v * v * tan(states[k, DELTA]) / wheelbase
        effort += excess_cost(lateral, beyond.lateral_acceleration[k], comfort.lateral_acceleration)
    return stretches, effort


@kernel
def stretched_times(begin: float, lengths: Array1, change: float) -> Out1:
    """Times (N+1,) [s] of the stages' ends from `begin` [s] on, with T changed by so much [s]."""
    times, factor = np.empty(len(lengths) + 1), 1.0 + change / np.sum(lengths[1:])
    times[0], times[1] = begin, begin + lengths[0]
    for k in range(1, len(lengths)):
        times[k + 1] = times[k] + factor * lengths[k]
    return times
