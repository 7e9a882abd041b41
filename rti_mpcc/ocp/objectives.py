"""What a QP asks for, and the weights of its stages: dynamic weight and dynamic objective allocation.

(W1)  sigma(eps) = 1 / (1 + exp(alpha (eps - beta)))                                    (paper Eq. 7)

All objectives give weights of one type, so everything behind them is shared, and one more needs no line
elsewhere. Stage weights already contain the stage's share h_k / stage_length.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, NamedTuple, Protocol, runtime_checkable

import numpy as np
from scipy.special import expit

from rti_mpcc.config import ControllerConfig, Weights
from rti_mpcc.ocp.targets import Target, TargetKind
from rti_mpcc.types import Array, Objective


@dataclass(frozen=True, slots=True, kw_only=True)
class WeightSlopes:
    """How the weights that sigma blends change with their stage's own progress [1/m], (N+1,) each: (W6).

    A plan that knows them knows that a reward ends: it does not hurry where hurrying gains nothing.
    """

    contouring: Array
    heading: Array
    bound_distance: Array
    progress_reward: Array


class ComfortWeights(NamedTuple):
    """On the squared excess over each value of `Comfort`: (N,), (N+1,), (N,)."""

    acceleration: Array
    lateral_acceleration: Array
    steering_rate: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class StageWeights:
    """Effective weights: (N+1,) on states, (N,) on controls, goal (3,), goal_speed and goal_wheels at stage N
    only.
    `comfort` is on what goes beyond `Comfort`.

    `by_progress` has their slopes where they are blended. `slack` is the linear weight of the corridor slack
    [1/m] of (H3), above the largest pull that could press the body against a boundary: the penalty is exact.
    `scale` brings the QP's cost to size.
    """

    lag: Array
    contouring: Array
    heading: Array
    lateral_acceleration: Array
    bound_distance: Array
    bound_speed: Array
    acceleration: Array
    steering_rate: Array
    virtual_speed: Array
    progress_reward: Array
    comfort: ComfortWeights
    goal: Array
    goal_speed: float
    goal_clipped: bool
    slack: float
    scale: float
    by_progress: WeightSlopes | None = None
    goal_wheels: float = 0.0

    @property
    def follows_path(self) -> bool:
        """Whether any stage counts its Frenet errors."""
        return bool(self.lag.any() or self.contouring.any() or self.heading.any())


@runtime_checkable
class HorizonObjective(Protocol):
    """What the QP of a cycle asks for.

    Attributes:
        kind: what the diagnostics call it.
        along_path: corridor, room and the part's direction count; otherwise only its target does.
    """

    kind: ClassVar[Objective]
    along_path: ClassVar[bool]

    def horizon(self, at: float, config: ControllerConfig) -> float:
        """Length of a plan that begins `at` [s]."""

    def ends(self, config: ControllerConfig) -> bool:
        """Whether the progress ends at the target's stop."""

    def weights(self, config: ControllerConfig, target: Target, theta: Array, lengths: Array) -> StageWeights:
        """Weights at progress `theta` (N+1,) [m] of stages of these `lengths` (N,) [s]."""


@dataclass(frozen=True, slots=True)
class Contouring:
    """Along the path over the cruise horizon, paper Eq. 5.

    Attributes:
        to_goal: a goal beside or behind the path pulls (Eq. 9 to 11); otherwise the path ends where the goal
            lies beside it (Eq. 8).
    """

    kind: ClassVar[Objective] = Objective.CONTOURING
    along_path: ClassVar[bool] = True
    to_goal: bool = True

    def horizon(self, at: float, config: ControllerConfig) -> float:
        """The cruise horizon [s]."""
        return config.cruise_horizon

    def ends(self, config: ControllerConfig) -> bool:
        """Where no planned arrival follows; a cruise goes on along the extrapolated path."""
        return not config.arrival

    def weights(self, config: ControllerConfig, target: Target, theta: Array, lengths: Array) -> StageWeights:
        """See `contouring_weights`."""
        return contouring_weights(
            config.weights,
            target if self.to_goal else replace(target, kind=TargetKind.PATH_END),
            theta,
            lengths,
            cruise_speed=config.cruise_speed,
            clip_goal=config.corridor_rows,
            allocate=not config.arrival,
            effort=config.cruise_effort,
        )


CONTOURING = Contouring()


@dataclass(frozen=True, slots=True)
class ArrivalAtRest:
    """One arrival at rest at the target, at the horizon's end.

    Attributes:
        at: when that is [s].
    """

    kind: ClassVar[Objective] = Objective.ARRIVAL
    along_path: ClassVar[bool] = True
    at: float

    def horizon(self, at: float, config: ControllerConfig) -> float:
        """The time to go [s]."""
        return self.at - at

    def ends(self, config: ControllerConfig) -> bool:
        """It does."""
        return True

    def weights(self, config: ControllerConfig, target: Target, theta: Array, lengths: Array) -> StageWeights:
        """See `arrival_weights`."""
        return arrival_weights(config.weights, target, theta, lengths, config.arrival_comfort)


def sigma(distance: Array | float, weights: Weights) -> Array:
    """Equation (W1): near 1 closer than beta [m], near 0 beyond."""
    return np.asarray(
        expit(-weights.transition_slope * (np.asarray(distance) - weights.transition_reach)), dtype=np.float64
    )


def contouring_weights(
    weights: Weights,
    target: Target,
    theta: Array,
    lengths: Array,
    *,
    cruise_speed: float,
    clip_goal: bool,
    allocate: bool = True,
    effort: float | None = None,
) -> StageWeights:
    """Contouring with dynamic weights: (W2), paper Eq. 8, where the path's end is the goal, else (W3).

    Args:
        theta: (N+1,) progress of the plan that is linearised about [m].
        lengths: (N,) of the stages [s].
        cruise_speed: where the progress reward has its best if the weights leave virtual_speed open [m/s].
        clip_goal: whether the goal's pull is bounded (where corridor rows act).
        allocate: False leaves all weights as they are far from the end: a cruise that will turn to a
            planned arrival in time.
        effort: on the squared acceleration; None: that of `weights`.
    """
    share = stage_share(lengths, weights)
    effort = weights.acceleration if effort is None else effort
    near = sigma(target.stop - theta, weights) * allocate
    nearing = weights.transition_slope * near * (1.0 - near) * share  # d sigma / d theta
    if target.kind is TargetKind.PATH_END or not allocate:  # Eq. 8
        lag = np.full_like(near, weights.lag)
        contouring = near * weights.contouring_at_end + (1.0 - near) * weights.contouring
        heading = weights.heading + near * weights.heading_at_end
        reward = np.full_like(near, weights.progress_reward)
        goal = np.zeros(3)
        terminal = 1.0
        slopes = WeightSlopes(
            contouring=nearing * (weights.contouring_at_end - weights.contouring),
            heading=nearing * weights.heading_at_end,
            bound_distance=-nearing * weights.bound_distance,
            progress_reward=np.zeros_like(near),
        )
    else:  # Eq. 9, 10; Eq. 11 is the same with the Frenet costs off from the stop point on
        ahead = (theta < target.stop).astype(np.float64)
        lag = weights.lag * ahead
        contouring = (1.0 - near) * weights.contouring * ahead
        heading = np.full_like(near, weights.heading) * ahead
        reward = (1.0 - near) * weights.progress_reward
        goal = sigma(target.stop - theta[0], weights) * np.array(weights.goal)
        terminal = float(ahead[-1])
        slopes = WeightSlopes(
            contouring=-nearing * weights.contouring * ahead,
            heading=np.zeros_like(near),
            bound_distance=-nearing * weights.bound_distance,
            progress_reward=-nearing * weights.progress_reward,
        )
    virtual_speed = reward / (2.0 * cruise_speed)
    if weights.virtual_speed is not None:
        virtual_speed = np.full_like(near, weights.virtual_speed)
    states = StageWeights(
        lag=lag * share,
        contouring=contouring * share,
        heading=heading * share,
        lateral_acceleration=weights.lateral_acceleration * share,
        bound_distance=weights.bound_distance * (1.0 - near) * share,
        bound_speed=weights.bound_speed * share,
        acceleration=effort * share[:-1],
        steering_rate=weights.steering_rate * share[:-1],
        virtual_speed=virtual_speed[:-1] * share[:-1],
        progress_reward=reward[:-1] * share[:-1],
        comfort=_comfort_weights(share, weights.comfort),
        goal=goal,
        goal_speed=0.0,
        goal_clipped=clip_goal,
        slack=2.0 * (weights.progress_reward / weights.stage_length + _goal_pull(goal, weights)),
        scale=1.0 / (max(max(weights.lag, effort) * share.max(), weights.terminal_lag, goal.max()) or 1.0),
        by_progress=slopes if allocate else None,
    )
    states.lag[-1] += terminal * weights.terminal_lag
    states.heading[-1] += terminal * weights.terminal_heading
    return states


def arrival_weights(
    weights: Weights,
    target: Target,
    theta: Array,
    lengths: Array,
    comfort: tuple[float, float, float] | None = None,
) -> StageWeights:
    """One planned arrival at rest at the target at the horizon's end: (W5), docs/method.md.

    Args as `contouring_weights`; comfort: weights on what goes beyond it, None: those of `weights`.
    """
    share = stage_share(lengths, weights)
    firm = min(1.0, float(lengths.sum()) / weights.firm_time) ** 3
    found = pose_weights(
        weights,
        share,
        share * firm,
        comfort=weights.arrival_comfort if comfort is None else comfort,
        goal=np.full(3, weights.arrival_pose),
        goal_speed=weights.arrival_speed,
        goal_clipped=True,
        scale=1.0 / weights.arrival_pose,
    )
    if target.wheels is not None:
        found = replace(found, goal_wheels=target.wheels_share * weights.arrival_wheels)
    if weights.arrival_contouring == 0.0:
        return found
    on_path = (1.0 - sigma(target.stop - theta, weights)) * (theta < target.stop)
    contouring = weights.arrival_contouring * on_path * share
    return replace(found, contouring=contouring, lag=weights.lag * (contouring > 0.0) * share)


def pose_weights(
    weights: Weights,
    share: Array,
    effort: Array,
    *,
    comfort: tuple[float, float, float],
    goal: Array,
    goal_speed: float,
    goal_clipped: bool,
    scale: float,
) -> StageWeights:
    """The target's pose at the horizon's end for little effort, whatever the path.

    Args:
        share: (N+1,) that stages count; effort: (N+1,) that effort and comfort count at them.
        comfort: weights on what goes beyond it; goal, goal_speed, goal_clipped, scale: see `StageWeights`.
    """
    none = np.zeros_like(share)
    return StageWeights(
        lag=none,
        contouring=none,
        heading=none,
        lateral_acceleration=weights.lateral_acceleration * share,
        bound_distance=none,
        bound_speed=none,
        acceleration=weights.acceleration * effort[:-1],
        steering_rate=weights.steering_rate * effort[:-1],
        virtual_speed=none[:-1],
        progress_reward=none[:-1],
        comfort=_comfort_weights(effort, comfort),
        goal=goal,
        goal_speed=goal_speed,
        goal_clipped=goal_clipped,
        slack=2.0 * _goal_pull(goal, weights),
        scale=scale,
    )


def stage_share(lengths: Array, weights: Weights) -> Array:
    """What each stage counts (N+1,): its length over the length that the weights belong to."""
    share = np.empty(len(lengths) + 1)
    share[:-1], share[-1] = lengths, lengths[-1]
    share /= weights.stage_length
    return share


def _comfort_weights(share: Array, weights: tuple[float, float, float]) -> ComfortWeights:
    """Weights on what goes beyond comfort, at stages that count `share` (N+1,)."""
    acceleration, lateral, steering = weights
    return ComfortWeights(acceleration * share[:-1], lateral * share, steering * share[:-1])


def _goal_pull(goal: Array, weights: Weights) -> float:
    """Largest gradient of the clipped cost of a `goal` (3,) of weights per metre of body motion [1/m]."""
    position, heading = weights.goal_clip
    return float(2.0 * (max(goal[0], goal[1]) * position + goal[2] * heading))
