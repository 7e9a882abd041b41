"""The state of the controller from one cycle to the next: one frozen value of frozen parts.

Nothing else is kept but caches of the active segment (`course.context`) and the goal's filter.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property
from typing import Self

from geometry import Pose2, ReferencePath
from rti_mpcc.iteration import Solution
from rti_mpcc.manoeuvre import Manoeuvre, Segment, SegmentEnd, Segments
from rti_mpcc.ocp.objectives import ArrivalAtRest, HorizonObjective, Target
from rti_mpcc.types import Array, GoalOrigin, GoalSetpoint, Trajectory
from rti_mpcc.world.world import World


class Phase(Enum):
    """What the vehicle does on the active segment; `course.transitions` leads from one to the next."""

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
    """

    clear_since: float | None = None
    obstacle: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Arrival:
    """One planned arrival at rest.

    Attributes:
        objective: with its latest end; timed_for: the target pose that this was set for.
        overdue_since: since when it has its shortest time to go, whatever distance is left [s], or None.
    """

    objective: ArrivalAtRest
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
        target, arrival: what the plan is for; since: when the search was suspended first [s].
    """

    solution: Solution | None
    iterations: int
    target: Target
    arrival: Arrival | None
    since: float


@dataclass(frozen=True, kw_only=True)
class Task:
    """What the vehicle does on its segment.

    Attributes:
        segment: the one that is driven; later: those that come after it.
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

    segment: Segment
    later: Segments = ()
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

    @classmethod
    def of(cls, segments: Segments, yielding: Yielding | None = None) -> Self:
        """At the first of these segments."""
        return cls(segment=segments[0], later=segments[1:], yielding=yielding)

    @cached_property
    def end(self) -> SegmentEnd:
        """What the vehicle drives to."""
        return self.segment.end if self.stop is None else SegmentEnd.STOP

    @cached_property
    def tolerance(self) -> tuple[float, float, float]:
        """There (longitudinal [m], lateral [m], heading [rad])."""
        return self.segment.tolerance if self.stop is None else self.stop.tolerance

    @cached_property
    def drives(self) -> bool:
        """Whether a plan is being driven."""
        return self.phase in DRIVING

    @cached_property
    def docked(self) -> bool:
        """Whether the vehicle is held at its dock, and was found to stay there."""
        return self.hold is not None and self.hold.docked is not None

    @cached_property
    def objective(self) -> HorizonObjective:
        """Of the QP."""
        if self.successor is not None:
            return self.successor
        return self.segment.objective if self.arrival is None else self.arrival.objective


@dataclass(frozen=True, slots=True, kw_only=True)
class Plans:
    """What was planned on the active segment.

    Attributes:
        solution: the last iterate, which the next cycle resumes, or None.
        driven: the last plan that was accepted for driving, or None; accepted_at: when [s].
        clear_of: number of obstacle changes for which the driven plan was accepted.
        course: number of obstacle changes, and target pose, for which the course's end was found, or None.
        suspended: a search for a first plan that ran out of time, or None.
    """

    solution: Solution | None = None
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
class ControllerState(World):
    """Everything that a cycle leaves to the next.

    Attributes:
        path: the route of the task's segments; route: of route planning, None where it never replans.
        start_state: state (6,) in which the last command starts to act, or None at the start of a segment.
        mission_state: of the mission, which `rti_mpcc.mission` writes and reads, or None.
    """

    task: Task
    plans: Plans = Plans()
    path: ReferencePath
    route: RouteState | None = None
    start_state: Array | None = None
    mission_state: object | None = None

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
        return self.path.end if self.route is None else self.route.end

    @property
    def goal_setpoint(self) -> GoalSetpoint | None:
        """The goal that the controller drives to; None where there is none, or none was accepted."""
        pose = self.goal_pose
        if pose is None or self.goal.rejected:
            return None
        source = self.goal.origin if self.goal.detected is None else GoalOrigin.DETECTED
        return GoalSetpoint(pose=pose, source=source)

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
