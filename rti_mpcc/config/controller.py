"""All settings of a controller, and the presets of the paper."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from importlib import import_module
from math import inf, radians, tan
from typing import Annotated, Any, ClassVar, Self

from pydantic import Field, SerializeAsAny, field_validator, model_validator

from estimation import DisturbanceFilterConfig, VehicleFilterConfig
from geometry.errors import ConfigError
from geometry.settings import CONSTANT, NonNegative, Positive, Settings, Tolerance, did_you_mean, replaced
from geometry.validation import validated
from rti_mpcc.config.mpc import (
    CONTACT_TOLERANCE,
    Clearance,
    DockingObjective,
    GoalTracking,
    Plausibility,
    SolverSettings,
    Weights,
)
from rti_mpcc.config.route import MissionSettings, RoutePlanner
from rti_mpcc.config.vehicle import KINDS, ActuatorModel, Comfort, Delay, Limits, Ride, Vehicle

EXIT = 1e-3  # kept free of a cycle's deadline for the checks of its plan and the account of it [s]
DEADLINE_SHARE = 0.3
"""Of the cycle: the rest is the loop's, for sensors, actuators and a garbage collection. With 0.6 the longest
cycles of 100 `hard` rides took 34 ms, with 0.3 they take 18 ms, but for one, and the rides are as long
(docs/performance.md)."""
SHORT_SHARE, SHORT_DEADLINE = 0.6, 0.01
"""A short cycle has this share of its time, up to so much [s]: a plan takes no less time in it."""
COMFORT_ACCELERATION = 0.4  # by default [m/s²]
RAMP = 0.4  # in which a vehicle comes from none to the comfort acceleration [s]
BRISK_EFFORT = 0.04
"""Share of the effort's weight in a brisk ride: the time constant of a cruise falls from 12 s to 2.4 s."""
PLANNED_SHARE = 0.88  # of comfort, and of the speed in narrow places: the rest is for corrections
BRISK_BOUND = 1.1  # times comfort, at most, in any plan of a brisk ride
STANDSTILL_SPEED = 0.02  # a slower car stands [m/s]: it moves by a millimetre in a cycle
MOVING_FACTOR = 2.0  # times that speed: noise of a vehicle that stands is no motion
LOST_CYCLES = 2.5  # after a longer gap the vehicle may have done anything within its limits
FIRMNESS = 4.0  # times the comfort acceleration: before an obstacle, or without a plan
TIGHT = 0.03  # where the least clearance is no more than this [m], plans go as near as that
SMALL = 3.0  # length of a body [m] below which lengths that suit cars are made smaller
LEAST_SIZE = 0.2
PAPER = "rti_mpcc.paper"
"""Where the paper's objectives are. It is loaded by name when one of them is asked for: what drives a vehicle
does without it."""


class ControllerConfig(Settings):
    """All settings of a `DockingController`; every one has a default.

    Attributes:
        vehicle, limits, weights, clearance, solver, goal_tracking, plausibility: see there.
        objective: how the vehicle comes along its path into the goal, see `DockingObjective`.
        route: how ways are planned in an area, see `RoutePlanner`.
        mission: how missions are driven, see `MissionSettings`.
        disturbance: how what acts beside the commands is estimated, see `DisturbanceFilterConfig`; in the
            presets of the paper it is not.
        vehicle_filter: how noise is taken out of the measured state, see `VehicleFilterConfig`; likewise.
        cycle: time between two steps [s], 0.005 to 0.2.
        actuators: how drive and steering answer a command, see `ActuatorModel`; a live estimate
            corrects it.
        dead_time: that of `actuators` [s]; given alone it is short for it.
        goal_tolerance: longitudinal [m], lateral [m], heading [rad], in the goal's frame.
        stages: N.
        comfort_acceleration: a_c [m/s²], comfort_lateral_acceleration [m/s²], comfort_steering_rate [rad/s]:
            what passengers or load are to feel at most. A planned arrival takes the time that keeps to all
            three, and what goes beyond them costs extra.
        ride: "smooth" or "brisk", see `Ride`.
        comfort_jerk: so much the acceleration of a plan changes in a second at most [m/s³]; None: as much as
            reaches the comfort acceleration in `RAMP`. In the presets of the paper it is not bounded.
        cruise_horizon: horizon of the contouring objective [s].
        arrival_horizon: longest planned arrival [s].
        recovery: whether a vehicle that cannot get on along its path plans another way, in all of its
            corridor. None: where it arrives at its goal in one plan (`DockingObjective.arrives_at_goal`); the
            paper's objectives stall as they did.
        escape_speed: a vehicle whose body overlaps something may creep at up to this speed [m/s] along a
            motion on which the overlap falls all the way; 0: it stands.
        deadline: of one step [s]; None: none; not given: `DEADLINE_SHARE` of the cycle, of a short one more.
            The solver gets what is left of it, a plan that comes later is not driven in its cycle. Above
            `EXIT`, with which alone no plan could ever be found.
    """

    former: ClassVar = {
        "footprint": "clearance.wanted (its margin) and constants",
        "caution": "clearance.least (its hard_minimum) and constants",
        "arrival": "objective, which says whether it plans one",
        "method": "objective (`rti_mpcc.paper.with_method`)",
        "staging": "objective.staging, of the baselines (`rti_mpcc.paper`)",
        "speed_profile progress_reverses reference_turns": "in the paper's `objective` (`rti_mpcc.paper`)",
        "fallback escape behaviour retries arrival_timing search guesses goal_limits obstacle_tracking "
        "user_clock progress narrow_passage bound_relaxation fine_stage corridor_rows": CONSTANT,
    }

    vehicle: Vehicle = Vehicle()
    limits: Limits = Limits()
    weights: Weights = Weights()
    clearance: Clearance = Clearance()
    objective: SerializeAsAny[DockingObjective] = DockingObjective()
    solver: SolverSettings = SolverSettings()
    goal_tracking: GoalTracking = GoalTracking()
    plausibility: Plausibility = Plausibility()
    route: RoutePlanner = RoutePlanner()
    mission: MissionSettings = MissionSettings()
    disturbance: DisturbanceFilterConfig = DisturbanceFilterConfig()
    vehicle_filter: VehicleFilterConfig = VehicleFilterConfig()
    cycle: Annotated[float, Field(ge=0.005, le=0.2)] = 0.05
    actuators: ActuatorModel = ActuatorModel()
    dead_time: Delay = 0.0
    goal_tolerance: Tolerance = (0.05, 0.05, radians(2.0))
    stages: Annotated[int, Field(ge=10, le=1000)] = 70
    comfort_acceleration: Annotated[float, Field(gt=0.0, le=100.0)] = COMFORT_ACCELERATION
    comfort_lateral_acceleration: Positive = 1.0
    comfort_steering_rate: Positive = 0.5
    comfort_jerk: Positive | None = None
    ride: Ride = "smooth"
    cruise_horizon: Annotated[float, Field(ge=1.0, le=120.0)] = 10.0
    arrival_horizon: Annotated[float, Field(ge=3.0, le=300.0)] = 25.0
    recovery: bool | None = None
    escape_speed: NonNegative = 0.0
    deadline: Annotated[float, Field(gt=EXIT, le=10.0)] | None = None

    @field_validator("objective", mode="before")
    @classmethod
    def _objective(cls, value: Any) -> Any:
        """The objective that was written into a file, by the name of its class."""
        if not isinstance(value, Mapping):
            return value
        kind, settings = value.get("kind"), {name: each for name, each in value.items() if name != "kind"}
        made = DockingObjective if kind in (None, "DockingObjective") else _objectives().get(str(kind))
        if made is None:
            raise ValueError(f"kind = {kind!r}: must be one of DockingObjective, {', '.join(_objectives())}")
        return made(**settings)

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        for name, unit in (("acceleration", "m/s²"), ("steering_rate", "rad/s")):
            comfort, most = getattr(self, f"comfort_{name}"), getattr(self.limits, name)
            if comfort > most and (name == "acceleration" or f"comfort_{name}" in self.model_fields_set):
                said = f"comfort_{name} = {comfort} {unit} must not be above limits.{name} = {most} {unit}"
                raise ValueError(said)
        return self

    @model_validator(mode="after")
    def _complete(self) -> Self:
        """Fill in what follows from other settings."""
        # A given `dead_time` goes into `actuators`; both are the same afterwards.
        if "dead_time" in self.model_fields_set:
            object.__setattr__(self, "actuators", replaced(self.actuators, dead_time=self.dead_time))
            self.model_fields_set.add("actuators")
            self.model_fields_set.discard("dead_time")
        object.__setattr__(self, "dead_time", self.actuators.dead_time)
        # Clearances that were not given are in proportion to the vehicle's size.
        object.__setattr__(self, "clearance", self.clearance.of_size(self.size))
        if "deadline" not in self.model_fields_set:
            least = min(SHORT_SHARE * self.cycle, SHORT_DEADLINE)
            object.__setattr__(self, "deadline", max(DEADLINE_SHARE * self.cycle, least))
        return self

    @cached_property
    def max_curvature(self) -> float:
        """Largest curvature that the vehicle can drive [1/m]."""
        return tan(self.limits.steering) / self.vehicle.wheelbase

    @cached_property
    def comfort(self) -> Comfort:
        """All comfort values."""
        return Comfort(
            self.comfort_acceleration,
            self.comfort_lateral_acceleration,
            self.comfort_steering_rate,
            self.comfort_acceleration / RAMP if self.comfort_jerk is None else self.comfort_jerk,
        )

    @cached_property
    def arrival(self) -> bool:
        """Whether an arrival at rest is planned; otherwise contouring goes on to the end."""
        return self.objective.plans_arrival

    @cached_property
    def planned_minimum(self) -> float:
        """What plans keep where there is no room for `Clearance.wanted` [m].

        Noise comes on top of the least, but a user who allows no more than `TIGHT` asks for all of it.
        """
        least = self.clearance.least
        return least + min(CONTACT_TOLERANCE, max(least - TIGHT, 0.0))

    @cached_property
    def arrival_acceleration(self) -> float:
        """What the time of a planned arrival is chosen for [m/s²], (T4)."""
        return PLANNED_SHARE * self.comfort_acceleration

    @cached_property
    def arrival_reach(self) -> float:
        """Way of the longest arrival at the default comfort acceleration [m]."""
        return COMFORT_ACCELERATION * self.arrival_horizon**2 / 6.0

    @cached_property
    def cruise_speed(self) -> float:
        """Speed of a cruise [m/s]: from it an arrival at the comfort acceleration is begun in time."""
        if not self.arrival:
            return self.limits.speed
        return min(self.limits.speed, 0.5 * self.arrival_acceleration * self.arrival_horizon)

    @cached_property
    def effort(self) -> float:
        """Weight on the squared acceleration [s⁴/m²]: comfort bounds that of a brisk ride."""
        return self.weights.acceleration * (BRISK_EFFORT if self.ride == "brisk" else 1.0)

    @cached_property
    def planned_acceleration(self) -> float:
        """Largest that a plan may have, besides the limits [m/s²]."""
        return inf if self.ride == "smooth" else BRISK_BOUND * self.comfort_acceleration

    @cached_property
    def longest_cycle(self) -> float:
        """After more time than this since the last cycle, cycles were lost [s]."""
        return LOST_CYCLES * self.cycle

    @cached_property
    def firm_deceleration(self) -> float:
        """Before something that blocks the way, or without a plan [m/s²]: firm, not an emergency."""
        return min(self.limits.acceleration, FIRMNESS * self.comfort_acceleration)

    @cached_property
    def arrival_comfort(self) -> tuple[float, float, float]:
        """Weights on what goes beyond comfort in an arrival.

        The time of a smooth one says what acceleration it takes; that of a brisk one leaves no room.
        """
        along, across, turning = self.weights.arrival_comfort
        return (self.weights.comfort[0] if self.ride == "brisk" else along, across, turning)

    @cached_property
    def recovers(self) -> bool:
        """Whether a goal that is missed is made for by other ways, see `recovery`."""
        return self.objective.arrives_at_goal if self.recovery is None else self.recovery

    @cached_property
    def size(self) -> float:
        """Share by which lengths that suit cars are smaller for this vehicle: 1 from `SMALL` on.

        Measurements do not get better with the size: no length is less than `LEAST_SIZE` of that of a car.
        """
        vehicle = self.vehicle
        return min(max((vehicle.front + vehicle.rear) / SMALL, LEAST_SIZE), 1.0)

    @cached_property
    def rest_speed(self) -> float:
        """A slower vehicle stands [m/s]."""
        return STANDSTILL_SPEED * self.size

    @cached_property
    def moving_speed(self) -> float:
        """A vehicle that stands is measured faster [m/s] before it moves: noise is no motion."""
        return MOVING_FACTOR * self.rest_speed

    @classmethod
    @validated(ConfigError)
    def for_vehicle(cls, kind: str, **changes: Any) -> Self:
        """Vehicle and limits of a kind of vehicle, and the other settings as they are by default.

        `kind`: rc_car, delivery_robot, forklift, car, van or bus; `changes` replace settings of the preset.
        Raises ConfigError for another kind.
        """
        if kind not in KINDS:
            likely = did_you_mean(str(kind), KINDS)
            raise ConfigError(f"kind = {kind!r}: must be one of {', '.join(KINDS)}{likely}")
        vehicle, limits = KINDS[kind]
        return cls(vehicle=vehicle, limits=limits).changed(**changes)

    @classmethod
    def paper(cls, **changes: Any) -> Self:
        """Table I with the terms of the authors' published code and their 7 s horizon.

        `changes` replace settings of the preset; `weights` too is replaced whole.
        """
        return cls(**{**import_module(PAPER).PUBLISHED, **changes})

    @classmethod
    def paper_printed(cls, **changes: Any) -> Self:
        """The paper's equations with Table I and nothing else (docs/decisions); `changes` as in `paper`."""
        return cls(**{**import_module(PAPER).PRINTED, **changes})


def _objectives() -> dict[str, type[DockingObjective]]:
    """The paper's objectives, and those of the user, by their names in files."""
    import_module(PAPER)
    return DockingObjective.KINDS
