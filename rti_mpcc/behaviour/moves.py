"""What changes in the state with an event: functions state -> state."""

from __future__ import annotations

from dataclasses import replace

from geometry import Pose2, ReferencePath
from rti_mpcc.behaviour.transitions import Event, transition_on
from rti_mpcc.iteration import Solution
from rti_mpcc.manoeuvre import Manoeuvre, PlannedStop, Segment, Segments
from rti_mpcc.model.layout import THETA
from rti_mpcc.planning.context import PlanningContext
from rti_mpcc.planning.state import ControllerState, Phase, Plans, RouteState, Task
from rti_mpcc.types import GoalOrigin, Trajectory

NEAR_STOP = 0.2  # [m]; so near to a stop before an obstacle a vehicle stays where it is
STOP_TOLERANCE = (0.2, 1.0, 0.5)  # longitudinal [m], lateral [m], heading [rad] at such a stop

# -- plans ----------------------------------------------------------------------------------------------


def plan_found(s: ControllerState) -> ControllerState:
    """Drive the first plan that was found."""
    s = transition_on(s, Event.CRUISE_FOUND if s.task.arrival is None else Event.ARRIVAL_FOUND)
    return replace(s.suspending(None), task=replace(s.task, driving_since=s.now))


def plan_accepted(s: ControllerState, plan: Trajectory, solution: Solution | None) -> ControllerState:
    """A plan was accepted for driving: nothing holds the vehicle any more.

    `solution`: its iterate, which the next cycle resumes.
    """
    task = s.task
    if task.latched or task.looks_past or task.looked_at is not None:
        looked_at = task.looked_at if task.phase is Phase.CONTOURING else None  # of a cruise
        task = replace(task, latched="", looked_at=looked_at, looks_past=False)
    plans = replace(s.plans, solution=solution, valid=plan, driven=plan, accepted_at=s.now)
    return replace(s, task=task, plans=plans)


# -- stops in front of what blocks the route ------------------------------------------------------------


def stop_before(
    s: ControllerState,
    context: PlanningContext,
    distance: float,
    obstacle_changes: int | None,
    size: float,
    met: str,
) -> ControllerState:
    """Something blocks the route: drive to a stop `distance` [m] ahead, or stay if that is near.

    `obstacle_changes`: after which no route past was found; None: there was no time to search one.
    `size`: see `ControllerConfig.size`.
    """
    stays = distance <= NEAR_STOP * size
    stop = PlannedStop(
        at=float(context.state[THETA]) + max(distance, 0.0),
        goal=s.goal.pose,
        obstacles=obstacle_changes,
        since=s.now,
        met=met,
    )
    s = transition_on(s, Event.WAY_FILLED)
    if stays:
        s = transition_on(s, Event.STOP_IS_HERE)
    along, across, heading = STOP_TOLERANCE
    task = s.task.on(s.task.whole.stopped(stop, (size * along, size * across, heading)))
    return replace(s, task=replace(task, looks_past=task.looks_past and not stays))


def seeking(s: ControllerState, piece: Segment) -> ControllerState:
    """Search a first plan for another stop, or for the whole segment; a suspended search is kept."""
    after = transition_on(s, Event.ANOTHER_SOUGHT).suspending(s.plans.suspended)
    return replace(after, task=after.task.on(piece))


def released(s: ControllerState) -> ControllerState:
    """Drive to the segment's own target again, if the vehicle does not drive."""
    after = transition_on(s, Event.WAY_MAY_BE_FREE)
    return s if after is s else replace(after, task=replace(after.task.on_whole(), looks_past=True))


# -- goals and segments -----------------------------------------------------------------------------------


def with_goal(s: ControllerState, goal: Pose2 | None) -> ControllerState:
    """The planned goal is that of another dock: nothing is known of it yet."""
    if s.task.stop is not None:
        s = transition_on(s, Event.GOAL_CHANGED)
        s = replace(s, task=s.task.on_whole())
    known = replace(
        s.goal,
        dock=goal,
        planned=goal,
        pose=goal,
        estimate=None,
        estimated_at=None,
        estimate_fit=None,
        followed=None,
        undetected="",
        origin=GoalOrigin.PATH_END if goal is None else GoalOrigin.GIVEN,
    )
    return replace(s, goal=known)


def with_goal_corrected(s: ControllerState, goal: Pose2) -> ControllerState:
    """The planned goal of the same dock is known better; its detections are kept."""
    pose = goal if s.goal.followed is None else s.goal.pose
    return replace(s, goal=replace(s.goal, planned=goal, pose=pose, origin=GoalOrigin.GIVEN))


def next_segment(s: ControllerState) -> ControllerState:
    """Start the next segment of the manoeuvre."""
    return replace(
        transition_on(s, Event.SEGMENT_ENDED),
        goal=replace(s.goal, waiting=False),
        task=Task(segments=s.task.on_whole().segments[1:]),
        plans=Plans(),
        begin=None,
    )


def without_way(s: ControllerState, path: ReferencePath, segments: Segments, why: str) -> ControllerState:
    """Stand on this route of no length until a route is planned."""
    assert s.route is not None
    route = replace(s.route, why=why, wanted="", since=s.now, fixed=False)
    s = replace(s, path=path, task=Task(segments=segments), plans=Plans(), route=route, begin=None)
    return transition_on(s, Event.WAY_LOST)


def onto_way(s: ControllerState, manoeuvre: Manoeuvre, route: RouteState) -> ControllerState:
    """Start a manoeuvre that was planned from here, with the last plan until there is another one."""
    if s.goal.pose is None:
        goal = replace(s.goal, dock=manoeuvre.goal, planned=manoeuvre.goal, pose=manoeuvre.goal)
        s = replace(s, goal=goal)
    plans = Plans(driven=s.plans.driven, accepted_at=s.plans.accepted_at) if s.task.drives else Plans()
    s = transition_on(s, Event.WAY_PLANNED)
    task = Task(segments=manoeuvre.segments)
    return replace(s, path=manoeuvre.path, task=task, plans=plans, route=route, begin=None)


def begun_again(s: ControllerState, problem: str) -> ControllerState:
    """After an internal error: no plans are kept, nor, as the segment is a copy, its core."""
    s = transition_on(s, Event.MISTAKE)
    active, *later = s.task.on_whole().segments
    task = replace(s.task, segments=(replace(active), *later), latched=problem)
    if s.task.stop is not None:
        task = task.on(task.whole.stopped(s.task.stop, s.task.segment.tolerance))
    return replace(s, task=task, begin=None)
