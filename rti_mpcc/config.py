"""Frozen, validated settings of the controller. SI units and radians; a bad value raises `ConfigError`.

The numbers of the paper (Table I) are the defaults of `Weights`; what its published code adds is
switched on by `ControllerConfig.paper()`, see docs/decisions.
"""

from __future__ import annotations

from enum import Enum
from math import radians, sqrt, tan
from typing import Annotated, Any, NamedTuple, Self

from pydantic import Field, model_validator

from estimation import DisturbanceFilterConfig, GoalFilterConfig
from geometry.settings import NonNegative, Positive, Settings, Tolerance, Triple

EXIT = 1e-3
"""Kept free of a cycle's deadline for the checks of its plan and the account of it [s]."""


COMFORT_ACCELERATION = 0.4
"""By default [m/s²]."""
PLANNED_SHARE = 0.9
"""What a planned arrival takes of the comfort acceleration, and of the speed that narrow places allow: the
rest is for corrections on the way."""
NO_COMFORT = (0.0, 0.0, 0.0)
"""Weights of a method that knows no comfort."""


class Comfort(NamedTuple):
    """What a passenger, or the load, is to feel at most: [m/s²], [m/s²], [rad/s]."""

    acceleration: float
    lateral_acceleration: float
    steering_rate: float


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


class Vehicle(Settings):
    """A car-like vehicle; its reference point is the middle of the rear axle.

    Attributes:
        wheelbase: [m].
        width: of the body [m].
        front: body ahead of the rear axle [m].
        rear: body behind the rear axle [m].
    """

    wheelbase: Positive = 2.875
    width: Positive = 2.069
    front: Positive = 3.6775
    rear: NonNegative = 0.8027


class Limits(Settings):
    """Symmetric limits of the vehicle.

    Attributes:
        speed: [m/s]; acceleration: [m/s²]; steering: [rad], below pi/2; steering_rate: [rad/s].
    """

    speed: Annotated[float, Field(gt=0.0, le=100.0)] = 10.0
    acceleration: Annotated[float, Field(gt=0.0, le=100.0)] = 5.0
    steering: Annotated[float, Field(gt=0.0, le=1.4)] = 0.6
    steering_rate: Annotated[float, Field(gt=0.0, le=100.0)] = 1.0


class Weights(Settings):
    """Weights of the cost (paper Eq. 2, 5, 7 to 11, Table I). Each may be 0, which switches its term off.

    Attributes:
        lag, contouring, heading: q_l, q_c [1/m²] and the heading error's weight [1/rad²].
        acceleration, steering_rate, virtual_speed: r, per squared unit of the control. A virtual_speed of
            None is the one with which the progress reward has its best at the cruise speed, so that no
            bound has to hold the vehicle back; 0 (Table I) rewards up to the speed limit.
        progress_reward: gamma [s/m], on theta_dot.
        goal: q_N^e on x, y, heading of the last stage while a goal pose is contoured to.
        contouring_at_end: q_c^e, the contouring weight at a cusp or path end that is the goal (Eq. 8).
        transition_slope, transition_reach: alpha [1/m] and beta [m] of the weight transition sigma.
        lateral_acceleration: on (v² tan(delta)/L)² [s⁴/m²] (published code).
        heading_at_end: heading weight near a cusp or path end (published code).
        terminal_lag, terminal_heading: extra weights at the last stage (published code).
        bound_distance: on (2 m - distance of the rear axle to the boundary)² (published code).
        bound_speed: on v² (2.5 m - distance of the rear axle to the boundary)² (published code).
        stage_length: the stage length that the stage weights belong to [s]: a stage of h counts
            h / stage_length times. 0.1 s is the printed sum, 1 s the published code's integral.
        arrival_pose, arrival_speed: on position [1/m²], heading [1/rad²] and speed [s²/m²] at the
            end of a planned arrival.
        arrival_contouring: contouring weight far from the goal during an arrival.
        comfort, arrival_comfort: on the squared excess over comfort, in the order of `Comfort` [s⁴/m²],
            [s⁴/m²], [s²/rad²], while contouring and during an arrival.
    """

    lag: NonNegative = 1e3
    contouring: NonNegative = 1.0
    heading: NonNegative = 0.0
    acceleration: NonNegative = 1e3
    steering_rate: NonNegative = 100.0
    virtual_speed: NonNegative | None = None
    progress_reward: NonNegative = 100.0
    goal: Triple = (1e4, 1e4, 1e4)
    contouring_at_end: NonNegative = 100.0
    transition_slope: Positive = 1.0
    transition_reach: NonNegative = 10.0
    lateral_acceleration: NonNegative = 0.0
    heading_at_end: NonNegative = 0.0
    terminal_lag: NonNegative = 0.0
    terminal_heading: NonNegative = 0.0
    bound_distance: NonNegative = 0.0
    bound_speed: NonNegative = 0.0
    stage_length: Positive = 0.1
    arrival_pose: Positive = 1e5
    arrival_speed: NonNegative = 1e5
    arrival_contouring: NonNegative = 0.0
    comfort: Triple = (1e5, 1e5, 1e4)
    arrival_comfort: Triple = (0.0, 1e5, 1e5)


class SpeedProfile(Settings):
    """Bound on |v| and theta_dot that falls towards the stop point (published code).

    Attributes:
        final: speed allowed at the stop point [m/s].
        deceleration: how the bound falls [m/s²]: v² <= final² + 2 deceleration (theta_stop - theta).
        behind: for a goal behind the path end, the share of the speed from which `deceleration` stops over
            the way behind it: so fast the vehicle may be at the stop point, if that is more than `final`.
    """

    final: Positive = 1.0
    deceleration: Positive = 5.0
    behind: NonNegative = 0.5

    def at_stop(self, behind: float) -> float:
        """Speed allowed at the stop point [m/s], the goal lying `behind` [m] the path end (0: not)."""
        return max(self.final, self.behind * sqrt(2.0 * self.deceleration * behind))


class Footprint(Settings):
    """How the corridor rows cover the body.

    Attributes:
        discs: number of discs along the body axis.
        margin: distance kept between discs and boundaries [m].
        near: boundaries farther from a disc's rim than this act on it in no way [m].
    """

    discs: Annotated[int, Field(ge=1, le=20)] = 5
    margin: Annotated[float, Field(ge=0.0, le=10.0)] = 0.1
    near: Positive = 1.5


class SolverSettings(Settings):
    """Settings of OSQP.

    Attributes:
        tolerance: absolute and relative termination tolerance, on the scaled problem.
        fine_tolerance: the same for the first `fine_iterations` of a QP that goes on from the one before: a
            shape that costs little changes by little from cycle to cycle, and never comes to its best where
            that is within the tolerance. What is not that good by then has to reach `tolerance`.
        max_iterations: of one QP; a QP that needs more is not accepted.
        check_interval: iterations between two termination checks.
        polish: refine the active set's solution (off on the vehicle, on for reference solutions).
    """

    tolerance: Annotated[float, Field(gt=0.0, le=0.1)] = 5e-4
    fine_tolerance: Annotated[float, Field(gt=0.0, le=0.1)] = 1e-6
    fine_iterations: Annotated[int, Field(ge=1, le=1_000_000)] = 6
    max_iterations: Annotated[int, Field(ge=1, le=1_000_000)] = 400
    check_interval: Annotated[int, Field(ge=1, le=1000)] = 3
    polish: bool = False


class GoalTracking(Settings):
    """How the controller makes for a goal that it knows from detections.

    Attributes:
        filter: of the detections, see `GoalFilterConfig`.
        speed, turn_rate: at most so fast the pose made for follows the estimate [m/s], [rad/s].
        certainty: a goal that is LOST may still be docked at while so many standard deviations of its
            estimate fit the goal tolerance.
        standoff: way left to a goal that is less certain, where the vehicle stops [m].
        required: the goal must have been detected; at a planned goal that was not, the vehicle waits, and is
            not docked. Also loads the filter at the start rather than with the first detection.
    """

    filter: GoalFilterConfig = GoalFilterConfig()
    speed: Positive = 3.0
    turn_rate: Positive = 1.5
    certainty: Positive = 2.0
    standoff: NonNegative = 1.0
    required: bool = False


class Plausibility(Settings):
    """Beyond what a measurement is doubted, and when it is trusted again.

    Attributes:
        position, heading, speed, steering: farthest from the state reckoned by the commands [m], [rad],
            [m/s], [rad]; what model errors explain in the time between two cycles comes on top.
        frozen_way, frozen_speed: a measurement that stays the same to the last bit is an old one once the
            vehicle must have moved so far [m], or be so much faster or slower [m/s].
        steering_gap: so far may the steering move otherwise than commanded [rad] within `steering_time` [s].
        blind: so long the last plan is driven on by reckoning before the vehicle brakes [s].
        confirmation: so long a standing vehicle has to be measured in the same place to be there [s].
    """

    position: Positive = 0.3
    heading: Positive = 0.3
    speed: Positive = 1.0
    steering: Positive = 0.3
    frozen_way: Positive = 0.2
    frozen_speed: Positive = 0.3
    steering_gap: Positive = 0.2
    steering_time: Positive = 1.0
    blind: NonNegative = 0.3
    confirmation: NonNegative = 3.0


class Caution(Settings):
    """What is kept from boundaries and obstacles, and when the vehicle stops for them.

    Attributes:
        hard_minimum: no plan is driven whose body comes nearer to an obstacle than this [m], or to a boundary
            than this less `contact_tolerance`. It is what lags, model errors and noise may take; the plans
            themselves keep `Footprint.margin`.
        contact_tolerance: a body that is over a boundary by no more than this only seems to be [m]: that is
            noise of a centimetre in place and of some milliradians in heading, at the corners. An obstacle
            that is overlapped by no more than this is stopped for in comfort, by more as hard as can be.
        stop_share: by this share more way is looked at for a stop than braking in comfort takes.
        clear_time: a vehicle that stops drives on after its way was clear for so long [s];
            clear_distance: and clear for so much more way than it needs to stop [m].
        moved: an obstacle whose middle has moved by more than this within `observation` moves [m];
            observation: its speed is what it did in so long [s]. It stands again after `clear_time`.
    """

    hard_minimum: NonNegative = 0.05
    contact_tolerance: NonNegative = 0.02
    stop_share: NonNegative = 0.25
    clear_time: NonNegative = 1.0
    clear_distance: NonNegative = 0.5
    moved: Positive = 0.05
    observation: Positive = 0.3


class ControllerConfig(Settings):
    """All settings of a `DockingController`; every one has a default.

    Attributes:
        vehicle, limits, weights, footprint, caution, solver, goal_tracking, plausibility: see there.
        disturbance: how what acts beside the commands is estimated, see `DisturbanceFilterConfig`; in the
            presets of the paper it is not.
        cycle: time between two steps [s], 0.005 to 0.2.
        dead_time: time from a command to its effect, on both actuators [s].
        goal_tolerance: longitudinal [m], lateral [m], heading [rad], in the goal's frame.
        stages: N.
        comfort_acceleration: a_c [m/s²], comfort_lateral_acceleration [m/s²], comfort_steering_rate [rad/s]:
            what passengers or load are to feel at most. A planned arrival takes the time that keeps to all
            three, and what goes beyond them costs extra.
        cruise_horizon: horizon of the contouring objective [s].
        arrival_horizon: longest planned arrival [s].
        arrival: plan one arrival at rest once the goal is within reach; otherwise contour to the end.
        corridor_rows: keep every disc of the body inside the corridor (soft, with an exact penalty).
        speed_profile: bound on speed near the stop point, or None.
        method: see `Method`.
        staging: where `Method.SEPARATED` stops: so far before the goal's projection onto the path [m], or at
            the path's end where the goal lies behind it.
        recovery: whether a vehicle that misses its goal tries other ways: it backs up into the goal, or pulls
            out and comes again. None: with method `dynamic` and a planned arrival; the paper's objectives
            stall as they did. True gives any of them what of it suits it.
        progress_reverses: theta_dot may be negative (published code). Near the centre of a bend the lag
            error hardly knows theta, and a plan whose progress may run back can then hang there.
        reference_turns: a plan knows that the path's heading changes with its progress. The published code
            looks the heading up by index, and its solver takes it for constant.
        escape_speed: a vehicle whose body overlaps something may creep at up to this speed [m/s] along a
            motion on which the overlap falls all the way; 0: it stands.
        deadline: of one step [s], or None: the solver gets what is left of it, a plan that comes later is not
            driven in its cycle. Above `EXIT`, with which alone no plan could ever be found.
    """

    vehicle: Vehicle = Vehicle()
    limits: Limits = Limits()
    weights: Weights = Weights()
    footprint: Footprint = Footprint()
    caution: Caution = Caution()
    solver: SolverSettings = SolverSettings()
    goal_tracking: GoalTracking = GoalTracking()
    plausibility: Plausibility = Plausibility()
    disturbance: DisturbanceFilterConfig = DisturbanceFilterConfig()
    cycle: Annotated[float, Field(ge=0.005, le=0.2)] = 0.05
    dead_time: Annotated[float, Field(ge=0.0, le=1.0)] = 0.0
    goal_tolerance: Tolerance = (0.05, 0.05, radians(2.0))
    stages: Annotated[int, Field(ge=10, le=1000)] = 70
    comfort_acceleration: Annotated[float, Field(gt=0.0, le=100.0)] = COMFORT_ACCELERATION
    comfort_lateral_acceleration: Positive = 1.0
    comfort_steering_rate: Positive = 0.5
    cruise_horizon: Annotated[float, Field(ge=1.0, le=120.0)] = 10.0
    arrival_horizon: Annotated[float, Field(ge=3.0, le=300.0)] = 25.0
    arrival: bool = True
    corridor_rows: bool = True
    method: Method = Method.DYNAMIC
    staging: NonNegative = 7.0
    speed_profile: SpeedProfile | None = None
    recovery: bool | None = None
    progress_reverses: bool = False
    reference_turns: bool = True
    escape_speed: NonNegative = 0.0
    deadline: Annotated[float, Field(gt=EXIT, le=10.0)] | None = None

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.comfort_acceleration > self.limits.acceleration:
            raise ValueError(
                f"comfort_acceleration = {self.comfort_acceleration} m/s² must not be above "
                f"limits.acceleration = {self.limits.acceleration} m/s²"
            )
        if self.caution.hard_minimum > self.footprint.margin:
            raise ValueError(
                f"caution.hard_minimum = {self.caution.hard_minimum} m must not be above "
                f"footprint.margin = {self.footprint.margin} m"
            )
        return self

    @property
    def max_curvature(self) -> float:
        """Largest curvature that the vehicle can drive [1/m]."""
        return tan(self.limits.steering) / self.vehicle.wheelbase

    @property
    def comfort(self) -> Comfort:
        """The three comfort values."""
        return Comfort(
            self.comfort_acceleration, self.comfort_lateral_acceleration, self.comfort_steering_rate
        )

    @property
    def arrival_acceleration(self) -> float:
        """What a planned arrival takes [m/s²]."""
        return PLANNED_SHARE * self.comfort_acceleration

    @property
    def arrival_reach(self) -> float:
        """Way of the longest arrival at the default comfort acceleration [m]."""
        return COMFORT_ACCELERATION * self.arrival_horizon**2 / 6.0

    @property
    def cruise_speed(self) -> float:
        """Speed of a cruise [m/s]: from it an arrival at the comfort acceleration is begun in time."""
        if not self.arrival:
            return self.limits.speed
        return min(self.limits.speed, 0.5 * self.arrival_acceleration * self.arrival_horizon)

    @property
    def recovers(self) -> bool:
        """Whether a goal that is missed is made for by other ways, see `recovery`."""
        if self.recovery is None:
            return self.arrival and self.method is Method.DYNAMIC
        return self.recovery

    @classmethod
    def paper(cls, **changes: Any) -> Self:
        """Table I with the terms of the authors' published code and their 7 s horizon.

        Args:
            changes: settings that replace those of the preset; `weights` too is replaced whole.
        """
        weights = Weights(
            virtual_speed=0.0,
            lateral_acceleration=100.0,
            heading_at_end=10.0,
            terminal_lag=1e3,
            terminal_heading=1e3,
            bound_distance=1e3,
            bound_speed=20.0,
            stage_length=1.0,
            comfort=NO_COMFORT,
        )
        preset = {
            "weights": weights,
            "cruise_horizon": 7.0,
            "arrival": False,
            "speed_profile": SpeedProfile(),
            "reference_turns": False,
            "disturbance": DisturbanceFilterConfig(enabled=False),
        }
        return cls(**{**preset, **changes})

    @classmethod
    def paper_printed(cls, **changes: Any) -> Self:
        """The paper's equations with Table I and nothing else (how it does: docs/decisions).

        Args:
            changes: settings that replace those of the preset.
        """
        preset = {
            "weights": Weights(virtual_speed=0.0, comfort=NO_COMFORT),
            "cruise_horizon": 7.0,
            "arrival": False,
            "disturbance": DisturbanceFilterConfig(enabled=False),
        }
        return cls(**{**preset, **changes})
