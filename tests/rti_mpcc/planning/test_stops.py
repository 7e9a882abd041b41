"""Stops before what fills the way: when it is worth looking past them again, and when not."""

from __future__ import annotations

from math import inf

import numpy as np
import pytest

from geometry import Pose2, ReferencePath
from rti_mpcc.behaviour import moves
from rti_mpcc.behaviour.moves import NEAR_STOP
from rti_mpcc.config import ControllerConfig
from rti_mpcc.manoeuvre import PlannedStop
from rti_mpcc.model.layout import STATES, THETA, V
from rti_mpcc.ocp.targets import path_end
from rti_mpcc.planning import stops
from rti_mpcc.planning.guess import cruise_guess
from rti_mpcc.planning.schedule import TARGET_MOVED
from rti_mpcc.planning.state import ControllerState, Halt, Phase
from rti_mpcc.planning.stops import PLAN_AGE, REPLAN_INTERVAL, SEEN_SHARE
from tests.rti_mpcc.states import (
    after_changes,
    arriving,
    begun_for,
    contexts,
    contouring,
    put,
    state,
    stop_at,
)

CONFIG = ControllerConfig()
INTERVAL = REPLAN_INTERVAL
MOVED = TARGET_MOVED


def at(s: ControllerState, time: float, changes: int) -> ControllerState:
    """The same at another time [s], after so many changes of the obstacles."""
    return put(s, time=time, area=after_changes(changes))


def test_it_looks_again_only_when_obstacles_have_changed_and_not_at_once() -> None:
    s = moves.stop_before(arriving(), contexts(), 4.0, 7)
    assert not stops.way_may_be_free(at(s, 30.0, 7))
    assert not stops.way_may_be_free(at(s, 10.0 + 0.9 * INTERVAL, 8))
    assert stops.way_may_be_free(at(s, 10.0 + INTERVAL, 8))
    assert not stops.way_may_be_free(at(arriving(), 30.0, 8))
    free = moves.released(s)
    assert free.task.stop is None
    assert free.task.phase is Phase.STARTING


def test_it_looks_again_when_the_goal_has_moved() -> None:
    goal = Pose2(20.0, 0.0, 0.0)
    known = at(moves.stop_before(arriving(pose=goal), contexts(), 4.0, 7), 30.0, 7)
    assert not stops.way_may_be_free(known)
    assert not stops.way_may_be_free(put(known, pose=Pose2(20.0 + 0.5 * MOVED, 0.0, 0.0)))
    assert stops.way_may_be_free(put(known, pose=Pose2(20.0 + 2.0 * MOVED, 0.0, 0.0)))
    assert stops.way_may_be_free(put(known, pose=None))
    unknown = at(moves.stop_before(arriving(), contexts(), 4.0, 7), 30.0, 7)
    assert stops.way_may_be_free(put(unknown, pose=goal))


def test_at_a_stop_before_something_it_does_not_look_again_until_something_has_changed() -> None:
    """However it got there, and for however long it stands: from there another way is planned."""
    for s in (arriving(), arriving(standing_since=9.0)):
        there = moves.stop_before(s, contexts.standing(12.0), NEAR_STOP, 7)
        assert there.task.phase is Phase.HOLDING
        assert not stops.way_may_be_free(at(there, 60.0, 7))
        assert not stops.way_may_be_free(at(there, 10.0 + 0.9 * INTERVAL, 8))
        assert stops.way_may_be_free(at(there, 10.0 + INTERVAL, 8))


def test_a_stop_for_which_no_way_past_was_sought_yet_is_looked_past_soon() -> None:
    s = moves.stop_before(arriving(), contexts(), 4.0, None)
    assert not stops.way_may_be_free(at(s, 10.0 + 0.9 * INTERVAL, 7))
    assert stops.way_may_be_free(at(s, 10.0 + INTERVAL, 7))
    again = stops.still_filled(at(s, 10.5, 7))
    assert not stops.way_may_be_free(at(again, 10.9, 7))
    assert stops.way_may_be_free(at(again, 11.0, 7))
    assert stops.unconfirmed(s)
    known = stops.confirmed(put(at(s, 11.0, 7), suspended=begun_for(None)))
    assert not stops.unconfirmed(known)
    assert known.plans.suspended is None
    assert not stops.way_may_be_free(at(known, 30.0, 7))
    assert stops.way_may_be_free(at(known, 30.0, 8))
    free = arriving()
    assert not stops.unconfirmed(free)
    assert stops.still_filled(free) is free


@pytest.mark.parametrize(
    ("phase", "stop", "stays"),
    [
        (Phase.ARRIVING, None, False),  # it was for a way past
        (Phase.ARRIVING, stop_at(9.0), False),
        (Phase.CONTOURING, stop_at(9.0), False),
        (Phase.CONTOURING, None, True),  # the arrival is sought all the same
    ],
)
def test_once_the_driven_plan_is_clear_nothing_is_sought_for_that(
    phase: Phase, stop: PlannedStop | None, stays: bool
) -> None:
    s = stops.found_clear(at(arriving(phase=phase, suspended=begun_for(stop)), 10.0, 7))
    assert s.plans.clear_of == 7
    assert (s.plans.suspended is not None) == stays


def test_a_plan_driven_during_a_search_is_iterated_now_and_then() -> None:
    s = arriving(suspended=begun_for(None), accepted_at=10.0)
    assert not stops.is_old(put(s, time=10.0 + 0.9 * PLAN_AGE))
    late = put(s, time=10.0 + 1.1 * PLAN_AGE)
    assert stops.is_old(late)
    assert not stops.is_old(put(late, suspended=None))
    assert not stops.is_old(put(late, halt=Halt()))  # it is not driven
    assert not stops.is_old(put(late, accepted_at=None))


def test_without_a_stop_nothing_is_in_the_way() -> None:
    assert not stops.way_may_be_free(at(state(), 60.0, 8))


def test_it_halts_for_what_is_near_until_its_way_was_clear_for_a_while() -> None:
    def halted(halt: Halt | None, distance: float, now: float = 10.0) -> Halt | None:
        return stops.halted(halt, distance, 3.0, now)

    assert halted(None, 3.1) is None
    assert halted(None, 3.0) == Halt()
    assert halted(Halt(clear_since=9.5), 3.4) == Halt()  # clear, but not by the distance more
    clear = halted(Halt(), 3.6)
    assert clear == Halt(clear_since=10.0)
    assert halted(clear, 3.6, 10.9) == clear
    assert halted(clear, 2.9, 10.9) == Halt()
    assert halted(clear, 3.6, 11.0) is None


@pytest.mark.parametrize("speed", [0.0, 1.0, 3.0, CONFIG.cruise_speed])
def test_a_cruise_counts_a_share_of_the_way_of_its_first_guess(speed: float) -> None:
    part = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 90.0)]).parts[0]
    context = contexts(speed=speed)
    times = np.linspace(0.0, CONFIG.cruise_horizon, 1001)
    begin = np.zeros(STATES)
    begin[V] = speed
    guess = cruise_guess(part, path_end(part), begin, times, context.pace, CONFIG)
    seen = stops.in_view(contouring(driven=guess), context, CONFIG) - context.state[THETA]
    assert seen == pytest.approx(SEEN_SHARE * guess.states[-1, THETA], rel=1e-3)
    assert stops.in_view(arriving(driven=guess), context, CONFIG) == -inf
