"""What the optimal control problem asks for and keeps, how exactly it is solved, and what comes in."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Self, TypeVar

from pydantic import BeforeValidator, Field, PrivateAttr, SerializeAsAny, model_serializer, model_validator

from estimation import GoalFilterConfig
from geometry.settings import CONSTANT, NonNegative, Positive, Settings, Triple

T = TypeVar("T")


class Weights(Settings):
    """Weights of the cost (paper Eq. 2, 5, 7 to 11, Table I). A weight of 0 switches its term off.

    Attributes:
        lag, contouring, heading: q_l, q_c [1/m²] and the heading error's weight [1/rad²].
        acceleration, steering_rate, virtual_speed: r, per squared unit of the control. A virtual_speed of
            None is the one with which the progress reward has its best at the cruise speed, so that no
            bound has to hold the vehicle back; 0 (Table I) rewards up to the speed limit.
        progress_reward: gamma [s/m], on theta_dot.
        goal: q_N^e on x, y, heading of the last stage while a goal pose is contoured to (`rti_mpcc.paper`).
        contouring_at_end: q_c^e, the contouring weight at a cusp or path end that is the goal (Eq. 8, there).
        transition_slope, transition_reach: alpha [1/m] and beta [m] of the weight transition sigma (there).
        arrival_pose, arrival_speed: on position [1/m²], heading (10 times) and speed [s²/m²] at the
            end of a planned arrival.
        arrival_wheels: on the angle of the wheels at the end of a planned arrival, where the next segment
            starts with another one [1/rad²].
        comfort, arrival_comfort: on the squared excess over comfort, in the order of `Comfort` [s⁴/m²],
            [s⁴/m²], [s²/rad²], while contouring and during an arrival.
    """

    former: ClassVar = {
        "lateral_acceleration heading_at_end terminal_lag terminal_heading stage_length bound_distance "
        "bound_distance_reach bound_speed bound_speed_reach": "a setting of `objective`, "
        "of ControllerConfig.paper() only",
        "arrival_contouring comfort_ease comfort_clip goal_clip firm_time": CONSTANT,
    }

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
    arrival_pose: Positive = 1e5
    arrival_speed: NonNegative = 8e5
    arrival_wheels: NonNegative = 1e3
    comfort: Triple = (1e5, 1e5, 1e4)
    arrival_comfort: Triple = (0.0, 1e5, 1e5)


CONTACT_TOLERANCE = 0.02
"""A body that is over a boundary by no more than this only seems to be [m]: measurements tremble by a
centimetre in place and some milliradians in heading. An obstacle that is overlapped by no more than this is
braked for in comfort, by more as hard as can be."""


class Clearance(Settings):
    """Distance that the body keeps to obstacles and boundaries, in planning, control and the last check.

    Attributes:
        least: no plan is driven and no route is planned on which the body comes nearer than this [m]. It is
            what lags, model errors and noise may take.
        wanted: kept all round the body where there is room [m]; a planned route keeps 0.1 m more.
    """

    ROUTES: ClassVar = 0.1
    """What a route keeps on top of `wanted` [m]: what the vehicle driving it may leave of it."""

    _size: float = PrivateAttr(default=1.0)

    least: NonNegative = 0.05
    wanted: Annotated[float, Field(ge=0.0, le=10.0)] = 0.1

    @property
    def on_routes(self) -> float:
        """What a planned route keeps where there is room [m]."""
        return self.wanted + self.ROUTES * self._size

    def of_size(self, size: float) -> Self:
        """For a vehicle of this `ControllerConfig.size`: what was not given is as much smaller."""
        if size == self._size == 1.0:
            return self
        least = self.least if "least" in self.model_fields_set else size * Clearance().least
        wanted = self.wanted if "wanted" in self.model_fields_set else max(size * Clearance().wanted, least)
        scaled = self.model_copy()
        for name, value in (("least", min(least, wanted)), ("wanted", wanted)):
            object.__setattr__(scaled, name, value)
        scaled._size = size
        return scaled

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.least > self.wanted:
            raise ValueError(f"least = {self.least} m must not be above wanted = {self.wanted} m")
        return self


class SolverSettings(Settings):
    """How exactly a QP is solved (docs/decisions, 4 and 6).

    Attributes:
        tolerance: absolute and relative termination tolerance, on the scaled problem.
    """

    former: ClassVar = {
        "fine_tolerance fine_iterations slice_iterations check_interval polish warm cold retry change_weight "
        "idle_weight bound_unit row_scaling_from row_scaling_most max_iterations": CONSTANT,
    }

    tolerance: Annotated[float, Field(ge=1e-8, le=0.1)] = 5e-4


class KindOfSettings(Settings):
    """Settings of one kind among others: files have the name of the class beside its fields."""

    KINDS: ClassVar[dict[str, type[Any]]]
    """The classes of a kind, `CostTerm` say, by their names in files: each of its subclasses is entered."""

    def __init_subclass__(cls, **given: Any) -> None:
        super().__init_subclass__(**given)
        if KindOfSettings in cls.__bases__:
            cls.KINDS = {}
        else:
            cls.KINDS[cls.__name__] = cls

    @model_serializer(mode="wrap")
    def _with_kind(self, write: Any) -> dict[str, Any]:
        return {"kind": type(self).__name__, **write(self)}


class CostTerm(KindOfSettings):
    """A term of the cost that a user adds, `ControllerConfig.objective.terms`: w e² at each stage.

    Its fields are settings; recordings find the class by its name. The time of arrival that the QP finds,
    (T4), does not count it.
    """

    def residual(self, plan: Any) -> Any:
        """The `Residual` about a plan, which is a `Linearised` (`rti_mpcc.objectives`)."""
        raise NotImplementedError


def _term(value: Any) -> Any:
    """The term that was written into a file, by the name of its class."""
    if not isinstance(value, Mapping):
        return value
    kind = CostTerm.KINDS.get(str(value.get("kind")))
    if kind is None:
        raise ValueError(f"cost term {value.get('kind')!r} is not known: import the module that defines it")
    return kind(**{name: each for name, each in value.items() if name != "kind"})


class DockingObjective(KindOfSettings):
    """How a vehicle comes along its path into the goal: it contours, then drives one planned arrival at rest.

    Other methods derive from this class and plug themselves in (`rti_mpcc.paper`, or a user's); recordings
    find the class by its name. Settings know neither segments nor objectives of a horizon: hence the type
    variables.

    Attributes:
        terms: of the cost, beside those of `Weights`.
    """

    terms: tuple[Annotated[SerializeAsAny[CostTerm], BeforeValidator(_term)], ...] = ()
    plans_arrival: ClassVar[bool] = True
    """Whether an arrival at rest takes over from contouring; otherwise contouring goes on to the end."""
    arrives_at_goal: ClassVar[bool] = True
    """Whether the goal, too, is arrived at like that, so that the docking time is known before."""

    def segments(self, parts: T, config: Any) -> T:
        """The segments of a manoeuvre along a path, from those of its parts."""
        return parts

    def on_horizon(self, objective: T) -> T:
        """What a QP asks for in place of this `HorizonObjective`."""
        return objective


class GoalTracking(Settings):
    """How the controller drives to a goal that it knows from detections.

    Attributes:
        filter: of the detections, see `GoalFilterConfig`.
        standoff: distance along the path to a goal that is not certain enough, where the vehicle stops [m].
        required: the goal must have been detected; at a planned goal that was not, the vehicle waits, and is
            not docked. Also loads the filter at the start rather than with the first detection.
    """

    former: ClassVar = {"speed turn_rate longest_step certainty standoff_tolerance": CONSTANT}

    filter: GoalFilterConfig = GoalFilterConfig()
    standoff: NonNegative = 1.0
    required: bool = False


class Plausibility(Settings):
    """How far a measurement may be from what the commands have made of the vehicle before it is doubted.

    Attributes:
        position, heading, speed, steering: at most so far [m], [rad], [m/s], [rad]; what model errors explain
            in the time between two cycles comes on top.
        blind: so long the last plan is driven on by reckoning before the vehicle brakes [s].
    """

    former: ClassVar = {
        "frozen_distance frozen_speed steering_gap steering_time confirmation frozen_tries rest_speed "
        "model_mismatch longest_gap farthest largest_heading largest_steering speed_share off_path "
        "progress_step": CONSTANT,
    }

    position: Positive = 0.3
    heading: Positive = 0.3
    speed: Positive = 1.0
    steering: Positive = 0.3
    blind: NonNegative = 0.3
