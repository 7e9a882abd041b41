"""Where another way would begin, and whether the same would come of asking for it again."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from estimation import PoseHistory
from geometry import Pose2
from rti_mpcc.config import ControllerConfig
from rti_mpcc.planning import ways
from rti_mpcc.planning.plausibility import StateMonitor
from rti_mpcc.planning.state import ControllerState, RouteState
from tests.rti_mpcc.planned import manoeuvre_along, no_manoeuvre
from tests.rti_mpcc.states import NOW, PATH, after_changes, arriving, put

CONFIG = ControllerConfig()
ROUTE, HISTORY = CONFIG.route, CONFIG.goal_tracking.filter.history


def at(x: float, y: float = 0.0, phi: float = 0.0, **values: Any) -> ControllerState:
    """Measured there."""
    monitor = StateMonitor(at=NOW, state=np.array([x, y, phi, 0.0, 0.0, 0.0]))
    return arriving(**{"monitor": monitor, **values})


def noted(*times_and_places: tuple[float, float]) -> PoseHistory:
    """At these times [s] so far along [m]."""
    history = PoseHistory()
    for stamp, x in times_and_places:
        history = history.noted(stamp, Pose2(x, 0.0, 0.0), length=9.0)
    return history


# -- where it is ---------------------------------------------------------------------------------------------


def test_a_vehicle_that_drives_is_where_it_is_measured() -> None:
    poses = noted((NOW - 0.1, 4.9), (NOW, 5.0))
    assert ways.here(at(5.0, 0.2, 0.1, poses=poses), CONFIG) == Pose2(5.0, 0.2, 0.1)


def test_one_that_stands_is_at_the_mean_of_the_moments_in_which_it_stood() -> None:
    poses = noted((NOW - 0.2, 4.0), (NOW - 0.1, 5.0), (NOW, 5.02))
    s = at(5.02, standing_since=NOW - 0.15, poses=poses)
    assert ways.here(s, CONFIG).x == pytest.approx(5.01)
    just = put(s, standing_since=NOW + 1e-9)
    assert ways.here(just, CONFIG) == Pose2(5.02, 0.0, 0.0)  # nothing is noted since


def test_what_was_long_ago_does_not_count() -> None:
    poses = noted((NOW - HISTORY - 0.1, 4.0), (NOW - 0.1, 5.0), (NOW, 5.02))
    s = at(5.02, standing_since=NOW - 2.0 * HISTORY, poses=poses)
    assert ways.here(s, CONFIG).x == pytest.approx(5.01)


def test_of_a_doubted_measurement_no_mean_is_taken() -> None:
    poses = noted((NOW - 0.1, 5.0), (NOW, 6.0))
    doubted = StateMonitor(at=NOW, state=np.array([5.8, 0.0, 0.0, 0.0, 0.0, 0.0]), why="a jump")
    s = at(0.0, monitor=doubted, standing_since=NOW - 1.0, poses=poses)
    assert ways.here(s, CONFIG) == Pose2(5.8, 0.0, 0.0)


def test_one_that_was_not_heard_of_is_at_the_origin() -> None:
    assert ways.here(arriving(), CONFIG) == Pose2(0.0, 0.0, 0.0)


# -- whether it was asked --------------------------------------------------------------------------------


def asked(x: float = 0.0, y: float = 0.0, phi: float = 0.0, *, ago: float = 1.0, **values: Any) -> bool:
    """Whether a way from the origin, planned so long ago [s], is one from here."""
    planned = RouteState(manoeuvre=manoeuvre_along(PATH), since=NOW - ago)
    return ways.was_asked(at(x, y, phi, **{"route": planned, **values}), CONFIG)


def test_a_way_from_here_was_asked_for_a_moment_ago() -> None:
    assert asked()
    near = [0.9 * most for most in ROUTE.near]
    assert asked(*near)
    vain = RouteState(manoeuvre=no_manoeuvre(PATH.start, PATH.end), since=NOW - 1.0)
    assert asked(route=vain)


@pytest.mark.parametrize("route", [None, RouteState(since=NOW - 1.0)], ids=["no planner", "none yet"])
def test_before_the_first_one_none_was(route: RouteState | None) -> None:
    assert not asked(route=route)


def test_after_a_while_it_may_be_asked_for_again() -> None:
    assert asked(ago=0.99 * ROUTE.again_after)
    assert not asked(ago=ROUTE.again_after)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_from_elsewhere_it_may(axis: int) -> None:
    off = [0.0, 0.0, 0.0]
    off[axis] = 1.1 * ROUTE.near[axis]
    assert not asked(*off)


def test_with_other_obstacles_it_may() -> None:
    assert not asked(area=after_changes(1))
    known = RouteState(manoeuvre=manoeuvre_along(PATH), since=NOW - 1.0, changes=1)
    assert asked(area=after_changes(1), route=known)


# -- without a stop --------------------------------------------------------------------------------------


def test_another_way_may_be_begun_without_a_stop_once_for_the_same_obstacles() -> None:
    planned = RouteState(manoeuvre=manoeuvre_along(PATH), changes=1)
    assert not ways.on_the_move(at(5.0))
    assert ways.on_the_move(at(5.0, route=RouteState()))
    assert not ways.on_the_move(at(5.0, route=planned, area=after_changes(1)))
    assert ways.on_the_move(at(5.0, route=planned, area=after_changes(2)))
