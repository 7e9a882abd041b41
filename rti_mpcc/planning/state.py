"""What the controller knows from one cycle to the next: one frozen value of frozen parts.

`DockingController.step` computes the next one from it and keeps it. Everything below takes values and returns
values; beside this there are only caches of the active segment (`planning.workspace`) and the goal's filter.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import Enum
from math import inf

from estimation import DisturbanceEstimate, GoalEstimate, PoseHistory
from geometry import Pose2, ReferencePath
from rti_mpcc.iteration import Solution
from rti_mpcc.manoeuvre import Manoeuvre, PlannedStop, Segment, SegmentEnd, Segments
from rti_mpcc.model.delay import QueuedCommand
from rti_mpcc.model.disturbance import UNDISTURBED, Disturbance
from rti_mpcc.ocp.objectives import ArrivalAtRest, HorizonObjective
from rti_mpcc.ocp.targets import Target
from rti_mpcc.planning.agenda import Agenda
from rti_mpcc.planning.goals import NO_TERMS, GoalFit, GoalTerms
from rti_mpcc.planning.obstacles import Obstacle
from rti_mpcc.planning.plausibility import StateMonitor
from rti_mpcc.planning.surroundings import Surroundings
from rti_mpcc.types import Array, GoalOrigin, GoalSetpoint, Trajectory

STANDSTILL_SPEED = 0.02  # [m/s]; a slower vehicle stands
MOVING_SPEED = 0.04  # [m/s]; a vehicle that stands is measured faster before it moves: noise is no motion


class Phase(Enum):
    """What the controller is busy with on the active segment; `rti_mpcc.behaviour` tells how they follow."""

    STARTING = "starting"
    CONTOURING = "contouring"
    ARRIVING = "arriving"
    SETTLING = "settling"
    HOLDING = "holding"
    STALLED = "stalled"
    PLANNING = "planning"
    WAITING = "waiting"


DRIVING = (Phase.CONTOURING, Phase.ARRIVING)
"""Where a plan is driven."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Halt:
    """A vehicle that brakes, or stands, for something that its plan does not stay clear of.

    Attributes:
        clear_since: since when its way is clear [s], or None.
        met: what its plan met last, and where, or ""; no_time: why there was no time for another plan, where
            a stop would not yet be needed for that, or "".
    """

    clear_since: float | None = None
    met: str = ""
    no_time: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Arrival:
    """One planned arrival at rest.

    Attributes:
        at: planned time of it [s].
        timed_for: the pose that the time was last set for.
        overdue_since: since when it has its shortest time to go, whatever distance is left [s], or None.
        calm: of a brisk ride, with the time of a smooth one to begin with.
    """

    at: float
    timed_for: Pose2
    overdue_since: float | None = None
    calm: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Stall:
    """What a stalled vehicle was to end in, and the obstacles that stood around it."""

    target: Target
    obstacles: tuple[Obstacle, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class SuspendedSearch:
    """A search for a first plan that goes on in the next cycle.

    Attributes:
        solution: the last one, None if no QP was solved yet, or the last one was not.
        iterations: so many QPs were solved; unsolved: so many were not, in all the time that they have.
        iterate: how far the QP had come that was stopped, or None.
        target: what the plan is to end in; segment: what it is for, or the piece of it.
        arrival: what is planned, or None while contouring; begin: when the plan begins [s].
    """

    solution: Solution | None
    iterations: int
    iterate: tuple[Array, Array] | None
    target: Target
    segment: Segment
    arrival: Arrival | None
    begin: float
    unsolved: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class ClockState:
    """The controller's own clock, which never runs back.

    Attributes:
        time: [s]; None before the first cycle; offset: how far it is ahead of the user's [s].
        shown: what the user's clock showed last [s]; stood: so many cycles it has not moved.
    """

    time: float | None = None
    offset: float = 0.0
    shown: float | None = None
    stood: int = 0

    @property
    def now(self) -> float:
        """Time of this cycle [s]; 0 before the first."""
        return self.time or 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class VehicleEstimate:
    """What is believed of the vehicle.

    Attributes:
        monitor: its state, and why a measurement is doubted.
        offsets: what is known to act beside the commands, or None where that is not estimated, or not yet.
        poses: where it has been in the last moments.
        heading_hint: what there is to say of the heading when it was first measured, or "".
        standing_since: when it came to a standstill, or began again from a target that it stood at [s]; None
            while it moves.
    """

    monitor: StateMonitor = field(default_factory=StateMonitor)
    offsets: DisturbanceEstimate | None = None
    poses: PoseHistory = field(default_factory=PoseHistory)
    heading_hint: str = ""
    standing_since: float | None = None

    @property
    def disturbance(self) -> Disturbance:
        """What is counted on beside the commands."""
        known = self.offsets
        if known is None:
            return UNDISTURBED
        return Disturbance(known.acceleration, known.steering, known.gain, known.turn)

    def is_stationary(self, now: float, seconds: float = 0.0) -> bool:
        """Whether it has been standing for `seconds` at `now` [s]."""
        return self.standing_since is not None and now - self.standing_since >= seconds


@dataclass(frozen=True, slots=True, kw_only=True)
class GoalState:
    """What is known of the goal.

    Attributes:
        planned: the user's goal pose, or None for the path's last pose; dock: the first one of the same dock;
            given: the user's goal as it came last, see `goals.steadied`.
        fit: what was found of it when it was new; given_fit: of the goal given last, taken or not; None: not
            looked yet.
        origin: where the planned goal is from; refusal: why the goal given last was not taken, or "".
        pose: made for: `planned`, or what detections make of it; None for the path's last pose.
        estimate: what detections say about the goal, or None if there never was one; estimated_at: when [s].
        estimate_fit: whether that can be the goal, or None; followed: the last one that could, or None.
        undetected: why the last detection was not accepted, while none was; "" where none came.
        waiting: the vehicle stops, or stands, before a goal that is not known well enough.
        terms: what is asked of it beside its pose.
    """

    planned: Pose2 | None = None
    dock: Pose2 | None = None
    given: Pose2 | None = None
    fit: GoalFit | None = None
    given_fit: GoalFit | None = None
    origin: GoalOrigin = GoalOrigin.PATH_END
    refusal: str = ""
    pose: Pose2 | None = None
    estimate: GoalEstimate | None = None
    estimated_at: float | None = None
    estimate_fit: GoalFit | None = None
    followed: Pose2 | None = None
    undetected: str = ""
    waiting: bool = False
    terms: GoalTerms = NO_TERMS

    @property
    def accepted(self) -> bool:
        """Whether a goal was given, or detected, and taken."""
        return self.origin is GoalOrigin.GIVEN or self.followed is not None

    @property
    def rejected(self) -> bool:
        """Whether a goal was asked for and refused, and none other was taken."""
        return self.refusal != "" and not self.accepted


@dataclass(frozen=True, slots=True, kw_only=True)
class Task:
    """What the vehicle is to do on its segment, and how that goes.

    Attributes:
        segments: what is left of the manoeuvre, the first one being driven, which may be a piece of the
            second; phase: see `Phase`.
        target: what the whole segment is to end in; None before the first cycle.
        arrival: what is planned, or None while contouring.
        successor: the objective that has taken over from the segment's own, or None.
        looks_past: standing there, a way past it is looked for.
        halt: see `Halt`; None while nothing is in the way.
        latched: why the vehicle was brought to a stop, until a plan is driven again; "" otherwise.
        looked_at: when a vehicle without a plan, or a cruising one without an arrival, last looked for one in
            vain [s], or None.
        stall: what it stood before when it stalled last, or None.
        outside_since: since when a vehicle that holds is outside the tolerance [s], or None.
        driving_since: when the present plan began to be driven, or the last halt was over [s].
        at_once: told to stand, it brakes as firmly as can be.
    """

    segments: Segments
    phase: Phase = Phase.STARTING
    target: Target | None = None
    arrival: Arrival | None = None
    successor: HorizonObjective | None = None
    looks_past: bool = False
    halt: Halt | None = None
    latched: str = ""
    looked_at: float | None = None
    stall: Stall | None = None
    outside_since: float | None = None
    driving_since: float = 0.0
    at_once: bool = False

    @property
    def segment(self) -> Segment:
        """The one that is driven."""
        return self.segments[0]

    @property
    def whole(self) -> Segment:
        """The one that is driven, or what that is a piece of."""
        return self.segment.whole

    @property
    def stop(self) -> PlannedStop | None:
        """Before something that fills the way, made for or held at; None where the way is free."""
        return self.segment.stop

    def on(self, piece: Segment) -> Task:
        """The same on another piece of the whole segment, or on all of it."""
        later = self.segments if self.segment.piece_of is None else self.segments[1:]
        return replace(self, segments=later if piece.piece_of is None else (piece, *later))

    def on_whole(self) -> Task:
        """The same on all of the segment."""
        return self.on(self.whole)

    def with_stop(self, stop: PlannedStop) -> Task:
        """The same on the way to a stop of which something else is known."""
        return self.on(replace(self.segment, stop=stop))

    @property
    def drives(self) -> bool:
        """Whether a plan is being driven."""
        return self.phase in DRIVING

    @property
    def objective(self) -> HorizonObjective:
        """What the QP asks for."""
        if self.successor is not None:
            return self.successor
        return self.segment.objective if self.arrival is None else ArrivalAtRest(self.arrival.at)


@dataclass(frozen=True, slots=True, kw_only=True)
class Plans:
    """What was planned on the active segment.

    Attributes:
        solution: the last iterate, or None: where the next cycle goes on.
        valid: the last plan that had no complaint, driven or not, or None: where a clean start begins.
        driven: the last plan that was accepted for driving, or None; accepted_at: when [s].
        clear_of: number of obstacle changes up to which the driven plan is known to be clear of them.
        seen_to: progress [m] up to which a cruise was sought with all that stands on the path in view.
        suspended: a search for a first plan that ran out of time, or None.
    """

    solution: Solution | None = None
    valid: Trajectory | None = None
    driven: Trajectory | None = None
    accepted_at: float | None = None
    clear_of: int = 0
    seen_to: float = -inf
    suspended: SuspendedSearch | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class RouteState:
    """What a controller that plans ways knows of them.

    Attributes:
        end: of the path that was given, the goal while there is no other one; None in an area.
        manoeuvre: the last one that was planned, found or not; None before the first one.
        why: why another one is planned, or ""; wanted: why the search for a first plan wants one, or "".
        since: when the vehicle set out on the present one, or began to plan another one [s].
        changes: number of obstacle changes that the last one knew of.
        ways: on so many the vehicle has set out, the path that was given among them; seconds: that all
            searches took.
        rehearsed: goal that was tried from the path's last change of direction, or None.
        fixed: no other way is to be planned in place of the present one, a straight move say.
    """

    end: Pose2 | None = None

    manoeuvre: Manoeuvre | None = None
    why: str = ""
    wanted: str = ""
    since: float = 0.0
    changes: int = 0
    ways: int = 0
    seconds: float = 0.0
    rehearsed: Pose2 | None = None
    fixed: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class ControllerState:
    """Everything that a cycle leaves to the next.

    Attributes:
        clock, vehicle, goal, task, plans: see there.
        path: the route that the segments of the task are on.
        route: what is known of planned ways; None where none is ever planned.
        area: where the vehicle may be, with the obstacles that were given last.
        queue: commands on their way to the actuators.
        begin: state (6,) that the last cycle's command began to act in, or None at the begin of a segment.
        agenda: of the mission, or None without one.
    """

    clock: ClockState = ClockState()
    vehicle: VehicleEstimate = field(default_factory=VehicleEstimate)
    goal: GoalState = GoalState()
    task: Task
    plans: Plans = Plans()
    path: ReferencePath
    route: RouteState | None = None
    area: Surroundings
    queue: tuple[QueuedCommand, ...] = ()
    begin: Array | None = None
    agenda: Agenda | None = None

    @property
    def now(self) -> float:
        """Time of this cycle on the controller's own clock [s]."""
        return self.clock.now

    @property
    def on_planned_way(self) -> bool:
        """Whether its way was planned in an area, and not given with a corridor."""
        return self.area.corridor.area is not None

    @property
    def on_a_way(self) -> bool:
        """Whether there is a way that it drives on, or stopped on; else it stands on none."""
        return self.task.segment.end is not SegmentEnd.STOP or self.task.stop is not None

    @property
    def goal_pose(self) -> Pose2 | None:
        """The goal; None in an area while none was told."""
        if self.goal.pose is not None:
            return self.goal.pose
        return None if self.route is None else self.route.end

    @property
    def goal_setpoint(self) -> GoalSetpoint | None:
        """The goal that is made for, and where it is from; None where there is none, or none was accepted."""
        pose = self.goal_pose or (None if self.on_planned_way else self.path.end)
        if pose is None or self.goal.rejected:
            return None
        source = self.goal.origin if self.goal.followed is None else GoalOrigin.DETECTED
        return GoalSetpoint(pose=pose, source=source)

    @property
    def is_stationary(self) -> bool:
        """Whether the vehicle stands."""
        return self.vehicle.is_stationary(self.now)

    def suspending(self, search: SuspendedSearch | None) -> ControllerState:
        """With another search to go on with in the next cycle, or none."""
        if search is self.plans.suspended:
            return self
        return replace(self, plans=replace(self.plans, suspended=search))
