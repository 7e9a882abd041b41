"""What the controller is told of the goal, by each source."""

from __future__ import annotations

from dataclasses import dataclass
from math import nan
from typing import Any

import pytest

from estimation import Frame, GoalMeasurement
from geometry import Pose2
from rti_mpcc.errors import InputError
from rti_mpcc.simulation import GoalSource, scenario_from_dict, simulate
from rti_mpcc.simulation.detector import Lookout
from rti_mpcc.simulation.goal_feed import GoalFeed, TrueGoal, source_in
from rti_mpcc.types import VehicleState

PLANNED = Pose2(10.5, 0.2, 0.1)
TRUE = TrueGoal(pose=Pose2(10.0, 0.0, 0.0))


@dataclass(kw_only=True)
class Blind:
    """A detector that sees nothing by itself."""

    rate: float = 10.0
    delay: float = 0.0

    def expose(self, stamp: float, vehicle: Pose2, goal: Pose2, *, last_part: bool) -> GoalMeasurement | None:
        return None


def seen(stamp: float, x: float, *, vehicle: Pose2 | None = None) -> GoalMeasurement:
    return GoalMeasurement(stamp=stamp, x=x, y=0.5, phi=0.2, frame=Frame.VEHICLE, vehicle=vehicle)


def feed(source: GoalSource, *arriving: tuple[float, GoalMeasurement]) -> GoalFeed:
    return GoalFeed(
        source=source, planned=PLANNED, lookout=Lookout(detector=Blind(), under_way=list(arriving))
    )


def state_at(now: float) -> VehicleState:
    """Ahead at 2 m/s, turning at 0.4 rad/s."""
    return VehicleState(x=2.0 * now, y=1.0, phi=0.4 * now, v=2.0, delta=0.0)


def goals(told_by: GoalFeed, until: float) -> list[Pose2 | None]:
    """What is told at cycles 0.05 s apart."""
    return [told_by.given(0.05 * k, state_at(0.05 * k), TRUE).goal for k in range(round(until / 0.05) + 1)]


def test_detections_are_handed_on_beside_the_planned_goal() -> None:
    first, second = seen(0.0, 9.0), seen(0.1, 8.9)
    told_by = feed(GoalSource.DETECTED, (0.1, first), (0.2, second))
    given = [told_by.given(now, state_at(now), TRUE) for now in (0.0, 0.1, 0.15, 0.2)]
    assert [one.goal for one in given] == [PLANNED] * 4
    assert [one.measurements for one in given] == [(), (first,), (), (second,)]


def test_known_goal_is_the_true_one_wherever_it_moves() -> None:
    told_by = feed(GoalSource.KNOWN, (0.0, seen(0.0, 3.0)))
    moved = TrueGoal(pose=Pose2(11.0, 0.0, 0.0), moved=True)
    assert told_by.given(0.0, state_at(0.0), TRUE) == (TRUE.pose, ())
    assert told_by.given(0.1, state_at(0.1), moved) == (moved.pose, ())


def test_goal_without_detector_is_told_where_it_is_not_the_path_end() -> None:
    told_by = GoalFeed(source=GoalSource.KNOWN, planned=None, lookout=None)
    moved = TrueGoal(pose=Pose2(11.0, 0.0, 0.0), moved=True)
    assert told_by.given(0.0, state_at(0.0), TRUE) == (None, ())
    assert told_by.given(0.1, state_at(0.1), moved) == (moved.pose, ())


def test_raw_goal_is_the_planned_one_until_something_is_seen() -> None:
    given = goals(feed(GoalSource.RAW, (0.2, seen(0.1, 9.0))), 0.3)
    assert given[:4] == [PLANNED] * 4
    assert PLANNED not in given[4:]


@pytest.mark.parametrize("stamp", [0.1, 0.13])
def test_raw_detection_is_placed_by_where_the_vehicle_was_at_its_stamp(stamp: float) -> None:
    given = goals(feed(GoalSource.RAW, (0.3, seen(stamp, 9.0))), 0.5)
    there = state_at(stamp)
    expected = Pose2(there.x, there.y, there.phi).compose(Pose2(9.0, 0.5, 0.2))
    for goal in given[6:]:
        assert goal is not None
        assert (goal.x, goal.y, goal.phi) == pytest.approx((expected.x, expected.y, expected.phi), abs=1e-9)


def test_raw_goal_is_that_of_the_newest_stamp_whatever_arrives_when() -> None:
    newer, older, newest = seen(0.2, 9.0), seen(0.1, 5.0), seen(0.3, 8.0)
    given = goals(feed(GoalSource.RAW, (0.25, newer), (0.3, older), (0.4, newest)), 0.5)
    assert given[5] == given[6] == given[7] != PLANNED
    assert given[8] == given[10] != given[7]
    both = goals(feed(GoalSource.RAW, (0.4, newest), (0.4, newer)), 0.4)
    assert both[-1] == given[8]


def test_raw_detection_brings_its_own_vehicle_pose_or_none_that_is_known() -> None:
    own = Pose2(1.0, 2.0, 0.0)
    given = goals(feed(GoalSource.RAW, (0.1, seen(0.05, 9.0, vehicle=own)), (0.2, seen(-5.0, 3.0))), 0.3)
    assert given[2] == given[-1] == Pose2(10.0, 2.5, 0.2)


def test_raw_detection_that_is_no_number_is_left_out() -> None:
    assert goals(feed(GoalSource.RAW, (0.1, seen(0.1, nan))), 0.2) == [PLANNED] * 5


@pytest.mark.parametrize("source", list(GoalSource))
def test_source_needs_a_detector(source: GoalSource) -> None:
    assert source_in("any", source, detector=True) is source
    if source is GoalSource.DETECTED:
        assert source_in("any", source, detector=False) is GoalSource.KNOWN
    else:
        with pytest.raises(InputError, match=rf"goal_source = '{source.value}': must be 'detected'"):
            source_in("any", source, detector=False)


@pytest.mark.parametrize("source", list(GoalSource))
def test_run_keeps_its_source_and_tells_measurements_to_a_filter_only(
    scripted: Any, tables: dict[str, Any], source: GoalSource
) -> None:
    section = {"dropout": 0.0, "outlier": 0.0, "initial_offset": [0.4, 0.0, 0.0]}
    tables |= {"goal": {"measurement": section}, "simulation": {"duration": 0.5}}
    controller = scripted(script=lambda now, state: (0.0, 0.0))
    result = simulate(scenario_from_dict(tables), controller=controller, goal_source=source)
    assert result.goal_source is source
    assert result.tracking is not None
    count = 6 if source is GoalSource.DETECTED else 0
    assert sum(map(len, controller.detections)) == count
    first = Pose2(10.4, 0.0, 0.0)
    given = [one[2] for one in controller.given]
    if source is GoalSource.DETECTED:
        assert set(given) == {first}
    elif source is GoalSource.KNOWN:
        assert set(given) == {Pose2(10.0, 0.0, 0.0)}
    else:
        assert len(set(given)) == 6
        assert first not in given
