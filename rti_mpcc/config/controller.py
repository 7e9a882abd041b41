"""All settings of a controller, and the presets of the paper."""

from __future__ import annotations

from math import inf, radians, tan
from typing import Annotated, Any, Self

from pydantic import Field, model_validator

from estimation import DisturbanceFilterConfig, VehicleFilterConfig
from geometry.doors import door
from geometry.errors import ConfigError
from geometry.settings import NonNegative, Positive, Settings, Tolerance, did_you_mean
from rti_mpcc.config.decisions import Method, Ride
from rti_mpcc.config.inputs import GoalTracking, Plausibility
from rti_mpcc.config.mission import MissionSettings
from rti_mpcc.config.mpc import (
    BoundRelaxation,
    Footprint,
    NarrowPassage,
    SolverSettings,
    SpeedProfile,
    Weights,
)
from rti_mpcc.config.route import RoutePlanner
from rti_mpcc.config.safety import Caution
from rti_mpcc.config.vehicle import KINDS, Comfort, Limits, Vehicle

EXIT = 1e-3
"""Kept free of a cycle's deadline for the checks of its plan and the account of it [s]."""
COMFORT_ACCELERATION = 0.4
"""By default [m/s²]."""
RAMP = 0.4
"""In which a vehicle comes from none to the comfort acceleration [s]."""
BRISK_EFFORT = 0.04
"""Share of the effort's weight in a brisk cruise: its time constant falls from 12 s to 2.4 s."""
NO_JERK = 1e3
"""More than any vehicle has in a cycle: no bound [m/s³]."""
NO_COMFORT = (0.0, 0.0, 0.0)
"""Weights of a method that knows no comfort."""
PLANNED_SHARE = 0.9  # of comfort, and of the speed in narrow places: the rest is for corrections
BRISK_SHARE = 0.98  # the same of a brisk ride: its time has the ramps for a reserve
BRISK_BOUND = 1.1  # times comfort, at most, in any plan of a brisk ride
LOST_CYCLES = 2.5  # after a longer gap the vehicle may have done anything within its limits
FIRMNESS = 4.0  # times the comfort acceleration: before an obstacle, or without a plan


class ControllerConfig(Settings):
    """All settings of a `DockingController`; every one has a default.

    Attributes:
        vehicle, limits, weights, footprint, caution, solver, goal_tracking, plausibility: see there.
        narrow_passage, bound_relaxation: see there.
        route: how ways are planned in an area, see `RoutePlanner`.
        mission: how missions are driven, see `MissionSettings`.
        disturbance: how what acts beside the commands is estimated, see `DisturbanceFilterConfig`; in the
            presets of the paper it is not.
        vehicle_filter: how noise is taken out of the measured state, see `VehicleFilterConfig`; likewise.
        cycle: time between two steps [s], 0.005 to 0.2.
        dead_time: time from a command to its effect, on both actuators [s].
        goal_tolerance: longitudinal [m], lateral [m], heading [rad], in the goal's frame.
        stages: N.
        fine_stage: length of the second stage where stages grow; also the longest equal stage [s].
        comfort_acceleration: a_c [m/s²], comfort_lateral_acceleration [m/s²], comfort_steering_rate [rad/s]:
            what passengers or load are to feel at most. A planned arrival takes the time that keeps to all
            three, and what goes beyond them costs extra.
        ride: "smooth" or "brisk", see `Ride`.
        comfort_jerk: so much the acceleration of a plan changes in a second at most [m/s³]; None: as much as
            reaches the comfort acceleration in `RAMP`. In the presets of the paper it is not bounded.
        cruise_horizon: horizon of the contouring objective [s].
        arrival_horizon: longest planned arrival [s].
        arrival: plan one arrival at rest once the goal is within reach; otherwise contour to the end.
        corridor_rows: keep every box of the body inside the corridor (soft, with an exact penalty).
        speed_profile: bound on speed near the stop point, or None.
        method: see `Method`.
        staging: where `Method.SEPARATED` stops: so far before the goal's projection onto the path [m], or at
            the path's end where the goal lies behind it.
        recovery: whether a vehicle that cannot get on along its path plans another way, in all of its
            corridor. None: with method `dynamic` and a planned arrival; the paper's objectives stall as they
            did.
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
    narrow_passage: NarrowPassage = NarrowPassage()
    bound_relaxation: BoundRelaxation = BoundRelaxation()
    route: RoutePlanner = RoutePlanner()
    mission: MissionSettings = MissionSettings()
    disturbance: DisturbanceFilterConfig = DisturbanceFilterConfig()
    vehicle_filter: VehicleFilterConfig = VehicleFilterConfig()
    cycle: Annotated[float, Field(ge=0.005, le=0.2)] = 0.05
    dead_time: Annotated[float, Field(ge=0.0, le=1.0)] = 0.0
    goal_tolerance: Tolerance = (0.05, 0.05, radians(2.0))
    stages: Annotated[int, Field(ge=10, le=1000)] = 70
    fine_stage: Annotated[float, Field(ge=0.005, le=10.0)] = 0.1
    comfort_acceleration: Annotated[float, Field(gt=0.0, le=100.0)] = COMFORT_ACCELERATION
    comfort_lateral_acceleration: Positive = 1.0
    comfort_steering_rate: Positive = 0.5
    comfort_jerk: Positive | None = None
    ride: Ride = "smooth"
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
        rate, most = self.comfort_steering_rate, self.limits.steering_rate
        if rate > most and "comfort_steering_rate" in self.model_fields_set:
            raise ValueError(
                f"comfort_steering_rate = {rate} rad/s must not be above limits.steering_rate = {most} rad/s"
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
        """All comfort values."""
        return Comfort(
            self.comfort_acceleration,
            self.comfort_lateral_acceleration,
            self.comfort_steering_rate,
            self.comfort_acceleration / RAMP if self.comfort_jerk is None else self.comfort_jerk,
        )

    @property
    def arrival_acceleration(self) -> float:
        """What a planned arrival takes [m/s²]."""
        share = PLANNED_SHARE if self.ride == "smooth" else BRISK_SHARE
        return share * self.comfort_acceleration

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
    def cruise_effort(self) -> float:
        """Weight on the squared acceleration of a cruise [s⁴/m²]: comfort bounds that of a brisk one."""
        return self.weights.acceleration * (BRISK_EFFORT if self.ride == "brisk" else 1.0)

    @property
    def planned_acceleration(self) -> float:
        """Largest that a plan may have, besides the limits [m/s²]."""
        return inf if self.ride == "smooth" else BRISK_BOUND * self.comfort_acceleration

    @property
    def longest_cycle(self) -> float:
        """After more time than this since the last cycle, cycles were lost [s]."""
        return LOST_CYCLES * self.cycle

    @property
    def firm_deceleration(self) -> float:
        """Before something that blocks the way, or without a plan [m/s²]: firm, not an emergency."""
        return min(self.limits.acceleration, FIRMNESS * self.comfort_acceleration)

    @property
    def arrival_comfort(self) -> tuple[float, float, float]:
        """Weights on what goes beyond comfort in an arrival.

        The time of a smooth one says what acceleration it takes; that of a brisk one leaves no room.
        """
        along, across, turning = self.weights.arrival_comfort
        return (self.weights.comfort[0] if self.ride == "brisk" else along, across, turning)

    @property
    def recovers(self) -> bool:
        """Whether a goal that is missed is made for by other ways, see `recovery`."""
        if self.recovery is None:
            return self.arrival and self.method is Method.DYNAMIC
        return self.recovery

    @classmethod
    @door(ConfigError)
    def for_vehicle(cls, kind: str, **changes: Any) -> Self:
        """Vehicle and limits of a kind of vehicle, and the other settings as they are by default.

        Args:
            kind: rc_car, delivery_robot, forklift, car, van or bus.
            changes: settings that replace those of the preset.

        Raises:
            ConfigError: another kind.
        """
        if kind not in KINDS:
            likely = did_you_mean(str(kind), KINDS)
            raise ConfigError(f"kind = {kind!r}: must be one of {', '.join(KINDS)}{likely}")
        vehicle, limits = KINDS[kind]
        return cls(vehicle=vehicle, limits=limits).changed(**changes)

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
            "vehicle_filter": VehicleFilterConfig(enabled=False),
            "comfort_jerk": NO_JERK,
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
            "vehicle_filter": VehicleFilterConfig(enabled=False),
            "comfort_jerk": NO_JERK,
        }
        return cls(**{**preset, **changes})
