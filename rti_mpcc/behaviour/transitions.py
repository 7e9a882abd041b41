"""The table of transitions, and the two functions that run it.

`transition_by_condition` asks in every cycle for the first row whose condition holds. `transition_on` takes
the row of an event that other code reports: a plan, an obstacle, the end of a segment. Whoever begins again
forgets earlier plans.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum

from rti_mpcc.behaviour import conditions
from rti_mpcc.config import ControllerConfig
from rti_mpcc.planning.context import PlanningContext
from rti_mpcc.planning.state import DRIVING, ControllerState, Phase, Plans, Stall, Task


class Event(Enum):
    """What happens to a vehicle on its segment."""

    STOP_ENDS_INSIDE = "braking in comfort it would stop inside the tolerance"
    AT_REST = "it has come to rest inside the tolerance, or before something in the way"
    INSIDE = "it stands inside the tolerance already"
    STUCK_INSIDE = (
        "it gets no nearer, and need not: it is inside the tolerance, or before something in the way"
    )
    MISSES = "it will stop outside the tolerance"
    OUTSIDE = "it stands outside the tolerance"
    NO_PROGRESS = "it gets no nearer"
    TARGET_BEHIND = "its target is behind it, or will be"
    PLAN_MISSES = "its arrival is due, and its plan ends outside the tolerance"
    TARGET_MOVED = "the target is elsewhere"
    OBSTACLES_CHANGED = "what stands around it has changed, and it has stood for a while"
    CRUISE_FOUND = "a plan along the path was found"
    ARRIVAL_FOUND = "a plan that arrives was found"
    ANOTHER_SOUGHT = "a plan to another end is looked for, as a trial"
    WAY_FILLED = "something fills the way ahead: a stop before it"
    STOP_IS_HERE = "that stop is right here: it stays"
    WAY_MAY_BE_FREE = "what it stopped before has changed, or may be passed from here"
    STANDS_BLOCKED = "it has stood blocked for a while: it looks again"
    OVERLAP = "the body overlaps something"
    PLAN_LOST = "there is no plan that may be driven: it brakes"
    GOAL_LOST = "it stands before a goal that is not known well enough"
    GOAL_REJECTED = "it stands, for no goal that was asked for was accepted"
    GOAL_CHANGED = "the goal of another dock is given, and the stop made for is not meant any more"
    FOUND_ELSEWHERE = "the vehicle is not where it was believed to be"
    SEGMENT_ENDED = "it stands at a cusp"
    MISTAKE = "this program went wrong in a cycle"
    WAY_LOST = "another way is to be planned"
    WAY_PLANNED = "a way was planned"
    TOLD_TO_STAND = "it is told to stand"
    TOLD_TO_GO_ON = "it is told to go on with the segment that it was stopped on"


Condition = Callable[[ControllerState, PlanningContext, ControllerConfig], bool]
Effect = Callable[[ControllerState, PlanningContext], Task]


def _remembers_why(s: ControllerState, context: PlanningContext) -> Task:
    return replace(s.task, stall=Stall(target=context.target, obstacles=s.area.standing))


@dataclass(frozen=True, slots=True)
class Transition:
    """A row of the table.

    Attributes:
        sources: phases in which it is looked for, or reported; event: what happens; to: the next phase.
        when: how it is looked for in every cycle; None: it is reported.
        effect: what else changes, of a row that is looked for; of the others whoever reports it sees to that.
    """

    sources: tuple[Phase, ...]
    event: Event
    to: Phase
    when: Condition | None = None
    effect: Effect | None = None


STARTING, CONTOURING, ARRIVING, SETTLING, HOLDING, STALLED, PLANNING, WAITING = ANY = tuple(Phase)
SEEKING = (STARTING, *DRIVING)
ON_ITS_WAY = tuple(phase for phase in Phase if phase not in (PLANNING, WAITING))

TRANSITIONS = (
    # Looked for in every cycle: of the rows of a phase the first one that holds.
    Transition(DRIVING, Event.STOP_ENDS_INSIDE, SETTLING, conditions.stop_ends_inside),
    Transition((STARTING, *DRIVING), Event.TARGET_BEHIND, STALLED, conditions.passes_target, _remembers_why),
    Transition(DRIVING, Event.STUCK_INSIDE, HOLDING, conditions.stuck_inside),
    Transition(DRIVING, Event.NO_PROGRESS, STALLED, conditions.no_progress, _remembers_why),
    Transition((ARRIVING,), Event.PLAN_MISSES, STALLED, conditions.plan_misses, _remembers_why),
    Transition((STARTING,), Event.INSIDE, HOLDING, conditions.stands_inside),
    Transition((STALLED,), Event.INSIDE, HOLDING, conditions.stands_well_inside),
    Transition((SETTLING,), Event.MISSES, STARTING, conditions.will_stop_outside),
    Transition((SETTLING, HOLDING), Event.OUTSIDE, STARTING, conditions.stands_outside),
    Transition((SETTLING,), Event.AT_REST, HOLDING, conditions.came_to_rest),
    Transition((STALLED,), Event.TARGET_MOVED, STARTING, conditions.target_moved),
    Transition((STALLED,), Event.OBSTACLES_CHANGED, STARTING, conditions.obstacles_changed),
    # Reported by the code that finds it.
    Transition(SEEKING, Event.CRUISE_FOUND, CONTOURING),
    Transition(SEEKING, Event.ARRIVAL_FOUND, ARRIVING),
    Transition(DRIVING, Event.ANOTHER_SOUGHT, STARTING),
    Transition(SEEKING, Event.WAY_FILLED, STARTING),
    Transition((STARTING,), Event.STOP_IS_HERE, HOLDING),
    Transition((STARTING, SETTLING, HOLDING), Event.WAY_MAY_BE_FREE, STARTING),
    Transition(SEEKING, Event.STANDS_BLOCKED, STARTING),
    Transition((*SEEKING, SETTLING), Event.PLAN_LOST, STARTING),
    Transition((*SEEKING, SETTLING, STALLED), Event.GOAL_LOST, STARTING),
    Transition((*SEEKING, SETTLING, STALLED), Event.GOAL_REJECTED, STARTING),
    Transition((*SEEKING, STALLED), Event.FOUND_ELSEWHERE, STARTING),
    Transition(ON_ITS_WAY, Event.OVERLAP, STARTING),
    Transition(ON_ITS_WAY, Event.GOAL_CHANGED, STARTING),
    Transition(ON_ITS_WAY, Event.SEGMENT_ENDED, STARTING),
    Transition(ON_ITS_WAY, Event.MISTAKE, STARTING),
    Transition(ANY, Event.WAY_LOST, PLANNING),
    Transition((*SEEKING, HOLDING, STALLED, PLANNING, WAITING), Event.WAY_PLANNED, STARTING),
    Transition(ANY, Event.TOLD_TO_STAND, WAITING),
    Transition((WAITING,), Event.TOLD_TO_GO_ON, STARTING),
)
_LOOKED_FOR = {p: [row for row in TRANSITIONS if row.when and p in row.sources] for p in Phase}
_REPORTED = {(p, row.event): row for row in TRANSITIONS if not row.when for p in row.sources}


def transition_by_condition(
    s: ControllerState, context: PlanningContext, config: ControllerConfig
) -> ControllerState:
    """The state after the transition of this cycle, if one of the phase's conditions holds."""
    since = conditions.outside_since(s, context)
    if since != s.task.outside_since:
        s = replace(s, task=replace(s.task, outside_since=since))
    for row in _LOOKED_FOR[s.task.phase]:
        if row.when is not None and row.when(s, context, config):
            s = _entering(s, row.to)
            return s if row.effect is None else replace(s, task=row.effect(s, context))
    return s


def transition_on(s: ControllerState, event: Event) -> ControllerState:
    """The state after an event; the same where it changes nothing in this phase."""
    row = _REPORTED.get((s.task.phase, event))
    if row is None:
        return s
    return _entering(s, row.to)


def _entering(s: ControllerState, phase: Phase) -> ControllerState:
    """Whoever starts begins the segment again from where the vehicle is, whoever holds is inside."""
    if phase is STARTING:
        return _beginning(s)
    since = None if phase is HOLDING else s.task.outside_since
    return replace(s, task=replace(s.task, phase=phase, outside_since=since))


def _beginning(s: ControllerState) -> ControllerState:
    """Nothing that was planned on the segment is kept.

    A vehicle that stood at its target, or as commanded, counts as standing from now on.
    """
    vehicle = s.vehicle
    if vehicle.standing_since is not None and s.task.phase in (HOLDING, STALLED, WAITING):
        vehicle = replace(vehicle, standing_since=s.now)
    task = replace(s.task, arrival=None, phase=STARTING, outside_since=None)
    return replace(s, vehicle=vehicle, task=task, plans=Plans(clear_of=s.plans.clear_of))
