"""Pulling out: when a vehicle that has stalled drives back, how far, and what it remembers then."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from geometry import Pose2, ReferencePath
from rti_mpcc.config import ControllerConfig, Method, Vehicle
from rti_mpcc.model.layout import THETA
from rti_mpcc.planning import legs
from rti_mpcc.planning.memory import ControllerMemory, Phase, PullOut

CONFIG = ControllerConfig(dead_time=0.2, vehicle=Vehicle(front=4.0, rear=1.0))
LENGTH = 5.0  # of its body [m]
PART = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 20.0)]).parts[0]


def stalled(**changes: Any) -> ControllerMemory:
    usual: dict[str, Any] = {"phase": Phase.STALLED, "restarts": 3, "standing_since": 1.0}
    return ControllerMemory(**{**usual, **changes})


def pulling(**changes: Any) -> ControllerMemory:
    return stalled(**{"phase": Phase.ARRIVING, "pull_out": PullOut(begin=20.0, end=12.0), **changes})


def test_the_second_way_back_is_longer(situations: Any) -> None:
    here = situations.standing(19.0)
    first, second = (legs.way_back(stalled(pulled_out=n), here, PART, CONFIG) for n in (0, 1))
    assert first is not None
    assert second is not None
    assert (first.begin, first.end) == pytest.approx((19.0, 19.0 - 1.8 * LENGTH))
    assert (second.begin, second.end) == pytest.approx((19.0, 19.0 - 3.6 * LENGTH))
    assert legs.way_back(stalled(pulled_out=2), here, PART, CONFIG) is None


def test_the_default_vehicle_pulls_out_by_about_8_and_16_m(situations: Any) -> None:
    here, default = situations.standing(18.0), ControllerConfig()
    ways = [legs.way_back(stalled(pulled_out=n), here, PART, default) for n in (0, 1)]
    assert [way and way.begin - way.end for way in ways] == pytest.approx([8.0, 16.0], abs=0.2)


@pytest.mark.parametrize("length", [0.5, 15.0])
def test_a_small_vehicle_pulls_out_by_less_and_a_large_one_by_more(length: float, situations: Any) -> None:
    vehicle = Vehicle(wheelbase=0.6 * length, front=0.8 * length, rear=0.2 * length)
    config = ControllerConfig(vehicle=vehicle)
    part = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 99.0)]).parts[0]
    way = legs.way_back(stalled(), situations.standing(60.0), part, config)
    assert way is not None
    assert way.begin - way.end == pytest.approx(1.8 * length)
    assert legs.way_back(stalled(), situations.standing(0.44 * length), part, config) is None


def test_it_begins_behind_the_end_where_the_vehicle_is_there(situations: Any) -> None:
    here = situations.standing(20.0, state=np.array([23.0, 1.0, 0.1, 0.0, 0.0, 20.0]))
    way = legs.way_back(stalled(), here, PART, CONFIG)
    assert way is not None
    assert (way.begin, way.end) == pytest.approx((23.0, 23.0 - 1.8 * LENGTH))


def test_it_ends_at_the_begin_of_the_part(situations: Any) -> None:
    assert legs.way_back(stalled(), situations.standing(5.0), PART, CONFIG) == PullOut(begin=5.0, end=0.0)
    assert legs.way_back(stalled(), situations.standing(2.2), PART, CONFIG) is None


@pytest.mark.parametrize("phase", [phase for phase in Phase if phase is not Phase.STALLED])
def test_only_what_has_stalled_pulls_out(phase: Phase, situations: Any) -> None:
    assert legs.way_back(stalled(phase=phase), situations.standing(18.0), PART, CONFIG) is None


def test_no_way_back_from_a_stop_on_the_way_back_or_without_an_arrival(situations: Any) -> None:
    here = situations.standing(18.0)
    assert legs.way_back(stalled(), replace(here, free=False), PART, CONFIG) is None
    assert legs.way_back(pulling(phase=Phase.STALLED), here, PART, CONFIG) is None
    assert legs.way_back(stalled(), here, PART, ControllerConfig.paper()) is None
    separated = ControllerConfig(method=Method.SEPARATED)
    assert legs.way_back(stalled(), here, PART, separated) is None


def test_the_way_back_begins_afresh_where_the_vehicle_is(situations: Any) -> None:
    here = situations.standing(18.0)
    memory = legs.pulling_out(stalled(), here, PullOut(begin=18.5, end=10.5))
    assert (memory.phase, memory.restarts, memory.pulled_out) == (Phase.STARTING, 0, 0)
    assert memory.standing_since == here.now
    assert memory.reached is not None
    assert memory.reached[THETA] == 18.5
    np.testing.assert_array_equal(memory.reached[:THETA], here.state[:THETA])


@pytest.mark.parametrize(
    ("changes", "error", "over"),
    [
        ({}, 0.4, True),
        ({}, 0.6, False),
        ({"standing_since": 9.9}, 0.4, False),
        ({"standing_since": None}, 0.4, False),
        ({"phase": Phase.STALLED, "standing_since": 9.0}, 6.0, True),
        ({"standing_since": 9.0}, 6.0, False),
        ({"standing_since": 4.9}, 6.0, True),
        ({"pull_out": None}, 0.0, False),
    ],
)
def test_it_is_over_at_its_end_or_where_there_is_no_getting_on(
    changes: dict[str, Any], error: float, over: bool, situations: Any
) -> None:
    memory = pulling(**{"standing_since": 9.0, **changes})
    here = situations.standing(12.0, error=Pose2(-error, 0.0, 0.0), last_part=False)
    assert legs.has_pulled_out(memory, here, 0.2) == over


def test_it_comes_again_from_where_it_is_then(situations: Any) -> None:
    memory = pulling(pull_out=PullOut(begin=22.0, end=14.0), latched="why", restarts=2)
    memory = legs.coming_again(memory, situations.standing(30.0))
    assert (memory.phase, memory.pull_out, memory.pulled_out) == (Phase.STARTING, None, 1)
    assert (memory.restarts, memory.latched) == (0, "")
    assert memory.reached is not None
    assert memory.reached[THETA] == 14.0


def test_another_goal_is_another_docking() -> None:
    assert legs.with_goal(stalled(pulled_out=2), Pose2(1.0, 0.0, 0.0)).pulled_out == 0


def test_the_way_back_and_what_comes_after_it_do_not_back_up(situations: Any) -> None:
    here = situations.standing(18.0)
    assert not legs.pulling_out(
        stalled(reverse_into_goal=True), here, PullOut(begin=18.5, end=10.5)
    ).reverse_into_goal
    assert not legs.coming_again(pulling(reverse_into_goal=True), here).reverse_into_goal
