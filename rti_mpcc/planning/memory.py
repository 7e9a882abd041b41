"""What the controller remembers from one cycle to the next, as one frozen value."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from operator import attrgetter
from typing import TYPE_CHECKING

from estimation import DisturbanceEstimate, GoalEstimate, PoseHistory
from geometry import Pose2
from rti_mpcc.iteration import Solution
from rti_mpcc.model.delay import QueuedCommand
from rti_mpcc.model.disturbance import UNDISTURBED, Disturbance
from rti_mpcc.ocp.targets import Target
from rti_mpcc.planning.detour import Detour
from rti_mpcc.planning.goals import GoalFit
from rti_mpcc.planning.pace import Pace
from rti_mpcc.planning.plausibility import StateMonitor
from rti_mpcc.types import Array, Objective, Trajectory

__all__ = [
    "ControllerMemory",
    "Halt",
    "Past",
    "Phase",
    "PlannedStop",
    "PlanningContext",
    "PullOut",
    "SuspendedSearch",
    "renewed",
]


class Phase(Enum):
    """What the controller is busy with on the active part."""

    STARTING = "starting"
    CONTOURING = "contouring"
    ARRIVING = "arriving"
    SETTLING = "settling"
    HOLDING = "holding"
    STALLED = "stalled"


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannedStop:
    """A stop before something that fills the way.

    Attributes:
        at: progress [m].
        goal: known when it was found to be needed.
        obstacles: number of obstacle changes known then; None: there may be a way past them, for which there
            was no time yet.
        since: when that was, or when a way past was last looked for in vain [s].
        from_there: that was standing at the stop.
    """

    at: float
    goal: Pose2 | None
    obstacles: int | None
    since: float
    from_there: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Halt:
    """A vehicle that brakes, or stands, for something that its plan does not stay clear of.

    Attributes:
        clear_since: since when its way is clear [s], or None.
    """

    clear_since: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class PullOut:
    """The way back along a part, from which its target can be come to again.

    Attributes:
        begin, end: progress on the part [m], end < begin.
    """

    begin: float
    end: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Past:
    """A search from guesses past what fills the way of the first one.

    Attributes:
        detours: not tried in vain yet, the first one being tried.
        meets: progress at which that guess meets what fills the way [m].
    """

    detours: tuple[Detour, ...]
    meets: float


@dataclass(frozen=True, slots=True, kw_only=True)
class SuspendedSearch:
    """A search for a first plan that goes on in the next cycle.

    Attributes:
        solution: the last one, None if no QP was solved yet; iterations: so many were.
        iterate: how far the QP had come that was stopped, or None.
        target: what the plan is to end in; stop: where that is a stop before something in the way, or None.
        arrive_at: when it is to be there [s], or None; begin: when the plan begins [s].
        backs: see `ControllerMemory`.
        in_vain: an arrival that backs up was looked for before, in vain: what is found here is driven.
        past: the guess that it began from goes past something; None: it does not.
    """

    solution: Solution | None
    iterations: int
    iterate: tuple[Array, Array] | None
    target: Target
    stop: PlannedStop | None
    arrive_at: float | None
    begin: float
    reverse_into_goal: bool = False
    reverse_failed: bool = False
    past: Past | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class ControllerMemory:
    """Everything that a cycle leaves to the next.

    Attributes:
        time: on the controller's own clock, which never runs back [s]; None before the first cycle;
            clock_offset: how far it is ahead of the user's [s].
        clock_at: what the user's clock showed last [s]; clock_stood: so many cycles it has not moved.
        trust: what is believed of the vehicle's state.
        offsets: what is known to act beside the commands, or None where that is not estimated,
            or not yet.
        unreadable: what is wrong with the obstacles given last, or "".
        heading_hint: what there is to say of the vehicle's heading when it was first measured, or "".
        part: index of the active part of the route.
        phase: see `Phase`.
        unfinished: a search for a first plan that ran out of time, or None.
        latched: why the vehicle was brought to a stop, until a plan is driven again; "" otherwise.
        solution: the last iterate on this part, or None: where the next cycle goes on.
        fit: the last plan that had no complaint, driven or not, or None: where a clean start begins.
        driven: the last plan that was accepted for driving, or None; accepted_at: when [s].
        clear_of: number of obstacle changes up to which the driven plan is known to be clear of them.
        arrive_at: planned time of arrival at rest [s]; None while contouring.
        backs: the arrival passes the goal and backs up into it.
        cartesian: from here on only the goal pose counts (`Method.SEPARATED`, `Method.SWITCHED`).
        timed_for: the pose that this time was last set for.
        overdue_since: since when that arrival has its shortest time to go, whatever way is left [s], or None.
        planned: the user's goal pose, or None for the path's last pose.
        goal_fit: what was found of it when it was new; given_fit: of the goal given last, taken or not; None:
            not looked yet.
        refusal: why the goal given last was not taken, or "".
        goal: the pose made for: `planned`, or what detections make of it.
        estimate: what detections say about the goal, or None if there never was one; estimated_at: when [s].
        estimate_fit: whether that can be the goal, or None; followed: the last one that could, or None.
        waiting: the vehicle stops, or stands, before a goal that is not known well enough.
        poses: where the vehicle has been in the last moments.
        target: what the active part ends in, at the last cycle.
        reached: state (6,) that the last cycle's command began to act in, or None at the begin of a part.
        queue: commands on their way to the actuators.
        standing_since: when the vehicle came to a standstill [s], or None while it moves.
        outside_since: since when a vehicle that holds is outside the tolerance [s], or None.
        driving_since: when the present plan began to be driven [s].
        halt: see `Halt`; None while nothing is in the way.
        looked_at: when a vehicle that stands blocked last looked for a plan [s], or None.
        stop: before something that fills the way, made for or held at; None where the way is free.
        looks_past: standing there, a way past it is looked for.
        restarts: how often the active part was begun again after a stop outside the tolerance.
        pull_out: what is driven instead of the active part, or None; pulled_out: how often that was done.
    """

    time: float | None = None
    clock_offset: float = 0.0
    clock_at: float | None = None
    clock_stood: int = 0
    monitor: StateMonitor = field(default_factory=StateMonitor)
    offsets: DisturbanceEstimate | None = None
    unreadable: str = ""
    heading_hint: str = ""
    part: int = 0
    phase: Phase = Phase.STARTING
    unfinished: SuspendedSearch | None = None
    latched: str = ""
    solution: Solution | None = None
    fit: Trajectory | None = None
    driven: Trajectory | None = None
    accepted_at: float | None = None
    clear_of: int = 0
    arrive_at: float | None = None
    reverse_into_goal: bool = False
    cartesian: bool = False
    timed_for: Pose2 | None = None
    overdue_since: float | None = None
    planned: Pose2 | None = None
    goal_fit: GoalFit | None = None
    given_fit: GoalFit | None = None
    refusal: str = ""
    goal: Pose2 | None = None
    estimate: GoalEstimate | None = None
    estimated_at: float | None = None
    estimate_fit: GoalFit | None = None
    followed: Pose2 | None = None
    waiting: bool = False
    poses: PoseHistory = field(default_factory=PoseHistory)
    target: Target | None = None
    reached: Array | None = None
    queue: tuple[QueuedCommand, ...] = ()
    standing_since: float | None = None
    outside_since: float | None = None
    driving_since: float = 0.0
    halt: Halt | None = None
    looked_at: float | None = None
    stop: PlannedStop | None = None
    looks_past: bool = False
    restarts: int = 0
    pull_out: PullOut | None = None
    pulled_out: int = 0

    @property
    def now(self) -> float:
        """Time of this cycle on the controller's own clock [s]; 0 before the first."""
        return self.time or 0.0

    @property
    def disturbance(self) -> Disturbance:
        """What is counted on beside the commands."""
        known = self.offsets
        return UNDISTURBED if known is None else Disturbance(known.acceleration, known.steering, known.gain)

    @property
    def objective(self) -> Objective:
        """What the QP of this cycle asks for."""
        if self.cartesian:
            return Objective.CARTESIAN
        return Objective.CONTOURING if self.arrive_at is None else Objective.ARRIVAL


_values = attrgetter(*ControllerMemory.__slots__)
_setters = tuple(getattr(ControllerMemory, name).__set__ for name in ControllerMemory.__slots__)

if TYPE_CHECKING:
    from dataclasses import replace as renewed  # the same, and so are its arguments
else:

    def renewed(memory: ControllerMemory, **changes: object) -> ControllerMemory:
        """The memory with these changes; itself where they are none.

        It is `dataclasses.replace`, in less than half its time: a cycle makes many changes, and most of them
        say again what is known. The copy is filled before anybody has it.
        """
        new = {name: value for name, value in changes.items() if getattr(memory, name) is not value}
        if not new:
            return memory
        copy = object.__new__(ControllerMemory)
        for setter, value in zip(_setters, _values(memory), strict=True):
            setter(copy, value)
        for name, value in new.items():
            object.__setattr__(copy, name, value)
        return copy


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanningContext:
    """Where the vehicle will be when the command of this cycle begins to act.

    Attributes:
        now, begin: [s]; begin = now + dead time.
        state: (6,) at `begin`, heading on the route's branch, with the steering that acts, see (O4).
        measured_speed: at `now` [m/s], as far as it is believed.
        doubt: why nothing can be planned from this state, or "".
        target: what the active part ends in.
        direction: of the active part.
        last_part: whether the active part is the route's last, and its target no staging pose on it.
        way: left to the target [m]; speed: in the direction of the part [m/s]; pace: of the part.
        free: whether the target is the part's own, not a stop before something in the way.
        error: pose at `begin` in the target's frame (longitudinal, lateral, heading).
        stop_error: the same where the vehicle would stop if it braked at the comfort acceleration now.
        tolerance: (longitudinal, lateral, heading) of the target.
    """

    now: float
    begin: float
    state: Array
    measured_speed: float
    doubt: str
    target: Target
    direction: int
    last_part: bool
    free: bool
    way: float
    speed: float
    pace: Pace
    error: Pose2
    stop_error: Pose2
    tolerance: tuple[float, float, float]

    def inside(self, error: Pose2, share: float = 1.0) -> bool:
        """Whether `error` lies within `share` of the tolerance."""
        along, across, heading = self.tolerance
        return (
            abs(error.x) <= share * along
            and abs(error.y) <= share * across
            and abs(error.phi) <= share * heading
        )
