"""The table of transitions, and the two functions that run it.

`transition_by_condition` asks in every cycle for the first event whose condition holds. `transition_on` takes
an event that other code reports: a plan, an obstacle, the end of a segment.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from enum import Enum

from rti_mpcc.behaviour import conditions
from rti_mpcc.config import ControllerConfig
from rti_mpcc.planning.context import PlanningContext
from rti_mpcc.planning.state import DRIVING, ControllerState, Phase, Plans, Stall

Condition = Callable[[ControllerState, PlanningContext, ControllerConfig], bool]

STARTING, CONTOURING, ARRIVING, SETTLING, HOLDING, STALLED, PLANNING, WAITING = ANY = tuple(Phase)
SEEKING = (STARTING, *DRIVING)
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
    GOAL_LOST = (*SEEKING, SETTLING, STALLED), STARTING, "it stands, as the goal is too uncertain"
    GOAL_REJECTED = (*SEEKING, SETTLING, STALLED), STARTING, "it stands, as no given goal was accepted"
    FOUND_ELSEWHERE = (*SEEKING, STALLED), STARTING, "the vehicle is relocalised"
    OVERLAP = ON_ROUTE, STARTING, "the body overlaps something"
    SEGMENT_ENDED = ON_ROUTE, STARTING, "the vehicle stands at a cusp: the next segment starts"
    MISTAKE = ON_ROUTE, STARTING, "an internal error in a cycle"
    WAY_LOST = ANY, PLANNING, "another route is needed"
    WAY_PLANNED = (*SEEKING, HOLDING, STALLED, PLANNING, WAITING), STARTING, "a route is planned"
    TOLD_TO_STAND = ANY, WAITING, "the vehicle is commanded to stand"
    TOLD_TO_GO_ON = (WAITING,), STARTING, "the vehicle is commanded to resume its segment"

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


def transition_by_condition(
    s: ControllerState, context: PlanningContext, config: ControllerConfig
) -> ControllerState:
    """The state after the transition of this cycle, if one of the phase's conditions holds."""
    since = conditions.outside_since(s, context, config)
    if since != s.task.outside_since:
        s = replace(s, task=replace(s.task, outside_since=since))
    for holds, phase in _BY_CONDITION[s.task.phase]:
        if holds(s, context, config):
            s = _entering(s, phase)
            if phase is STALLED:
                stall = Stall(target=context.target, obstacles=s.area.standing)
                s = replace(s, task=replace(s.task, stall=stall))
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
        hold = s.task.hold if phase is HOLDING else None
        return replace(s, task=replace(s.task, phase=phase, outside_since=since, hold=hold))
    vehicle = s.vehicle
    if vehicle.standing_since is not None and s.task.phase in (HOLDING, STALLED, WAITING):
        vehicle = replace(vehicle, standing_since=s.now)  # it stood at its target, or as commanded
    task = replace(s.task, arrival=None, phase=STARTING, outside_since=None, hold=None)
    return replace(s, vehicle=vehicle, task=task, plans=Plans())
