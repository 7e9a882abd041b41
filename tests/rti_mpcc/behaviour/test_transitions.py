"""The table of transitions: what it makes of a cycle, and every one of its rows."""

from __future__ import annotations

import ast
from dataclasses import FrozenInstanceError, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import rti_mpcc
from geometry import Pose2
from rti_mpcc.behaviour import conditions
from rti_mpcc.behaviour.transitions import (
    TRANSITIONS,
    Event,
    Transition,
    transition_by_condition,
    transition_on,
)
from rti_mpcc.config import ControllerConfig
from rti_mpcc.paper import with_method
from rti_mpcc.paper.objective import CartesianPose
from rti_mpcc.planning.context import PlanningContext
from rti_mpcc.planning.schedule import rescheduled
from rti_mpcc.planning.state import DRIVING, ControllerState, Phase, Plans, RouteState, Stall
from tests.rti_mpcc.states import (
    AREA,
    arrival_at,
    arriving,
    begun_for,
    contexts,
    contouring,
    decided,
    put,
    some_plan,
    stop_at,
    target_at,
    with_box,
)

CONFIG = ControllerConfig(dead_time=0.2)
BEHAVIOUR = CONFIG.behaviour
SEPARATED = with_method(CONFIG, "separated")
NEAR = Pose2(0.01, -0.01, 0.01)
"""Inside half the tolerance."""
LONG = BEHAVIOUR.standstill_time + 1.0
"""A vehicle that stands so long gets no nearer [s]."""
STALL = Stall(target=target_at(20.0), obstacles=())


# -- a plan under way ------------------------------------------------------------------------------------


def test_a_plan_under_way_goes_on() -> None:
    s = arriving()
    assert transition_by_condition(s, contexts(), CONFIG) is s
    assert rescheduled(s, contexts(), CONFIG) is s
    assert decided(s, contexts(), CONFIG) == s


def test_a_slow_vehicle_that_would_stop_inside_half_the_tolerance_settles() -> None:
    after = decided(arriving(), contexts(speed=0.2, stop_error=NEAR), CONFIG)
    assert after.task.phase is Phase.SETTLING


@pytest.mark.parametrize(
    "changes",
    [
        {"speed": 0.35, "stop_error": NEAR},
        {"speed": 0.2, "stop_error": Pose2(0.04, 0.0, 0.0)},
        {"speed": 0.2, "stop_error": Pose2(0.0, -0.04, 0.0)},
        {"speed": 0.2, "stop_error": Pose2(0.0, 0.0, 0.03)},
    ],
)
def test_a_fast_vehicle_or_one_off_the_goal_drives_its_plan(changes: dict[str, Any]) -> None:
    assert decided(arriving(), contexts(**changes), CONFIG).task.phase is Phase.ARRIVING


def test_a_plan_that_has_just_begun_is_given_time_to_move_off() -> None:
    s = arriving(standing_since=5.0, driving_since=9.5)
    assert decided(s, contexts.standing(12.0), CONFIG).task.phase is Phase.ARRIVING


def test_a_vehicle_that_stands_has_not_stalled_while_its_arrival_has_time_to_go() -> None:
    """It begins slowly, or turns about: over 0.4 m in 10 s it takes a second to leave standstill."""
    after = decided(arriving(standing_since=5.0), contexts.standing(19.8), CONFIG)
    assert after.task.phase is Phase.ARRIVING


@pytest.mark.parametrize(
    ("x", "phase"), [(19.8, Phase.STALLED), (19.96, Phase.SETTLING), (19.99, Phase.SETTLING)]
)
def test_an_arrival_long_overdue_ends_even_if_noise_hides_that_it_stands(x: float, phase: Phase) -> None:
    s, overdue = arriving(at=10.2), BEHAVIOUR.overdue_time
    for cycle in range(round(overdue / 0.05)):
        creeping = contexts.standing(19.8, now=10.0 + 0.05 * cycle, begin=10.2 + 0.05 * cycle)
        s = decided(s, replace(creeping, measured_speed=0.03), CONFIG)
        assert s.task.phase is Phase.ARRIVING
    last = contexts.standing(x, now=10.01 + overdue, begin=10.21 + overdue, measured_speed=0.03)
    after = decided(s, last, CONFIG)
    assert after.task.phase is phase
    assert after.task.stall == (STALL if phase is Phase.STALLED else None)


@pytest.mark.parametrize("config", [CONFIG, ControllerConfig.paper(dead_time=0.2)], ids=["dynamic", "paper"])
def test_a_vehicle_that_stands_for_good_outside_the_tolerance_stalls_at_once(
    config: ControllerConfig,
) -> None:
    """It does not try the same again; what it stands before is remembered."""
    overdue = arriving(standing_since=5.0, arrival=arrival_at(11.0, overdue_since=9.0))
    for s in (overdue, contouring(standing_since=5.0)):
        after = decided(s, contexts.standing(19.8), config)
        assert (after.task.phase, after.task.stall) == (Phase.STALLED, STALL)


def test_an_arrival_whose_plan_misses_stalls_before_it_is_long_overdue_where_ways_are_planned() -> None:
    soon = arrival_at(10.2, overdue_since=10.0 - BEHAVIOUR.due_time)
    assert BEHAVIOUR.due_time < BEHAVIOUR.overdue_time
    s = arriving(arrival=soon, driven=some_plan(), route=RouteState())
    after = decided(s, contexts(), CONFIG)
    assert (after.task.phase, after.task.stall) == (Phase.STALLED, STALL)
    assert decided(put(s, route=None), contexts(), CONFIG).task.phase is Phase.ARRIVING
    assert decided(put(s, phase=Phase.SETTLING), contexts(), CONFIG).task.phase is not Phase.STALLED


def test_a_vehicle_that_may_turn_about_stands_longer_before_it_is_stuck() -> None:
    standing, posing = contexts.standing(19.0), contouring(successor=CartesianPose())
    assert decided(put(posing, standing_since=8.0), standing, SEPARATED).task.phase is Phase.CONTOURING
    long = put(posing, standing_since=10.0 - BEHAVIOUR.turning_time)
    assert decided(long, standing, SEPARATED).task.phase is Phase.STALLED


# -- at the target ---------------------------------------------------------------------------------------


def test_a_vehicle_that_stands_inside_the_tolerance_at_the_begin_holds() -> None:
    starting = arriving(phase=Phase.STARTING)
    assert decided(starting, contexts.standing(19.96), CONFIG).task.phase is Phase.HOLDING
    assert decided(starting, contexts.standing(19.9), CONFIG).task.phase is Phase.STARTING
    moving = contexts(error=Pose2(0.01, 0.0, 0.0))
    assert decided(starting, moving, CONFIG).task.phase is Phase.STARTING


def test_a_settling_vehicle_that_stands_holds() -> None:
    after = decided(arriving(phase=Phase.SETTLING), contexts.standing(), CONFIG)
    assert after.task.phase is Phase.HOLDING


def test_a_settling_vehicle_that_stands_outside_the_tolerance_does_not_hold() -> None:
    s = arriving(phase=Phase.SETTLING)
    assert decided(s, contexts.standing(19.85), CONFIG).task.phase is Phase.STARTING
    s = decided(s, contexts.standing(19.94), CONFIG)
    assert s.task.phase is Phase.SETTLING
    assert decided(s, contexts.standing(19.96), CONFIG).task.phase is Phase.HOLDING
    later = contexts.standing(19.94, now=10.01 + BEHAVIOUR.outside_time)
    assert decided(s, later, CONFIG).task.phase is Phase.STARTING


def test_a_settling_vehicle_that_moves_again_is_judged_by_where_it_will_stop() -> None:
    """Measured outside a moment ago, when it seemed to stand."""
    s = arriving(phase=Phase.SETTLING, outside_since=5.0)
    assert decided(s, contexts(speed=0.2, stop_error=NEAR), CONFIG).task.phase is Phase.SETTLING


def test_a_settling_vehicle_whose_goal_moves_away_begins_again() -> None:
    s = arriving(phase=Phase.SETTLING, driven=some_plan())
    after = decided(s, contexts(speed=0.2, stop_error=Pose2(0.3, 0.0, 0.0)), CONFIG)
    assert after.task.phase is Phase.STARTING
    assert after.plans.driven is None


def test_a_holding_vehicle_holds_inside_the_tolerance_and_begins_again_outside() -> None:
    s = arriving(phase=Phase.HOLDING)
    assert decided(s, contexts.standing(19.96), CONFIG).task.phase is Phase.HOLDING
    assert decided(s, contexts.standing(19.90), CONFIG).task.phase is Phase.STARTING


def test_a_holding_vehicle_measured_just_outside_for_a_moment_holds() -> None:
    s = arriving(phase=Phase.HOLDING)
    for now in (10.0, 10.1, 10.2):
        s = decided(s, contexts.standing(19.94, now=now), CONFIG)
        assert s.task.phase is Phase.HOLDING
    inside = decided(s, contexts.standing(19.96, now=10.25), CONFIG)
    assert inside.task.outside_since is None
    after = decided(s, contexts.standing(19.94, now=10.0 + BEHAVIOUR.outside_time), CONFIG)
    assert after.task.phase is Phase.STARTING


def test_noise_does_not_take_a_vehicle_from_its_goal_but_a_goal_a_little_away_does() -> None:
    """Measured in and out of the tolerance by turns it stays; measured outside for a while it goes."""
    s = arriving(phase=Phase.HOLDING)
    for cycle in range(100):
        x = 19.97 if cycle % 4 == 0 else 19.94
        s = decided(s, contexts.standing(x, now=0.05 * cycle), CONFIG)
        assert s.task.phase is Phase.HOLDING
    for time, x, phase in (
        (6.0, 20.0, Phase.HOLDING),
        (7.0, 19.94, Phase.HOLDING),
        (7.0 + 0.9 * BEHAVIOUR.outside_time, 19.94, Phase.HOLDING),
        (7.0 + 1.1 * BEHAVIOUR.outside_time, 19.94, Phase.STARTING),
    ):
        s = decided(s, contexts.standing(x, now=time), CONFIG)
        assert s.task.phase is phase
    assert s.task.outside_since is None


def test_a_vehicle_held_before_something_in_the_way_holds_wherever_it_is() -> None:
    s = arriving(phase=Phase.HOLDING, stop=stop_at(15.0))
    assert decided(s, contexts.standing(14.0, free=False), CONFIG).task.phase is Phase.HOLDING


# -- stalled ---------------------------------------------------------------------------------------------


def test_a_stalled_vehicle_waits_for_another_target() -> None:
    s = arriving(phase=Phase.STALLED, stall=STALL)
    assert decided(s, contexts.standing(19.8), CONFIG).task.phase is Phase.STALLED
    after = decided(s, contexts.standing(19.8, target=target_at(20.5)), CONFIG)
    assert after.task.phase is Phase.STARTING


@pytest.mark.parametrize(
    ("error", "phase"),
    [
        (Pose2(0.02, -0.02, 0.01), Phase.HOLDING),
        (Pose2(0.03, 0.0, 0.0), Phase.STALLED),
        (Pose2(0.0, -0.03, 0.0), Phase.STALLED),
        (Pose2(0.0, 0.0, 0.02), Phase.STALLED),
        (Pose2(0.3, 0.0, 0.0), Phase.STALLED),
    ],
)
def test_a_stalled_vehicle_holds_where_it_stands_well_inside_the_tolerance(
    error: Pose2, phase: Phase
) -> None:
    """Just inside it may be noise that shows it there; from the begin it holds there, too."""
    here = contexts.standing(error=error)
    s = arriving(phase=Phase.STALLED, stall=STALL)
    assert decided(s, here, CONFIG).task.phase is phase
    inside = here.inside(error)
    assert decided(put(s, phase=Phase.STARTING), here, CONFIG).task.phase is (
        Phase.HOLDING if inside else Phase.STARTING
    )


def test_a_stalled_vehicle_that_rolls_does_not_hold() -> None:
    s = arriving(phase=Phase.STALLED, stall=STALL)
    assert decided(s, contexts(error=Pose2(0.01, 0.0, 0.0)), CONFIG).task.phase is Phase.STALLED


def test_a_stalled_vehicle_to_which_its_goal_comes_holds() -> None:
    """It need not begin again for a target that has moved to where it stands."""
    s = arriving(phase=Phase.STALLED, stall=STALL)
    came = contexts.standing(19.8, target=target_at(19.8), error=NEAR)
    assert conditions.target_moved(s, came, CONFIG)
    assert decided(s, came, CONFIG).task.phase is Phase.HOLDING


def test_a_stalled_vehicle_is_not_woken_by_noise_but_by_a_target_that_creeps_away() -> None:
    """It remembers what it stalled before, from when it did."""
    overdue = arrival_at(11.0, overdue_since=9.0)
    s = arriving(arrival=overdue, standing_since=5.0)
    s = decided(s, contexts.standing(19.8), CONFIG)
    assert (s.task.phase, s.task.stall) == (Phase.STALLED, STALL)
    for moves in range(1, 3):
        creeping = target_at(20.0 + 0.01 * moves)
        s = decided(put(s, target=creeping), contexts.standing(19.8, target=creeping), CONFIG)
        assert s.task.phase is Phase.STALLED
    s = decided(s, contexts.standing(19.8, target=target_at(20.03)), CONFIG)
    assert s.task.phase is Phase.STARTING


def test_a_stalled_vehicle_tries_again_when_what_stands_around_it_has_changed() -> None:
    """Not by what perception says a little differently, nor at once."""
    patience, beside = CONFIG.retries.give_up_time, contexts.standing(19.8)
    known = Stall(target=target_at(20.0), obstacles=with_box(22.0).standing)
    s = arriving(phase=Phase.STALLED, stall=known, standing_since=10.0 - patience)
    for there in (22.0, 22.03):
        assert decided(put(s, area=with_box(there)), beside, CONFIG).task.phase is Phase.STALLED
    for gone in (AREA, with_box(22.1)):
        after = decided(put(s, area=gone), beside, CONFIG)
        assert after.task.phase is Phase.STARTING
        soon = put(s, area=gone, standing_since=10.1 - patience)
        assert decided(soon, beside, CONFIG).task.phase is Phase.STALLED


def test_deciding_changes_nothing_but_what_it_returns() -> None:
    s, context = arriving(), contexts()
    here = context.state.copy()
    assert decided(s, context, CONFIG) == decided(s, context, CONFIG)
    np.testing.assert_array_equal(context.state, here)
    with pytest.raises(FrozenInstanceError):
        s.task.phase = Phase.HOLDING  # type: ignore[misc]


# -- the whole table -------------------------------------------------------------------------------------

LOOKED_FOR = [(phase, row) for row in TRANSITIONS if row.when for phase in row.sources]
TOLD = [(phase, row) for row in TRANSITIONS if not row.when for phase in row.sources]


def names(given: Phase | Transition) -> str:
    return given.name if isinstance(given, Phase) else given.event.name


def planned(phase: Phase, **values: Any) -> ControllerState:
    """In a phase, with something of everything that can be planned; contouring knows no arrival."""
    plan = some_plan()
    plans: dict[str, Any] = {"valid": plan, "driven": plan, "accepted_at": 9.9, "clear_of": 3}
    s = arriving(phase=phase, **plans, suspended=begun_for(None))
    return put(s, **{**({"arrival": None} if phase is Phase.CONTOURING else {}), **values})


def getting_no_nearer(phase: Phase, **values: Any) -> ControllerState:
    """Standing for good, while its arrival, if it has one, has no time to go."""
    overdue = {} if phase is Phase.CONTOURING else {"arrival": arrival_at(11.0, overdue_since=9.0)}
    return planned(phase, standing_since=10.0 - LONG, **{**overdue, **values})


def witness(phase: Phase, event: Event) -> tuple[ControllerState, PlanningContext]:
    """Where an event is looked for in this phase and found, and none that goes before it."""
    standing = planned(phase, standing_since=9.0)
    beside = contexts.standing(19.8)
    match event:
        case Event.STOP_ENDS_INSIDE:
            return planned(phase), contexts(speed=0.2, stop_error=NEAR)
        case Event.TARGET_BEHIND:
            return planned(phase), contexts(speed=2.0, along=-0.3, distance=0.3)
        case Event.STUCK_INSIDE:
            return getting_no_nearer(phase), contexts.standing(19.955)
        case Event.NO_PROGRESS:
            return getting_no_nearer(phase), beside
        case Event.PLAN_MISSES:
            due = arrival_at(10.2, overdue_since=10.0 - BEHAVIOUR.due_time)
            return planned(phase, arrival=due, route=RouteState()), contexts()
        case Event.INSIDE:
            return standing, contexts.standing(19.98 if phase is Phase.STALLED else 19.96)
        case Event.MISSES:
            return planned(phase), contexts(speed=0.2, stop_error=Pose2(0.3, 0.0, 0.0))
        case Event.OUTSIDE:
            return standing, beside
        case Event.AT_REST:
            return standing, contexts.standing(19.96)
        case Event.TARGET_MOVED:
            moved = contexts.standing(19.8, target=target_at(20.5))
            return put(standing, stall=STALL), moved
        case Event.OBSTACLES_CHANGED:
            stood = 10.0 - CONFIG.retries.give_up_time
            return put(standing, stall=STALL, standing_since=stood, area=with_box(22.0)), beside
    raise AssertionError(f"{event} needs a witness here: where it is found")


def test_the_table_has_every_event_and_no_two_rows_for_one_in_a_phase() -> None:
    events = [(phase, row.event) for row in TRANSITIONS for phase in row.sources]
    assert {event for _, event in events} == set(Event)
    assert len(events) == len(set(events))
    assert {row.to for row in TRANSITIONS} == set(Phase)
    assert all(row.sources and len(row.sources) == len(set(row.sources)) for row in TRANSITIONS)


@pytest.mark.parametrize(("phase", "row"), LOOKED_FOR, ids=names)
def test_every_row_that_is_looked_for_is_found_and_leads_to_its_phase(phase: Phase, row: Transition) -> None:
    s, context = witness(phase, row.event)
    assert s.task.phase is phase
    noted = put(s, outside_since=conditions.outside_since(s, context, CONFIG))
    of_phase = [each for source, each in LOOKED_FOR if source is phase]
    holds = [bool(each.when and each.when(noted, context, CONFIG)) for each in of_phase]
    assert of_phase[holds.index(True)] is row
    assert transition_by_condition(s, context, CONFIG).task.phase is row.to


@pytest.mark.parametrize(("phase", "row"), LOOKED_FOR, ids=names)
def test_whoever_stalls_remembers_what_it_stands_before_and_nobody_else_does(
    phase: Phase, row: Transition
) -> None:
    s, context = witness(phase, row.event)
    s = put(s, area=with_box(22.0))
    task = transition_by_condition(s, context, CONFIG).task
    if row.to is Phase.STALLED:
        assert task.stall == Stall(target=context.target, obstacles=s.area.standing)
    else:
        assert task.stall is s.task.stall


@pytest.mark.parametrize(("phase", "row"), TOLD, ids=names)
def test_every_row_that_is_told_leads_to_its_phase(phase: Phase, row: Transition) -> None:
    s = planned(phase)
    after = transition_on(s, row.event)
    assert after.task.phase is row.to
    if row.to is not Phase.STARTING:
        assert after == put(s, phase=row.to)


@pytest.mark.parametrize("phase", Phase, ids=names)
def test_an_event_without_a_row_in_a_phase_changes_nothing(phase: Phase) -> None:
    rows = {row.event for source, row in TOLD if source is phase}
    s = planned(phase)
    others = [event for event in Event if event not in rows]
    assert others
    for event in others:
        assert transition_on(s, event) is s


def test_what_is_looked_for_cannot_be_told() -> None:
    assert not {row.event for _, row in TOLD} & {row.event for _, row in LOOKED_FOR}


@pytest.mark.parametrize(
    ("phase", "row"), [each for each in LOOKED_FOR + TOLD if each[1].to is Phase.STARTING], ids=names
)
def test_whoever_starts_keeps_no_plans_and_no_arrival(phase: Phase, row: Transition) -> None:
    if row.when:
        after = transition_by_condition(*witness(phase, row.event), CONFIG)
    else:
        after = transition_on(planned(phase, outside_since=9.0), row.event)
    assert after.task.phase is Phase.STARTING
    assert after.plans == Plans(clear_of=3)
    assert (after.task.arrival, after.task.outside_since) == (None, None)


@pytest.mark.parametrize(
    ("phase", "row"), [each for each in LOOKED_FOR if each[1].to is not Phase.STARTING], ids=names
)
def test_whoever_goes_on_keeps_what_was_planned(phase: Phase, row: Transition) -> None:
    s, context = witness(phase, row.event)
    after = transition_by_condition(s, context, CONFIG)
    assert after.plans is s.plans
    assert after.task.arrival is s.task.arrival


@pytest.mark.parametrize(
    ("phase", "row"), [each for each in LOOKED_FOR + TOLD if each[1].to is Phase.HOLDING], ids=names
)
def test_whoever_holds_is_inside(phase: Phase, row: Transition) -> None:
    if row.when:
        s, context = witness(phase, row.event)
        after = transition_by_condition(put(s, outside_since=9.0), context, CONFIG)
    else:
        after = transition_on(planned(phase, outside_since=9.0), row.event)
    assert (after.task.phase, after.task.outside_since) == (Phase.HOLDING, None)


@pytest.mark.parametrize("phase", [Phase.HOLDING, Phase.STALLED], ids=names)
def test_a_vehicle_that_begins_again_from_its_target_is_taken_to_stand_from_now(phase: Phase) -> None:
    s = planned(phase, standing_since=2.0)
    for event in (Event.OVERLAP, Event.GOAL_CHANGED, Event.MISTAKE, Event.SEGMENT_ENDED):
        assert transition_on(s, event).vehicle.standing_since == s.now
        assert transition_on(put(s, standing_since=None), event).vehicle.standing_since is None


@pytest.mark.parametrize("phase", [Phase.STARTING, *DRIVING, Phase.SETTLING], ids=names)
def test_one_that_begins_again_elsewhere_stands_as_long_as_it_does(phase: Phase) -> None:
    assert transition_on(planned(phase, standing_since=2.0), Event.OVERLAP).vehicle.standing_since == 2.0


def test_what_is_told_has_no_effect_of_its_own() -> None:
    assert not [row.event for row in TRANSITIONS if row.effect and not row.when]


def sets_phase(source: str) -> bool:
    """Whether a module calls anything with `phase=`, or gives a keyword of that name by a dictionary."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Call) and any(keyword.arg == "phase" for keyword in node.keywords):
            return True
        if isinstance(node, ast.Dict) and any(
            isinstance(key, ast.Constant) and key.value == "phase" for key in node.keys
        ):
            return True
    return False


def test_the_phase_is_set_by_the_table_alone() -> None:
    root = Path(rti_mpcc.__file__).parent
    found = [
        file.relative_to(root).as_posix()
        for file in sorted(root.rglob("*.py"))
        if sets_phase(file.read_text(encoding="utf-8"))
    ]
    assert found == ["behaviour/transitions.py"]


@pytest.mark.parametrize(
    "statement", ["replace(s.task, phase=p)", "Task(segments=x, phase=p)", "replace(t, **{'phase': p})"]
)
def test_setting_the_phase_is_noticed(statement: str) -> None:
    assert sets_phase(statement)
    assert not sets_phase("s.task.phase is p")
