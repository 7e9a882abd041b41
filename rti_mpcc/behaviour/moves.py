"""What changes in the state with an event: functions state -> state."""

from __future__ import annotations

from dataclasses import replace

from geometry import Pose2, ReferencePath
from rti_mpcc.behaviour.transitions import Event, transition_on
from rti_mpcc.iteration import Solution
from rti_mpcc.manoeuvre import Manoeuvre, Segments
from rti_mpcc.planning.state import ControllerState, Phase, PlannedStop, Plans, RouteState, Task
from rti_mpcc.types import GoalOrigin, Trajectory

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
    if task.latched or task.looked_at is not None:
        looked_at = task.looked_at if task.phase is Phase.CONTOURING else None  # of a cruise
        task = replace(task, latched="", looked_at=looked_at)
    plans = replace(
        s.plans, solution=solution, valid=plan, driven=plan, accepted_at=s.now, clear_of=s.area.changes
    )
    return replace(s, task=task, plans=plans)


# -- goals and segments -----------------------------------------------------------------------------------


def with_goal(s: ControllerState, goal: Pose2 | None) -> ControllerState:
    """The planned goal is that of another dock: nothing is known of it yet."""
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
        task=Task(segments=s.task.segments[1:]),
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
    plans = _last_plan(s)
    s = transition_on(s, Event.WAY_PLANNED)
    task = Task(segments=manoeuvre.segments)
    return replace(s, path=manoeuvre.path, task=task, plans=plans, route=route, begin=None)


def onto_course(s: ControllerState, stop: PlannedStop | None, *, here: bool) -> ControllerState:
    """The course ends elsewhere: plan to there, with the last plan until then; `here`: stay at the stop."""
    plans = replace(_last_plan(s), course=s.plans.course)
    s = transition_on(s, Event.COURSE_CHANGED)
    if here:
        s = transition_on(s, Event.STOP_IS_HERE)
    return replace(s, task=replace(s.task, stop=stop), plans=plans)


def _last_plan(s: ControllerState) -> Plans:
    """Of all plans only the one that is driven, as long as it is clear."""
    if not s.task.drives:
        return Plans()
    return Plans(driven=s.plans.driven, accepted_at=s.plans.accepted_at, clear_of=s.plans.clear_of)


def begun_again(s: ControllerState, problem: str) -> ControllerState:
    """After an internal error: no plans are kept, nor, as the segment is a copy, its core."""
    s = transition_on(s, Event.MISTAKE)
    active, *later = s.task.segments
    task = replace(s.task, segments=(replace(active), *later), latched=problem)
    return replace(s, task=task, begin=None)
