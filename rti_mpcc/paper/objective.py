"""Dynamic weight and dynamic objective allocation (paper III), and the Cartesian objective of the baselines.

(W1)  sigma(eps) = 1 / (1 + exp(alpha (eps - beta)))                                          (paper Eq. 7)
(W2)  near the path's end or a cusp: contouring weight and heading weight, blended by sigma      (paper Eq. 8)
(W3)  near a goal pose: contouring, lag and progress reward fade out, the goal's weight fades in (Eq. 9 to 11)
(W6)  the slopes of the blended weights by the progress of their stage, in the gradient
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import sqrt
from typing import Any, ClassVar, Literal, TypeVar, cast

import numpy as np
from scipy.special import expit

from geometry import PathPart, PathReference, Pose2
from geometry.settings import NonNegative, Positive, Settings
from rti_mpcc.config import ControllerConfig, DockingObjective, Weights
from rti_mpcc.manoeuvre import CUSP_TOLERANCE, SegmentEnd, Segments
from rti_mpcc.model.layout import THETA_DOT
from rti_mpcc.ocp.bounds import StageBounds
from rti_mpcc.ocp.objectives import (
    STAGE_LENGTH,
    Contouring,
    HorizonObjective,
    Linearised,
    Target,
    TargetKind,
    comfort_weights,
    goal_pull,
    stage_share,
    stop_on,
)
from rti_mpcc.paper.terms import PaperWeights, WeightSlopes, add_paper_terms, add_weight_slopes, walls_of
from rti_mpcc.types import Array, Objective

T = TypeVar("T")


class SpeedProfile(Settings):
    """Bound on |v| and theta_dot that falls towards the stop point (published code).

    Attributes:
        final: speed allowed at the stop point [m/s].
        deceleration: how the bound falls [m/s²]: v² <= final² + 2 deceleration (theta_stop - theta).
        behind: for a goal behind the path end, the share of the speed from which `deceleration` stops over
            the distance behind it: so fast the vehicle may be at the stop point, if that is more than
                `final`.
    """

    final: Positive = 1.0
    deceleration: Positive = 5.0
    behind: NonNegative = 0.5

    def speeds(self, target: Target, theta: Array) -> Array:
        """Highest speeds at progress `theta` (n,) [m]."""
        final = max(self.final, self.behind * sqrt(2.0 * self.deceleration * target.behind))
        left = np.maximum(target.stop - theta, 0.0)
        found: Array = np.sqrt(final * final + 2.0 * self.deceleration * left)
        return found


class ComparedObjective(DockingObjective):
    """A method that `dynamic` is compared with; all of it but the objective is the same code.

    Attributes:
        method: "dynamic", with no stop on the way; "separated", to a stop at a staging pose on the path, and
            from there by the Cartesian objective; "switched", with the Cartesian objective from
            `Weights.transition_reach` before the stop on.
        staging: where "separated" stops: so far before the goal's projection onto the path [m], or at the
            path's end where the goal lies behind it.
    """

    arrives_at_goal: ClassVar[bool] = False

    method: Literal["dynamic", "separated", "switched"] = "dynamic"
    staging: NonNegative = 7.0

    def segments(self, parts: T, config: Any) -> T:
        """The parts of the path, by this method."""
        *before, last = cast(Segments, parts)
        if self.method == "separated":
            tolerance, staging = CUSP_TOLERANCE, StagingPose(self.staging)
            stop = replace(last, end=SegmentEnd.CUSP, tolerance=tolerance, target=staging)
            return cast(T, (*before, stop, replace(last, objective=CartesianPose())))
        if self.method == "switched":
            within = config.weights.transition_reach
            switched = SwitchedCruise(within=within) if self.plans_arrival else DynamicContouring(within)
            return cast(T, (*before, replace(last, objective=switched)))
        return parts


class PaperObjective(ComparedObjective):
    """Contouring to the end with the paper's dynamic weights; terms of the published code are off by default.

    Attributes:
        lateral_acceleration: weight on (v² tan(delta)/L)² [s⁴/m²].
        heading_at_end: heading weight near a cusp or path end [1/rad²].
        terminal_lag, terminal_heading: extra weights at the last stage [1/m²], [1/rad²].
        bound_distance, bound_speed: weights of (W7), for the distance of the rear axle to the boundary.
        stage_length: stage length that the stage weights belong to [s]: 0.1 s is the printed sum, 1 s the
            published code's integral.
        speed_profile: bound on speed near the stop point, or None.
        progress_reverses: theta_dot may be negative. Near the centre of a bend the lag error hardly knows
            theta, and a plan whose progress may run back can then hang there.
        reference_turns: a plan knows that the path's heading changes with its progress. The published code
            looks the heading up by index, and its solver takes it for constant.
    """

    plans_arrival: ClassVar[bool] = False

    lateral_acceleration: NonNegative = 0.0
    heading_at_end: NonNegative = 0.0
    terminal_lag: NonNegative = 0.0
    terminal_heading: NonNegative = 0.0
    bound_distance: NonNegative = 0.0
    bound_speed: NonNegative = 0.0
    stage_length: Positive = STAGE_LENGTH
    speed_profile: SpeedProfile | None = None
    progress_reverses: bool = False
    reference_turns: bool = True

    def on_horizon(self, objective: T) -> T:
        """Dynamic contouring in place of a cruise."""
        return cast(T, DynamicContouring()) if type(objective) is Contouring else objective


_PRINTED = PaperObjective()


def _of(config: ControllerConfig) -> PaperObjective:
    """The paper's settings, of a configuration that has other ones the printed equations'."""
    return config.objective if isinstance(config.objective, PaperObjective) else _PRINTED


@dataclass(frozen=True, slots=True)
class StagingPose:
    """The target of a segment that ends so far `before` the goal's projection onto its part [m], or at the
    part's end where the goal lies behind it; without a goal it is the path's last pose."""

    before: float

    def __call__(self, part: PathPart, goal: Pose2 | None) -> Target:
        """The target on this part."""
        goal = goal or part.last
        theta = part.project(goal.x, goal.y, heading=goal.phi)
        return stop_on(part, part.end if theta >= part.end else max(theta - self.before, part.start))


class _OfPaper(HorizonObjective):
    """With the terms and the speed profile of `PaperObjective`, over the cruise horizon to the stop point."""

    __slots__ = ()
    arrives: ClassVar[bool] = False

    def horizon(self, at: float, config: ControllerConfig) -> float:
        """The cruise horizon [s]."""
        return config.cruise_horizon

    def bound(
        self, bounds: StageBounds, target: Target, theta: Array, direction: int, config: ControllerConfig
    ) -> None:
        """Within the speed profile, which also bounds theta_dot."""
        paper, progress = _of(config), bounds.controls[..., THETA_DOT]
        if paper.speed_profile is not None:
            ahead = bounds.states[:, int(direction > 0), 0]
            speed = np.minimum(direction * ahead, paper.speed_profile.speeds(target, theta[1:]))
            ahead[:] = direction * speed
            progress[:, 1] = speed
        if paper.progress_reverses:
            progress[:, 0] = -progress[:, 1]

    def add_terms(self, plan: Linearised, hessian: Array, gradient: Array) -> None:
        """Those of the published code."""
        weights, walls, wheelbase = plan.weights, walls_of(plan), plan.config.vehicle.wheelbase
        assert isinstance(weights, PaperWeights)
        add_paper_terms(plan.local, weights, walls, wheelbase, hessian, gradient)
        add_weight_slopes(plan.errors, plan.controls, walls, weights, gradient)


@dataclass(frozen=True, slots=True)
class DynamicContouring(_OfPaper):
    """Contouring with dynamic weights and objective, paper Eq. 8 to 11.

    Attributes:
        switches: so far before the stop the Cartesian objective takes over [m]; until then the path ends
            where the goal lies beside it (Eq. 8). None: the goal pulls (Eq. 9 to 11).
    """

    kind: ClassVar[Objective] = Objective.CONTOURING
    switches: float | None = None

    def successor(self, left: float) -> HorizonObjective | None:
        """The goal pose alone, where it switches to it."""
        return CartesianPose() if self.switches is not None and left <= self.switches else None

    def weights(self, config: ControllerConfig, target: Target, theta: Array, lengths: Array) -> PaperWeights:
        """Weights that follow the distance to the stop, see `dynamic_weights`."""
        if self.switches is not None:
            target = replace(target, kind=TargetKind.PATH_END)
        return dynamic_weights(config.weights, _of(config), target, theta, lengths, config.cruise_speed)

    def reference(self, part: PathPart, theta: Array, config: ControllerConfig) -> PathReference:
        """The path; straight on as far as slopes go, without `reference_turns`."""
        found = part.reference(theta)
        turns = _of(config).reference_turns
        return found if turns else replace(found, slope=np.zeros_like(found.slope))


@dataclass(frozen=True, slots=True)
class SwitchedCruise(Contouring):
    """A cruise until `within` [m] before the stop, then the Cartesian objective."""

    arrives: ClassVar[bool] = False
    within: float

    def successor(self, left: float) -> HorizonObjective | None:
        """The goal pose alone."""
        return CartesianPose() if left <= self.within else None


@dataclass(frozen=True, slots=True)
class CartesianPose(_OfPaper):
    """The target's pose at the end of the cruise horizon, either way, whatever path and corridor are."""

    kind: ClassVar[Objective] = Objective.CARTESIAN
    along_path: ClassVar[bool] = False

    def weights(self, config: ControllerConfig, target: Target, theta: Array, lengths: Array) -> PaperWeights:
        """Weights on the goal pose and on effort, see `cartesian_weights`."""
        return cartesian_weights(config.weights, lengths, _of(config))


def sigma(distance: Array | float, weights: Weights) -> Array:
    """(W1): near 1 closer than beta [m], near 0 beyond."""
    return np.asarray(
        expit(-weights.transition_slope * (np.asarray(distance) - weights.transition_reach)), dtype=np.float64
    )


def dynamic_weights(
    weights: Weights, paper: PaperObjective, target: Target, theta: Array, lengths: Array, cruise_speed: float
) -> PaperWeights:
    """Contouring with dynamic weights: paper Eq. 8 where the path's end is the goal, else Eq. 9 to 11.

    Args:
        theta: (N+1,) progress of the plan that is linearised about [m].
        lengths: (N,) of the stages [s].
        cruise_speed: where the progress reward has its best if the weights leave virtual_speed open [m/s].
    """
    share = stage_share(lengths, paper.stage_length)
    near = sigma(target.stop - theta, weights)
    nearing = weights.transition_slope * near * (1.0 - near) * share  # d sigma / d theta
    if target.kind is TargetKind.PATH_END:  # Eq. 8
        ahead, reward_fades, goal = np.ones_like(near), 0.0, np.zeros(3)
        contouring_at_end, heading_at_end = weights.contouring_at_end, paper.heading_at_end
    else:  # Eq. 9, 10; Eq. 11 is the same with the Frenet costs off from the stop point on
        ahead, reward_fades = (theta < target.stop).astype(np.float64), 1.0
        goal = sigma(target.stop - theta[0], weights) * np.array(weights.goal)
        contouring_at_end = heading_at_end = 0.0
    contouring = near * contouring_at_end + (1.0 - near) * weights.contouring
    reward = (1.0 - reward_fades * near) * weights.progress_reward
    virtual_speed = reward / (2.0 * cruise_speed)
    if weights.virtual_speed is not None:
        virtual_speed = np.full_like(near, weights.virtual_speed)
    largest = max(weights.lag, weights.acceleration) * share.max()
    found = PaperWeights(
        lag=weights.lag * ahead * share,
        contouring=contouring * ahead * share,
        heading=(weights.heading + near * heading_at_end) * ahead * share,
        lateral_acceleration=paper.lateral_acceleration * share,
        bound_distance=paper.bound_distance * (1.0 - near) * share,
        bound_speed=paper.bound_speed * share,
        acceleration=weights.acceleration * share[:-1],
        steering_rate=weights.steering_rate * share[:-1],
        virtual_speed=virtual_speed[:-1] * share[:-1],
        progress_reward=reward[:-1] * share[:-1],
        comfort=comfort_weights(share, weights.comfort),
        goal=goal,
        slack=2.0 * (weights.progress_reward / paper.stage_length + goal_pull(goal)),
        scale=1.0 / (max(largest, paper.terminal_lag, goal.max()) or 1.0),
        by_progress=WeightSlopes(
            contouring=nearing * (contouring_at_end - weights.contouring) * ahead,
            heading=nearing * heading_at_end,
            bound_distance=-nearing * paper.bound_distance,
            progress_reward=-reward_fades * nearing * weights.progress_reward,
        ),
    )
    found.lag[-1] += ahead[-1] * paper.terminal_lag
    found.heading[-1] += ahead[-1] * paper.terminal_heading
    return found


def cartesian_weights(weights: Weights, lengths: Array, paper: PaperObjective = _PRINTED) -> PaperWeights:
    """The goal pose at the horizon's end, whatever the path.

    The progress costs its square, so that it is determined.

    Args:
        lengths: (N,) of the stages [s].
    """
    share, goal = stage_share(lengths, paper.stage_length), np.array(weights.goal)
    largest = max(float(goal.max()), weights.acceleration * float(share.max()))
    none = np.zeros_like(share)
    return PaperWeights(
        lag=none,
        contouring=none,
        heading=none,
        acceleration=weights.acceleration * share[:-1],
        steering_rate=weights.steering_rate * share[:-1],
        virtual_speed=weights.lag * share[:-1],
        progress_reward=none[:-1],
        comfort=comfort_weights(share, weights.comfort),
        goal=goal,
        goal_clipped=False,
        slack=2.0 * goal_pull(goal),
        scale=1.0 / (largest or 1.0),
        lateral_acceleration=paper.lateral_acceleration * share,
        bound_distance=none,
        bound_speed=none,
    )
