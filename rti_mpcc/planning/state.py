"""The state of the controller from one cycle to the next: one frozen value of frozen parts.

Nothing else is kept but caches of the active segment (`planning.workspace`) and the goal's filter.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import Enum

from estimation import DisturbanceEstimate, GoalEstimate, PoseHistory
from estimation.actuators import ActuatorRecord
from geometry import Pose2, ReferencePath
from rti_mpcc.iteration import Solution
from rti_mpcc.manoeuvre import Manoeuvre, Segment, SegmentEnd, Segments
from rti_mpcc.model.actuators import Actuation, Actuators
from rti_mpcc.model.delay import QueuedCommand
from rti_mpcc.model.disturbance import UNDISTURBED, Disturbance
from rti_mpcc.ocp.objectives import ArrivalAtRest, HorizonObjective
from rti_mpcc.ocp.targets import Target
from rti_mpcc.planning.goals import NO_TERMS, GoalFit, GoalTerms
from rti_mpcc.planning.mission_state import MissionState
from rti_mpcc.planning.plausibility import StateMonitor
from rti_mpcc.planning.standstill import AxisMotion
from rti_mpcc.planning.surroundings import Surroundings
from rti_mpcc.types import Array, GoalOrigin, GoalSetpoint, Trajectory


class Phase(Enum):
    """What the vehicle does on the active segment; `behaviour.transitions` leads from one to the next."""

    STARTING = "starting"
    CONTOURING = "contouring"
    ARRIVING = "arriving"
    SETTLING = "settling"
    HOLDING = "holding"
    STALLED = "stalled"
    PLANNING = "planning"
    WAITING = "waiting"


DRIVING = (Phase.CONTOURING, Phase.ARRIVING)


@dataclass(frozen=True, slots=True, kw_only=True)
class Yielding:
    """A vehicle that brakes, or stands, as its plan is not clear.

    Attributes:
        clear_since: since when its plan is clear [s], or None.
        obstacle: what its plan met last, and where, or "".
        no_time: why there was no time for another plan, or "".
    """

    clear_since: float | None = None
    obstacle: str = ""
    no_time: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Arrival:
    """One planned arrival at rest.

    Attributes:
        latest: its latest end [s]; timed_for: the target pose that this was set for.
        overdue_since: since when it has its shortest time to go, whatever distance is left [s], or None.
    """

    latest: float
    timed_for: Pose2
    overdue_since: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Hold:
    """A vehicle that is held at its dock.

    Attributes:
        anchor: pose of the rear axle where it is held; since: from when on [s].
        integral: acceleration [m/s²] that is commanded to stay there; balanced: when it was found last [s];
            corrected_by: by how much it differed at first from the estimated disturbance [m/s²].
        docked: pose in the target's frame when it was found to stay there; None: not yet.
    """

    anchor: Pose2
    since: float
    integral: float
    balanced: float
    corrected_by: float = 0.0
    docked: Pose2 | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannedStop:
    """Where the course ends in front of a static obstacle.

    Attributes:
        at: progress [m]; tolerance: there (longitudinal [m], lateral [m], heading [rad]).
        obstacle: what blocks the route, and where, for the reasons of commands.
    """

    at: float
    tolerance: tuple[float, float, float]
    obstacle: str


@dataclass(frozen=True, slots=True, kw_only=True)
class SuspendedSearch:
    """A search for a first plan that is resumed in the next cycle.

    Attributes:
        solution: the last iterate that was solved, or None; iterations: number of QPs that were solved.
        iterate: of the QP that was stopped, or None.
        target, arrival: what the plan is for.
    """

    solution: Solution | None
    iterations: int
    iterate: tuple[Array, Array] | None
    target: Target
    arrival: Arrival | None


@dataclass(frozen=True, slots=True, kw_only=True)
class ClockState:
    """The controller's own clock, which never runs back.

    Attributes:
        time: [s]; None before the first cycle; offset: how far it is ahead of the user's clock [s].
        shown: last time on the user's clock [s]; stood: number of cycles in which that did not change.
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
    """The estimate of the vehicle.

    Attributes:
        monitor: its state, and why a measurement is doubted.
        offsets: the estimate of the disturbance, or None; disturbance: by it, none where it is not known.
        poses: of the last moments.
        heading_hint: remark on the first measured heading, or "".
        actuators: dead times and lags of drive and steering; records: what is learnt of both.
        standing_since: when it came to rest, or restarted at rest [s]; None while it moves.
        motion: along its axis, of the last moments.
    """

    monitor: StateMonitor = field(default_factory=StateMonitor)
    offsets: DisturbanceEstimate | None = None
    disturbance: Disturbance = UNDISTURBED
    poses: PoseHistory = field(default_factory=PoseHistory)
    heading_hint: str = ""
    actuators: Actuators = field(default_factory=Actuators)
    records: tuple[ActuatorRecord, ActuatorRecord] = field(
        default_factory=lambda: (ActuatorRecord(), ActuatorRecord())
    )
    standing_since: float | None = None
    motion: AxisMotion = field(default_factory=AxisMotion)

    @property
    def dead_time(self) -> float:
        """From a command until it acts [s]."""
        return self.actuators.dead_time

    @property
    def braking_delay(self) -> float:
        """From a command to brake until the drive has answered it [s]."""
        return self.actuators.dead_time + self.actuators.drive.lag

    def is_stationary(self, now: float, seconds: float = 0.0) -> bool:
        """Whether it has been standing for `seconds` at `now` [s]."""
        return self.standing_since is not None and now - self.standing_since >= seconds


def disturbance_by(estimate: DisturbanceEstimate | None) -> Disturbance:
    """The disturbance by its estimate; none where there is no estimate."""
    if estimate is None:
        return UNDISTURBED
    return Disturbance(estimate.acceleration, estimate.steering, estimate.gain, estimate.turn)


@dataclass(frozen=True, slots=True, kw_only=True)
class GoalState:
    """What is known of the goal.

    Attributes:
        planned: the user's goal pose, or None for the path's last pose; dock: the first one of its dock.
        given: the user's goal as it was given last, see `goals.steadied`.
        fit, given_fit: the checks of the planned goal and of the given one; None: not checked yet.
        origin: of the planned goal; refusal: why the given goal was rejected, or "".
        pose: the setpoint: `planned`, or by detections; None for the path's last pose.
        estimate: by detections, or None; estimated_at: when [s]; estimate_fit: its check, or None.
        detected: the last detected goal that passed its check, or None.
        undetected: why the last detection was rejected, while none was accepted, or "".
        waiting: the vehicle stops, or stands, before a goal that is not known well enough.
        terms: of the goal, in place of the settings.
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
    detected: Pose2 | None = None
    undetected: str = ""
    waiting: bool = False
    terms: GoalTerms = NO_TERMS

    @property
    def accepted(self) -> bool:
        """Whether a given or detected goal was accepted."""
        return self.origin is GoalOrigin.GIVEN or self.detected is not None

    @property
    def rejected(self) -> bool:
        """Whether the given goal was rejected, and no other one was accepted."""
        return self.refusal != "" and not self.accepted


@dataclass(frozen=True, slots=True, kw_only=True)
class Task:
    """What the vehicle does on its segment.

    Attributes:
        segments: the rest of the manoeuvre, the first one being driven.
        target: of the segment; None before the first cycle.
        stop: in front of what blocks the segment; None where it is clear.
        arrival: the planned one, or None while contouring.
        successor: the objective that has taken over from the segment's own, or None.
        yielding: while the vehicle halts in front of something, or None.
        stop_reason: why the vehicle was stopped, until a plan is driven again, or "".
        last_attempt: when the last search for a first plan, or for an arrival, failed [s], or None.
        stalled_at: target pose, and number of obstacle changes, of the last stall, or None.
        hold: while the vehicle is held at its dock, or None.
        outside_since: since when a vehicle that holds is outside the tolerance [s], or None.
        driving_since: when the present plan was started, or the last halt ended [s].
        at_once: commanded to stand, the vehicle brakes as hard as it can.
    """

    segments: Segments
    phase: Phase = Phase.STARTING
    target: Target | None = None
    stop: PlannedStop | None = None
    arrival: Arrival | None = None
    successor: HorizonObjective | None = None
    yielding: Yielding | None = None
    stop_reason: str = ""
    last_attempt: float | None = None
    stalled_at: tuple[Pose2, int] | None = None
    hold: Hold | None = None
    outside_since: float | None = None
    driving_since: float = 0.0
    at_once: bool = False

    @property
    def segment(self) -> Segment:
        """The segment that is driven."""
        return self.segments[0]

    @property
    def end(self) -> SegmentEnd:
        """What the vehicle drives to."""
        return self.segment.end if self.stop is None else SegmentEnd.STOP

    @property
    def tolerance(self) -> tuple[float, float, float]:
        """There (longitudinal [m], lateral [m], heading [rad])."""
        return self.segment.tolerance if self.stop is None else self.stop.tolerance

    @property
    def drives(self) -> bool:
        """Whether a plan is being driven."""
        return self.phase in DRIVING

    @property
    def objective(self) -> HorizonObjective:
        """Of the QP."""
        if self.successor is not None:
            return self.successor
        return self.segment.objective if self.arrival is None else ArrivalAtRest(latest=self.arrival.latest)


@dataclass(frozen=True, slots=True, kw_only=True)
class Plans:
    """What was planned on the active segment.

    Attributes:
        solution: the last iterate, which the next cycle resumes, or None.
        valid: the last plan that passed the checks, driven or not, or None: a clean retry starts from it.
        driven: the last plan that was accepted for driving, or None; accepted_at: when [s].
        clear_of: number of obstacle changes for which the driven plan was accepted.
        course: number of obstacle changes, and the segment's target pose, for which the end of the course was
            found; None: not yet.
        suspended: a search for a first plan that ran out of time, or None.
    """

    solution: Solution | None = None
    valid: Trajectory | None = None
    driven: Trajectory | None = None
    accepted_at: float | None = None
    clear_of: int = 0
    course: tuple[int, Pose2] | None = None
    suspended: SuspendedSearch | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class RouteState:
    """Route planning of a controller that replans.

    Attributes:
        end: of the given path, the goal while there is no other one; None in an area.
        manoeuvre: the last one that was planned, found or not; None before the first one.
        replan_reason: why it replans, or "".
        request: why the search for a first plan asks for another route, or "".
        since: when the present route was started, or the last search [s].
        changes: number of obstacle changes known to the last search.
        routes: number of routes started, a given path included; seconds: time of all searches.
        goal_checked: goal whose reachability was checked last, or None.
        fixed: the present route is not replaced, a straight move say.
    """

    end: Pose2 | None = None
    manoeuvre: Manoeuvre | None = None
    replan_reason: str = ""
    request: str = ""
    since: float = 0.0
    changes: int = 0
    routes: int = 0
    seconds: float = 0.0
    goal_checked: Pose2 | None = None
    fixed: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class ControllerState:
    """Everything that a cycle leaves to the next.

    Attributes:
        path: the route of the task's segments; route: of route planning, None where it never replans.
        area: the free space, with the obstacles that were given last.
        queue: commands that do not act yet, as they will act; sent: the last ones, as they were sent.
        start_state: state (6,) in which the last command starts to act, or None at the start of a segment.
        mission_state: of the mission, or None.
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
    sent: tuple[Actuation, ...] = ()
    start_state: Array | None = None
    mission_state: MissionState | None = None

    @property
    def now(self) -> float:
        """Time of this cycle on the controller's own clock [s]."""
        return self.clock.time or 0.0

    @property
    def arrives_at(self) -> float | None:
        """When the driven plan arrives [s]; None while contouring."""
        plan = self.plans.driven
        return None if self.task.arrival is None or plan is None else float(plan.times[-1])

    @property
    def on_planned_route(self) -> bool:
        """Whether the route was planned in an area, not given with a corridor."""
        return self.area.corridor.area is not None

    @property
    def has_route(self) -> bool:
        """Whether there is a route that it drives or has stopped on."""
        return self.task.segment.end is not SegmentEnd.STOP

    @property
    def goal_pose(self) -> Pose2 | None:
        """The goal; None in an area while none was given."""
        if self.goal.pose is not None:
            return self.goal.pose
        return None if self.route is None else self.route.end

    @property
    def goal_setpoint(self) -> GoalSetpoint | None:
        """The goal that the controller drives to; None where there is none, or none was accepted."""
        pose = self.goal_pose or (None if self.on_planned_route else self.path.end)
        if pose is None or self.goal.rejected:
            return None
        source = self.goal.origin if self.goal.detected is None else GoalOrigin.DETECTED
        return GoalSetpoint(pose=pose, source=source)

    @property
    def is_stationary(self) -> bool:
        """Whether the vehicle stands."""
        return self.vehicle.is_stationary(self.now)

    def iterated(self, solution: Solution | None) -> ControllerState:
        """With the last iterate that was solved; None: with the one before."""
        if solution is None:
            return self
        return replace(self, plans=replace(self.plans, solution=solution))

    def suspending(self, search: SuspendedSearch | None) -> ControllerState:
        """With another suspended search, or none."""
        if search is self.plans.suspended:
            return self
        return replace(self, plans=replace(self.plans, suspended=search))
