"""The table of transitions, the two functions that run it, what an event changes, and where the course ends.

`transition_by_condition` asks in every cycle for the first event whose condition holds. `transition_on` takes
an event that other code reports: a plan, an obstacle, the end of a segment.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from enum import Enum
from math import ceil

import numpy as np

from geometry import Pose2, ReferencePath
from rti_mpcc.config import ControllerConfig
from rti_mpcc.course import collision_check, conditions
from rti_mpcc.course.context import PlanningContext
from rti_mpcc.course.guess import Course, along_course
from rti_mpcc.course.route_start import CHECK_SPACING
from rti_mpcc.iteration import Solution
from rti_mpcc.manoeuvre import Manoeuvre, Segment, SegmentEnd
from rti_mpcc.model.layout import POSE, THETA
from rti_mpcc.ocp.objectives import Target, apart
from rti_mpcc.state import DRIVING, ControllerState, Phase, PlannedStop, Plans, RouteState, Task, Yielding
from rti_mpcc.types import Array, Trajectory

Condition = Callable[[ControllerState, PlanningContext], bool]

STARTING, CONTOURING, ARRIVING, SETTLING, HOLDING, STALLED, PLANNING, WAITING = ANY = tuple(Phase)
SEEKING = (STARTING, *DRIVING)
NO_MANOEUVRE = 1.0  # [m], length of the straight route of a vehicle that stands without a manoeuvre
ON_ROUTE = tuple(phase for phase in Phase if phase not in (PLANNING, WAITING))


class Event(Enum):
    """What happens to a vehicle on its segment: a row of the table.

    Attributes:
        sources: phases in which it counts; to: the phase that follows.
        when: the condition that is asked for in every cycle; None: other code reports it.
    """

    # By condition: of the rows of a phase the first one that holds.
    STOP_ENDS_INSIDE = DRIVING, SETTLING, conditions.stop_ends_inside
    TARGET_BEHIND = SEEKING, STALLED, conditions.passes_target
    STUCK_INSIDE = DRIVING, HOLDING, conditions.stuck_inside
    NO_PROGRESS = DRIVING, STALLED, conditions.no_progress
    PLAN_MISSES = (ARRIVING,), STALLED, conditions.plan_misses
    INSIDE = (STARTING,), HOLDING, conditions.stands_inside
    WELL_INSIDE = (STALLED,), HOLDING, conditions.stands_well_inside
    MISSES = (SETTLING,), STARTING, conditions.will_stop_outside
    OUTSIDE = (SETTLING, HOLDING), STARTING, conditions.stands_outside
    AT_REST = (SETTLING,), HOLDING, conditions.came_to_rest
    TARGET_MOVED = (STALLED,), STARTING, conditions.target_moved
    OBSTACLES_CHANGED = (STALLED,), STARTING, conditions.surroundings_changed
    # Reported by the code that finds it.
    CRUISE_FOUND = SEEKING, CONTOURING, "a plan along the path is found"
    ARRIVAL_FOUND = SEEKING, ARRIVING, "a plan that arrives is found"
    COURSE_CHANGED = (*SEEKING, SETTLING, HOLDING), STARTING, "the course ends elsewhere"
    STOP_IS_HERE = (STARTING,), HOLDING, "it ends right here, before an obstacle: the vehicle stays"
    STANDS_BLOCKED = SEEKING, STARTING, "the vehicle has stood blocked for a while: it searches again"
    PLAN_LOST = (*SEEKING, SETTLING), STARTING, "no plan may be driven: the vehicle brakes"
    GOAL_LOST = (*SEEKING, SETTLING, STALLED), STARTING, "it stands, as its goal is rejected or too uncertain"
    RELOCALISED = (*SEEKING, STALLED), STARTING, "the vehicle is relocalised"
    OVERLAP = ON_ROUTE, STARTING, "the body overlaps something"
    SEGMENT_ENDED = ON_ROUTE, STARTING, "the vehicle stands at a cusp: the next segment starts"
    INTERNAL_ERROR = ON_ROUTE, STARTING, "an internal error in a cycle"
    ROUTE_LOST = ANY, PLANNING, "another route is needed"
    ROUTE_PLANNED = (*SEEKING, HOLDING, STALLED, PLANNING, WAITING), STARTING, "a route is planned"
    COMMANDED_TO_STAND = ANY, WAITING, "the vehicle is commanded to stand"
    COMMANDED_TO_RESUME = (WAITING,), STARTING, "the vehicle is commanded to resume its segment"

    sources: tuple[Phase, ...]
    to: Phase
    when: Condition | None

    def __new__(cls, sources: tuple[Phase, ...], to: Phase, how: Condition | str) -> Event:
        """The value is the text of the event, or the first line of its condition's docstring."""
        event = object.__new__(cls)
        event.sources, event.to, event.when = sources, to, None if isinstance(how, str) else how
        event._value_ = how if isinstance(how, str) else (how.__doc__ or how.__name__).partition("\n")[0]
        return event


_BY_CONDITION = {p: [(e.when, e.to) for e in Event if e.when and p in e.sources] for p in Phase}


def transition_by_condition(s: ControllerState, context: PlanningContext) -> ControllerState:
    """The state after the transition of this cycle, if one of the phase's conditions holds."""
    if s.task.phase in (SETTLING, HOLDING):
        since = conditions.outside_since(s, context)
        if since != s.task.outside_since:
            s = replace(s, task=replace(s.task, outside_since=since))
    for holds, phase in _BY_CONDITION[s.task.phase]:
        if holds(s, context):
            s = _entering(s, phase)
            if phase is STALLED:
                s = replace(s, task=replace(s.task, stalled_at=(context.target.pose, s.area.changes)))
            return s
    return s


def transition_on(s: ControllerState, event: Event) -> ControllerState:
    """The state after a reported event; the same where it does not count in this phase."""
    counts = event.when is None and s.task.phase in event.sources
    return _entering(s, event.to) if counts else s


def _entering(s: ControllerState, phase: Phase) -> ControllerState:
    """A vehicle that starts plans its segment again from where it is; one that holds is inside."""
    if phase is not STARTING:
        since = None if phase is HOLDING else s.task.outside_since
        hold = s.task.hold if phase in (HOLDING, WAITING) else None
        return replace(s, task=replace(s.task, phase=phase, outside_since=since, hold=hold))
    vehicle = s.vehicle
    if vehicle.standing_since is not None and s.task.phase in (HOLDING, STALLED, WAITING):
        vehicle = replace(vehicle, standing_since=s.clock.now)  # it stood at its target, or as commanded
    task = replace(s.task, arrival=None, phase=STARTING, outside_since=None, hold=None)
    return replace(s, vehicle=vehicle, task=task, plans=Plans())


# -- plans ----------------------------------------------------------------------------------------------


def plan_found(s: ControllerState) -> ControllerState:
    """Drive the first plan that was found."""
    s = transition_on(s, Event.CRUISE_FOUND if s.task.arrival is None else Event.ARRIVAL_FOUND)
    return replace(s.suspending(None), task=replace(s.task, driving_since=s.clock.now))


def plan_accepted(s: ControllerState, plan: Trajectory, solution: Solution | None) -> ControllerState:
    """A plan was accepted for driving: nothing holds the vehicle any more.

    `solution`: its iterate, which the next cycle resumes.
    """
    task = s.task
    if task.stop_reason or task.last_attempt is not None:
        last_attempt = task.last_attempt if task.phase is Phase.CONTOURING else None  # of a cruise
        task = replace(task, stop_reason="", last_attempt=last_attempt)
    plans = replace(s.plans, solution=solution, driven=plan, accepted_at=s.clock.now, clear_of=s.area.changes)
    return replace(s, task=task, plans=plans)


# -- goals and segments -----------------------------------------------------------------------------------


def next_segment(s: ControllerState) -> ControllerState:
    """Start the next segment of the manoeuvre."""
    return replace(
        transition_on(s, Event.SEGMENT_ENDED),
        goal=replace(s.goal, waiting=False),
        task=Task.of(s.task.later),
        plans=Plans(),
        start_state=None,
    )


def standing_route(here: Pose2) -> tuple[ReferencePath, Task]:
    """A straight route where the vehicle stands, which is not driven, and the task on it."""
    path = ReferencePath.from_segments(start=here, segments=[(1, 0.0, NO_MANOEUVRE)])
    return path, Task(segment=Segment(part=path.parts[0], index=0, end=SegmentEnd.STOP))


def without_route(s: ControllerState, here: Pose2, why: str) -> ControllerState:
    """Stand here until a route is planned."""
    assert s.route is not None
    route = replace(s.route, replan_reason=why, request="", since=s.clock.now, fixed=False)
    path, task = standing_route(here)
    task = replace(task, yielding=_lasting_yielding(s))
    s = replace(s, path=path, task=task, plans=Plans(), route=route, start_state=None)
    return transition_on(s, Event.ROUTE_LOST)


def onto_route(s: ControllerState, manoeuvre: Manoeuvre, route: RouteState) -> ControllerState:
    """Start a manoeuvre that was planned from here, with the last plan until there is another one."""
    if s.goal.pose is None:
        goal = replace(s.goal, dock=manoeuvre.goal, planned=manoeuvre.goal, pose=manoeuvre.goal)
        s = replace(s, goal=goal)
    plans = _last_plan(s)
    s = transition_on(s, Event.ROUTE_PLANNED)
    task = Task.of(manoeuvre.segments, yielding=_lasting_yielding(s))
    return replace(s, path=manoeuvre.path, task=task, plans=plans, route=route, start_state=None)


def _lasting_yielding(s: ControllerState) -> Yielding | None:
    """Yielding to an obstacle that moves: another route has to stay clear of it as long as the last one."""
    return s.task.yielding if s.area.tracked.moving else None


def _last_plan(s: ControllerState) -> Plans:
    """Of all plans only the one that is driven, as long as it is clear."""
    if not s.task.drives:
        return Plans()
    return Plans(driven=s.plans.driven, accepted_at=s.plans.accepted_at, clear_of=s.plans.clear_of)


def restarted(s: ControllerState, problem: str) -> ControllerState:
    """After an internal error: no plans are kept, nor, as the segment is a copy, its core."""
    s = transition_on(s, Event.INTERNAL_ERROR)
    task = replace(s.task, segment=replace(s.task.segment), stop_reason=problem)
    return replace(s, task=task, start_state=None)


# -- where the course ends: in front of a static obstacle that blocks it -----------------------------------

NEAR_STOP = 0.2  # [m]; so near to a stop before an obstacle a vehicle stays where it is
SAME_STOP = 0.4  # [m]; a stop that moves by less stays
STOP_TOLERANCE = (0.2, 1.0, 0.5)  # longitudinal [m], lateral [m], heading [rad] at a stop


def on_course(s: ControllerState, context: PlanningContext) -> ControllerState:
    """With the course up to the first static obstacle that blocks it, if obstacles or target have changed."""
    task, target = s.task, s.task.target
    at_stop = task.stop is not None and task.phase in (Phase.SETTLING, Phase.HOLDING)
    if target is None or context.doubt or not (at_stop or task.phase in SEEKING):
        return s
    if s.plans.course is not None:
        changes, pose = s.plans.course
        if changes == s.area.changes and apart(pose, target.pose) <= conditions.TARGET_MOVED:
            return s
    s = replace(s, plans=replace(s.plans, course=(s.area.changes, target.pose)))
    stop = _blocked(s, context, target)
    if stop is None:
        return s if task.stop is None else _onto_course(s, None, here=False)
    if task.stop is not None and abs(task.stop.at - stop.at) <= SAME_STOP:
        return s
    here = stop.at - float(context.state[THETA]) <= NEAR_STOP * context.config.size
    return _onto_course(s, stop, here=here)


def _onto_course(s: ControllerState, stop: PlannedStop | None, *, here: bool) -> ControllerState:
    """The course ends elsewhere: plan to there, with the last plan until then; `here`: stay at the stop."""
    plans = replace(_last_plan(s), course=s.plans.course)
    s = transition_on(s, Event.COURSE_CHANGED)
    if here:
        s = transition_on(s, Event.STOP_IS_HERE)
    return replace(s, task=replace(s.task, stop=stop), plans=plans)


def _blocked(s: ControllerState, context: PlanningContext, target: Target) -> PlannedStop | None:
    """The stop in front of the first static obstacle that the body on the course to the target touches."""
    config = context.config
    if not (s.area.replaced or s.area.corridor.obstacles):
        return None
    states, segment = _ahead(s, context.state, target, config), s.task.segment
    first = collision_check.first_blocked(s, states, config)
    if first is None:
        return None
    x, y, phi = states[first, :POSE].tolist()
    begin, there = float(context.state[THETA]), segment.part.project(x, y, heading=phi)
    along, across, heading = STOP_TOLERANCE
    return PlannedStop(
        at=max(there - collision_check.stop_clearance(config), begin),
        tolerance=(config.size * along, config.size * across, heading),
        obstacle=str(collision_check.nearest_object(states[first, :POSE], s.area, segment.index, config)),
    )


def _ahead(s: ControllerState, state: Array, target: Target, config: ControllerConfig) -> Array:
    """States (n, 6) on the course: on the driven plan and the segment behind it, or from `state` on.

    Not from the end of that plan: it cuts bends, and its way back is no part of the course.
    """
    part, driven = s.task.segment.part, state[None]
    if s.task.drives and s.plans.driven is not None:
        *_, driven = collision_check.bodies_along(s.plans.driven, config)
        x, y, phi = driven[-1, :POSE].tolist()
        theta = part.project(x, y, heading=phi)
        at = part.pose(theta)
        state = np.array([at.x, at.y, at.phi, 0.0, 0.0, theta])
    left = target.theta - float(state[THETA])
    if left <= CHECK_SPACING:
        return driven
    bodies = min(ceil(left / CHECK_SPACING) + 1, collision_check.MOST_BODIES)
    further = np.linspace(0.0, left, bodies)
    ahead = along_course(Course(part, target), state, further, np.zeros(bodies), config)
    return np.concatenate((driven, ahead))
