"""Ways back: when a vehicle that has stalled drives back, and how far; and where the staging pose lies."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from geometry import Pose2, ReferencePath
from rti_mpcc.baselines import segments_of
from rti_mpcc.config import ControllerConfig, Method, Vehicle
from rti_mpcc.manoeuvre import Segment, SegmentEnd
from rti_mpcc.planning import recovery
from rti_mpcc.planning.context import PlanningContext
from rti_mpcc.planning.schedule import scheduled_past_goal
from rti_mpcc.planning.state import ControllerState, Phase
from tests.rti_mpcc.states import BACK, SEGMENTS, contexts, state

CONFIG = ControllerConfig(dead_time=0.2, vehicle=Vehicle(front=4.0, rear=1.0))
LENGTH = 5.0  # of its body [m]
PART = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 20.0)]).parts[0]


def stalled(**values: Any) -> ControllerState:
    return state(**{"phase": Phase.STALLED, "restarts": 3, "standing_since": 1.0, **values})


def ends(way: Segment) -> tuple[float, float]:
    """Progress on the path at which a way back begins and ends [m]."""
    return way.part.first.x, way.part.last.x


def test_the_second_way_back_is_longer() -> None:
    here = contexts.standing(19.0)
    first, second = (recovery.way_back(stalled(pulled_out=n), here, CONFIG) for n in (0, 1))
    assert first is not None
    assert second is not None
    assert ends(first) == pytest.approx((19.0, 19.0 - 1.8 * LENGTH))
    assert ends(second) == pytest.approx((19.0, 19.0 - 3.6 * LENGTH))
    assert recovery.way_back(stalled(pulled_out=2), here, CONFIG) is None


def test_the_default_vehicle_pulls_out_by_about_8_and_16_m() -> None:
    here, default = contexts.standing(18.0), ControllerConfig()
    ways = [recovery.way_back(stalled(pulled_out=n), here, default) for n in (0, 1)]
    assert [way and way.part.end - way.part.start for way in ways] == pytest.approx([8.0, 16.0], abs=0.2)


@pytest.mark.parametrize("length", [0.5, 15.0])
def test_a_small_vehicle_pulls_out_by_less_and_a_large_one_by_more(length: float) -> None:
    vehicle = Vehicle(wheelbase=0.6 * length, front=0.8 * length, rear=0.2 * length)
    config = ControllerConfig(vehicle=vehicle)
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 99.0)])
    segments = segments_of(path, config)
    way = recovery.way_back(stalled(segments=segments), contexts.standing(60.0), config)
    assert way is not None
    assert way.part.end - way.part.start == pytest.approx(1.8 * length)
    assert recovery.way_back(stalled(segments=segments), contexts.standing(0.44 * length), config) is None


def test_it_begins_behind_the_end_where_the_vehicle_is_there() -> None:
    here = contexts.standing(20.0, state=np.array([23.0, 1.0, 0.1, 0.0, 0.0, 20.0]))
    way = recovery.way_back(stalled(), here, CONFIG)
    assert way is not None
    assert ends(way) == pytest.approx((23.0, 23.0 - 1.8 * LENGTH))


def test_it_ends_at_the_begin_of_the_part() -> None:
    way = recovery.way_back(stalled(), contexts.standing(5.0), CONFIG)
    assert way is not None
    assert ends(way) == pytest.approx((5.0, 0.0))
    assert (way.end, way.index, way.part.direction) == (SegmentEnd.WAY_BACK, 0, -1)
    assert recovery.way_back(stalled(), contexts.standing(2.2), CONFIG) is None


def test_it_has_the_limits_of_its_segment() -> None:
    segments = tuple(replace(segment, speed=0.7, steering=0.3) for segment in SEGMENTS)
    way = recovery.way_back(stalled(segments=segments), contexts.standing(18.0), CONFIG)
    assert way is not None
    assert (way.speed, way.steering) == (0.7, 0.3)


@pytest.mark.parametrize("phase", [phase for phase in Phase if phase is not Phase.STALLED])
def test_only_what_has_stalled_pulls_out(phase: Phase) -> None:
    assert recovery.way_back(stalled(phase=phase), contexts.standing(18.0), CONFIG) is None


def test_no_way_back_from_a_stop_on_the_way_back_or_without_an_arrival() -> None:
    here = contexts.standing(18.0)
    assert recovery.way_back(stalled(), replace(here, free=False), CONFIG) is None
    assert recovery.way_back(stalled(segments=(BACK, *SEGMENTS)), here, CONFIG) is None
    assert recovery.way_back(stalled(), here, ControllerConfig.paper()) is None
    separated = ControllerConfig(method=Method.SEPARATED)
    assert recovery.way_back(stalled(), here, separated) is None


@pytest.mark.parametrize(
    "config",
    [
        ControllerConfig.paper(recovery=True),
        ControllerConfig(method=Method.SEPARATED, recovery=True),
        ControllerConfig(method=Method.SWITCHED, recovery=True),
    ],
)
def test_the_baselines_pull_out_where_that_is_switched_on(config: ControllerConfig) -> None:
    here = contexts.standing(18.0)
    assert back_from(here, config) is not None
    assert back_from(here, config.model_copy(update={"recovery": None})) is None


def test_the_dynamic_method_stalls_for_good_where_recovery_is_switched_off() -> None:
    here = contexts.standing(18.0)
    assert back_from(here, CONFIG) is not None
    off = CONFIG.model_copy(update={"recovery": False})
    assert back_from(here, off) is None
    assert scheduled_past_goal(stalled(), here, off) is None


def back_from(here: PlanningContext, config: ControllerConfig) -> Segment | None:
    return recovery.way_back(stalled(), here, config)
