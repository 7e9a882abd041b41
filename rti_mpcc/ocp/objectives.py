"""What a QP asks for: what its part is to end in, its objective, and the weights of its stages.

A one-direction part ends in its own end, in a stop on it, or in a goal pose beside or behind it.

All objectives give weights of one type, so everything behind them is shared, and one more needs no line
elsewhere. Stage weights already contain the stage's share h_k / stage length.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property
from math import hypot, inf
from typing import ClassVar, NamedTuple

import numpy as np

from geometry import Corridor, PathPart, PathReference, Pose2, lift
from geometry.compiled import Out1
from rti_mpcc.config import ControllerConfig, Weights
from rti_mpcc.ocp.bounds import StageBounds
from rti_mpcc.ocp.frenet import FrenetErrors
from rti_mpcc.types import Array, Objective

PROJECTION_REACH = 1.0
"""A goal that has moved by less than this is projected near its last projection [m]: noise makes no jumps."""
OVERRUN = 0.1
"""Of the progress past the stop of a goal pose [m] (published code)."""
STAGE_LENGTH = 0.1
"""Stage length that the stage weights belong to [s], a stage of h counting h / 0.1 times: Table I is of the
printed sum over stages of 0.1 s."""
GOAL_CLIP = (0.5, 0.3)
"""What the pull of a goal counts at most, position [m] and heading [rad]: beyond it the cost grows linearly
(Huber), so that its pull has a bound that the corridor's exact penalty can exceed."""
ON_POSE = np.array([1.0, 1.0, 10.0])
"""What errors of x, y [1/m²] and of the heading [1/rad²] count at the end of an arrival. With 1 on both
an arrival with a low comfort steering rate ends 7 deg off, rather than 3 s later (docs/decisions, 26)."""
FIRM_TIME = 5.0
"""Time to go [s] below which an arrival's effort counts less and less, as its cube. The error that a plan
accepts at the goal to save effort grows with 1/t_go³: without this it is all of the distance left at 1 s
(docs/decisions, 1)."""


class TargetKind(Enum):
    """What ends a part."""

    PATH_END = "path end"
    POSE = "pose"


@dataclass(frozen=True, kw_only=True)
class Target:
    """Where a one-direction part is to end at rest.

    Attributes:
        pose: rear axle pose, heading on the branch nearest the path's.
        theta: progress of its projection onto the part [m].
        theta_end: end of the part [m].
        kind: the path's own end (or cusp), or a goal pose beside or behind it.
        across: how far the pose is to the left of the path there [m].
        goal: that pose as it was given, with its heading on any branch; None for the path's end.
        wheels: angle that the wheels are to come to there [rad], or None; wheels_share: of its weight.
    """

    pose: Pose2
    theta: float
    theta_end: float
    kind: TargetKind = TargetKind.PATH_END
    across: float = 0.0
    goal: Pose2 | None = None
    wheels: float | None = None
    wheels_share: float = 0.0

    @cached_property
    def stop(self) -> float:
        """min(theta_e, theta_g): where the path stops to count [m]."""
        return min(self.theta, self.theta_end)

    @cached_property
    def farthest(self) -> float:
        """How far the progress may go [m]: at a path's end no farther than the stop, it would end there."""
        return self.stop + (OVERRUN if self.kind is TargetKind.POSE else 0.0)

    @property
    def behind(self) -> float:
        """How far a goal pose lies behind the part's end [m]; 0 where it does not."""
        return max(self.theta - self.theta_end, 0.0)


def goal_on(part: PathPart, goal: Pose2, last: Target | None = None) -> Target:
    """The goal as the target of a part; `last`: what the part was to end in before, or None."""
    if last is None or last.goal is None:
        near = None
    elif last.goal == goal:
        return last
    else:
        near = last.theta if apart(goal, last.pose) < PROJECTION_REACH else None
    theta = part.project(goal.x, goal.y, heading=goal.phi, near=near)
    if theta <= 0.5 * (part.start + part.end) and apart(goal, part.last) <= apart(goal, part.pose(theta)):
        theta = part.end  # of a path that comes back to where it began
    pose, progress = replace(goal, phi=lift(goal.phi, part.pose(theta).phi)), part.progress(goal, theta)
    return Target(
        pose=pose,
        theta=progress,
        theta_end=part.end,
        kind=TargetKind.POSE,
        across=pose.relative_to(part.pose(progress)).y,
        goal=goal,
    )


def apart(one: Pose2, other: Pose2) -> float:
    """Distance of two poses [m]."""
    return hypot(one.x - other.x, one.y - other.y)


def path_end(part: PathPart) -> Target:
    """The part's own end as its target."""
    return Target(pose=part.last, theta=part.end, theta_end=part.end)


def ended_at(part: PathPart, pose: Pose2, wheels: float | None, share: float) -> Target:
    """A pose just beside the part's own end as its target, with the wheels at an angle [rad], for a share of
    the weight on that."""
    return Target(
        pose=Pose2(pose.x, pose.y, lift(pose.phi, part.last.phi)),
        theta=part.end,
        theta_end=part.end,
        across=pose.relative_to(part.pose(part.end)).y,
        wheels=wheels,
        wheels_share=share,
    )


def stop_on(part: PathPart, theta: float) -> Target:
    """A stop on the path at progress `theta` [m], or at its end, as its target."""
    theta = min(theta, part.end)
    return Target(pose=part.pose(theta), theta=theta, theta_end=part.end)


class ComfortWeights(NamedTuple):
    """On the squared excess over each value of `Comfort`: (N,), (N+1,), (N,)."""

    acceleration: Out1
    lateral_acceleration: Out1
    steering_rate: Out1


@dataclass(frozen=True, slots=True, kw_only=True)
class StageWeights:
    """Effective weights: (N+1,) on states, (N,) on controls, goal (3,), goal_speed and goal_wheels at stage N
    only. `comfort` is on what goes beyond `Comfort`.

    `slack` is the linear weight of the corridor slack [1/m] of (H3), above the largest pull that could press
    the body against a boundary: the penalty is exact. `scale` brings the QP's cost to size.
    `time` is w_T of (T4) [1/s], 0 where the end is fixed.
    """

    lag: Array
    contouring: Array
    heading: Array
    acceleration: Array
    steering_rate: Array
    virtual_speed: Array
    progress_reward: Array
    comfort: ComfortWeights
    goal: Array
    goal_speed: float = 0.0
    goal_clipped: bool = True
    slack: float
    scale: float
    goal_wheels: float = 0.0
    time: float = 0.0

    @property
    def follows_path(self) -> bool:
        """Whether any stage counts its Frenet errors."""
        return any(map(np.count_nonzero, (self.lag, self.contouring, self.heading)))


@dataclass(frozen=True, slots=True)
class Linearised:
    """The plan that a QP is linearised about, for terms of an objective's own, or a user's.

    `states` (N+1, 6) in the world, `local` the same in the QP's frame, `controls` (N, 3) of stages of these
    `lengths` (N,) [s], and the Frenet `errors` there, None without weights on them; `index` of the part whose
    boundaries count.
    """

    states: Array
    local: Array
    controls: Array
    lengths: Array
    errors: FrenetErrors | None
    weights: StageWeights
    corridor: Corridor
    index: int
    config: ControllerConfig


class HorizonObjective(ABC):
    """What the QP of a cycle asks for.

    Attributes:
        kind: what the diagnostics call it.
        along_path: corridor, room and the part's direction count; otherwise only its target does.
        ends: the progress of a plan ends at the target's stop; otherwise the path is extrapolated.
        arrives: a planned arrival may take over from it.
        latest: end of a plan whose end is free [s].
    """

    __slots__ = ()
    kind: ClassVar[Objective]
    along_path: ClassVar[bool] = True
    ends: ClassVar[bool] = True
    arrives: ClassVar[bool] = True
    latest: float = inf

    @abstractmethod
    def horizon(self, at: float, config: ControllerConfig) -> float | None:
        """Length of a plan that starts `at` [s]; None: that of the last one, its end being free, (T4)."""

    @abstractmethod
    def weights(self, config: ControllerConfig, target: Target, theta: Array, lengths: Array) -> StageWeights:
        """Weights at progress `theta` (N+1,) [m] of stages of these `lengths` (N,) [s]."""

    def successor(self, left: float) -> HorizonObjective | None:
        """What takes over for good with `left` [m] of the path before the target's stop; None: nothing."""
        return None

    def reference(self, part: PathPart, theta: Array, config: ControllerConfig) -> PathReference:
        """The path at `theta` (N+1,) [m], as the slopes of the Frenet errors know it."""
        return part.reference(theta)

    def bound(  # noqa: B027
        self, bounds: StageBounds, target: Target, theta: Array, direction: int, config: ControllerConfig
    ) -> None:
        """Narrow the bounds of stages 1..N of a plan with progress `theta` (N+1,) [m], in place."""

    def add_terms(self, plan: Linearised, hessian: Array, gradient: Array) -> None:  # noqa: B027
        """Add cost terms of its own to those of the states, (N+1, 6, 6) and (N+1, 6), in place."""


@dataclass(frozen=True, slots=True)
class Contouring(HorizonObjective):
    """Along the path over the cruise horizon, paper Eq. 5, until an arrival is planned in time."""

    kind: ClassVar[Objective] = Objective.CONTOURING
    ends: ClassVar[bool] = False

    def horizon(self, at: float, config: ControllerConfig) -> float:
        """The cruise horizon [s]."""
        return config.cruise_horizon

    def weights(self, config: ControllerConfig, target: Target, theta: Array, lengths: Array) -> StageWeights:
        """Weights that stay the same along the path, see `contouring_weights`."""
        return contouring_weights(config.weights, lengths, config.cruise_speed, config.effort)


CONTOURING = Contouring()


@dataclass(frozen=True, slots=True)
class ArrivalAtRest(HorizonObjective):
    """One arrival at rest at the target, at the horizon's end.

    Attributes:
        at: when that is [s]; None: when the QP finds best, (T4), and no later than `latest` [s].
    """

    kind: ClassVar[Objective] = Objective.ARRIVAL
    at: float | None = None
    latest: float = inf

    def horizon(self, at: float, config: ControllerConfig) -> float | None:
        """The time to go [s]."""
        return None if self.at is None else self.at - at

    def weights(self, config: ControllerConfig, target: Target, theta: Array, lengths: Array) -> StageWeights:
        """Weights on the pose and speed at the end, on effort, and on time, see `arrival_weights`."""
        pace = 0.0 if self.at is not None else config.arrival_acceleration
        comfort, effort = config.arrival_comfort, config.effort
        return arrival_weights(config.weights, target, lengths, comfort, effort, pace)


def contouring_weights(weights: Weights, lengths: Array, cruise_speed: float, effort: float) -> StageWeights:
    """Contouring far from the path's end, paper Eq. 5.

    Args:
        lengths: (N,) of the stages [s].
        cruise_speed: where the progress reward has its best if the weights leave virtual_speed open [m/s].
        effort: weight on the squared acceleration, in place of that of `weights`.
    """
    share, reward = stage_share(lengths, STAGE_LENGTH), weights.progress_reward
    open_weight = reward / (2.0 * cruise_speed)
    virtual_speed = open_weight if weights.virtual_speed is None else weights.virtual_speed
    return StageWeights(
        lag=weights.lag * share,
        contouring=weights.contouring * share,
        heading=weights.heading * share,
        acceleration=effort * share[:-1],
        steering_rate=weights.steering_rate * share[:-1],
        virtual_speed=virtual_speed * share[:-1],
        progress_reward=reward * share[:-1],
        comfort=comfort_weights(share, weights.comfort),
        goal=np.zeros(3),
        slack=2.0 * (reward / STAGE_LENGTH),
        scale=1.0 / (max(weights.lag, effort) * share.max() or 1.0),
    )


def arrival_weights(
    weights: Weights,
    target: Target,
    lengths: Array,
    comfort: tuple[float, float, float],
    effort: float,
    pace: float = 0.0,
) -> StageWeights:
    """One planned arrival at rest at the target at the horizon's end: (W5), docs/method.md.

    Args:
        lengths: (N,) of the stages [s].
        comfort: weights on what goes beyond it, in place of those of `weights`.
        effort: weight on the squared acceleration, likewise.
        pace: a_planned of (T4) [m/s²]; 0: the end is fixed.
    """
    goal, whole = weights.arrival_pose * ON_POSE, stage_share(lengths, STAGE_LENGTH)
    firm = min(1.0, float(lengths.sum()) / FIRM_TIME) ** 3
    share, none = whole * firm, np.zeros(len(whole))
    return StageWeights(
        lag=none,
        contouring=none,
        heading=none,
        acceleration=effort * share[:-1],
        steering_rate=weights.steering_rate * share[:-1],
        virtual_speed=none[:-1],
        progress_reward=none[:-1],
        comfort=comfort_weights(share, comfort),
        goal=goal,
        goal_speed=weights.arrival_speed,
        slack=2.0 * goal_pull(goal),
        scale=1.0 / weights.arrival_pose,
        goal_wheels=0.0 if target.wheels is None else target.wheels_share * weights.arrival_wheels,
        time=firm * weights.acceleration * pace**2 / STAGE_LENGTH,
    )


def stage_share(lengths: Array, unit: float) -> Array:
    """What each stage counts (N+1,): its length over the `unit` [s] that the weights belong to."""
    share = np.empty(len(lengths) + 1)
    share[:-1], share[-1] = lengths, lengths[-1]
    share /= unit
    return share


def comfort_weights(share: Array, weights: tuple[float, float, float]) -> ComfortWeights:
    """Weights on what goes beyond comfort, at stages that count `share` (N+1,)."""
    acceleration, lateral, steering = weights
    return ComfortWeights(acceleration * share[:-1], lateral * share, steering * share[:-1])


def goal_pull(goal: Array) -> float:
    """Largest gradient of the clipped cost of a `goal` (3,) of weights per metre of body motion [1/m]."""
    position, heading = GOAL_CLIP
    return float(2.0 * (max(goal[0], goal[1]) * position + goal[2] * heading))
