"""What a cycle is told is checked, and nothing raises for a value."""

from __future__ import annotations

from dataclasses import fields, replace
from math import inf, nan
from typing import Any

import numpy as np
import pytest

from estimation import GoalMeasurement
from geometry import Corridor, Pose2, ReferencePath
from rti_mpcc.config import ControllerConfig
from rti_mpcc.planning import validation
from rti_mpcc.planning.state import ClockState, GoalState
from rti_mpcc.planning.surroundings import Surroundings

PATH = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 20.0)])
CONFIG = ControllerConfig(cycle=0.05)
LANE = Surroundings.of(Corridor.from_offsets(PATH, left=5.0, right=-5.0), PATH, CONFIG)


def goal_in(given: Any) -> tuple[Pose2 | None, str]:
    """The new goal, and why the one told is not taken."""
    known, goal = validation.goal_in(given, GoalState(), PATH, LANE, CONFIG)
    return goal, known.refusal


def times(*given: float) -> list[float]:
    """The controller's own times for what the user's clock shows."""
    clock, own = ClockState(), []
    for now in given:
        clock, _ = validation.timed(clock, now, CONFIG)
        own.append(clock.now)
    return own


def test_a_clock_that_runs_on_is_the_controllers_own() -> None:
    given = [1.7e9, 1.7e9, 1.7e9 + 0.05, 1.7e9 + 30.0]
    assert times(*given) == given


def test_a_clock_that_goes_back_or_leaps_lets_one_cycle_pass() -> None:
    assert times(5.0, 2.0, 2.05, 9.0) == pytest.approx([5.0, 5.05, 5.1, 12.05])
    assert times(5.0, 1e7, 1e7 + 0.05) == pytest.approx([5.0, 5.05, 5.1])
    clock, remark = validation.timed(ClockState(time=5.0), 2.0, CONFIG)
    assert remark == "the clock went back by 3.000 s"
    assert validation.timed(clock, 2.05, CONFIG)[1] == ""


def test_a_clock_that_stands_still_lets_one_cycle_pass_after_a_while() -> None:
    assert times(*[5.0] * 6) == pytest.approx([5.0, 5.0, 5.0, 5.05, 5.1, 5.15])
    assert times(*[5.0] * 4, 5.05, 5.1) == pytest.approx([5.0, 5.0, 5.0, 5.05, 5.1, 5.15])
    clock = ClockState()
    remarks = []
    for _ in range(4):
        clock, remark = validation.timed(clock, 5.0, CONFIG)
        remarks.append(remark)
    assert remarks == ["", "", "", "the clock stands still"]


@pytest.mark.parametrize("now", [nan, inf, -inf, 1e300])
def test_a_clock_that_shows_no_time_lets_one_cycle_pass(now: float) -> None:
    assert times(5.0, now, 5.1) == pytest.approx([5.0, 5.05, 5.1])
    assert times(now, 5.0) == [0.0, 5.0]
    assert str(now) in validation.timed(ClockState(), now, CONFIG)[1]


class Told:
    def __init__(self, x: Any, y: Any, phi: Any) -> None:
        self.x, self.y, self.phi = x, y, phi


@pytest.mark.parametrize("field", [0, 1, 2])
@pytest.mark.parametrize("value", [nan, inf, 1e300, 1e5, None, "east"])
def test_a_goal_that_cannot_be_one_is_not_used(field: int, value: Any) -> None:
    fields: list[Any] = [20.0, 1.0, 0.1]
    fields[field] = value
    goal: Any = Told(*fields)
    used, remark = goal_in(goal)
    assert used is None
    assert remark.startswith("goal (")
    assert any(word in remark for word in ("not finite", "out of reach"))


@pytest.mark.parametrize("goal", [(1, 2, 3), "x", 5.0])
def test_a_goal_of_another_type_is_not_used(goal: Any) -> None:
    remark = f"goal is no Pose2 but a {type(goal).__name__}"
    assert goal_in(goal) == (None, remark)


def test_what_has_the_numbers_of_a_goal_is_made_one() -> None:
    goal: Any = Told(24, np.float32(3.0), 0.1)
    used, _ = goal_in(goal)
    assert type(used) is Pose2
    assert used == Pose2(24.0, 3.0, 0.1)


SEEN = GoalMeasurement(stamp=2.0, x=nan, y=1e300, phi=0.0, vehicle=Pose2(1.0, 2.0, 0.1))


def spoiled(**changes: Any) -> GoalMeasurement:
    return replace(SEEN, **changes)


@pytest.mark.parametrize(
    ("odd", "remark"),
    [
        ((1, 2, 3), "is no GoalMeasurement but a tuple"),
        (None, "is no GoalMeasurement but a NoneType"),
        (spoiled(x="east"), "holds what is no number, pose or frame"),
        (spoiled(stamp=10**400), "holds what is no number, pose or frame"),
        (spoiled(vehicle=(1, 2, 3)), "holds what is no number, pose or frame"),
        (spoiled(frame="world"), "holds what is no number, pose or frame"),
    ],
)
def test_what_is_no_detection_is_left_out(odd: Any, remark: str) -> None:
    assert validation.measurements_in([SEEN, odd, SEEN, odd]) == (
        (SEEN, SEEN),
        f"measurements[1] {remark}, left out",
    )


@pytest.mark.parametrize("given", [(), [SEEN], iter([SEEN])])
def test_detections_of_any_numbers_go_on_to_the_filter(given: Any) -> None:
    detections, remark = validation.measurements_in(given)
    assert set(detections) <= {SEEN}
    assert remark == ""


def test_measurements_that_are_no_sequence_are_left_out() -> None:
    missing: Any = None
    assert validation.measurements_in(missing) == ((), "")
    number: Any = 5
    remark = "measurements are no sequence but int, left out"
    assert validation.measurements_in(number) == ((), remark)


def test_a_goal_within_reach_is_used_and_none_is_no_problem() -> None:
    goal = Pose2(24.0, 3.0, 0.1)
    assert goal_in(goal) == (goal, "")
    assert goal_in(None) == (None, "")


@pytest.fixture(scope="module")
def known() -> Surroundings:
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 20.0)])
    return Surroundings.of(Corridor.from_offsets(path, left=3.0, right=-3.0), path, ControllerConfig())


SQUARE = [[5.0, 1.0], [6.0, 1.0], [6.0, 2.0], [5.0, 2.0]]


@pytest.mark.parametrize(
    ("obstacles", "said"),
    [
        ([[[5.0, nan], [6.0, 1.0], [6.0, 2.0]]], "obstacles[0] not finite: nan in corner 0"),
        ([SQUARE, SQUARE, [[5.0, 1.0], [6.0, nan], [6.0, 2.0]]], "obstacles[2] not finite: nan in corner 1"),
        ([[[5.0, inf], [6.0, 1.0], [6.0, 2.0]]], "obstacles[0] not finite: inf in corner 0"),
        ([SQUARE, [[5.0, 1.0], [6.0, 1.0], [6.0, 1e300]]], "obstacles[1] not near, at most 1e+10 m: 1e+300"),
        ([np.zeros((0, 2))], "obstacles not readable: obstacles[0] has no corner"),
        ([[5.0, 1.0, 6.0]], "obstacles not readable: obstacles[0] has shape (3,)"),
        ([SQUARE, [[0.0]]], "obstacles not readable: obstacles[1] has shape (1, 1)"),
        ([SQUARE, []], "obstacles not readable: obstacles[1] has shape (0,)"),
        ([[[10**400, 1.0], [6.0, 1.0], [6.0, 2.0]]], "obstacles[0] not readable: "),
        ([SQUARE, None], "obstacles not readable: obstacles[1] has shape ()"),
        ([SQUARE, "wall"], "obstacles[1] not readable: "),
        ([SQUARE, [[0.0, 1.0], [2.0]]], "obstacles[1] not readable: "),
        (5.0, "obstacles are no sequence but float"),
        ([[[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]]], "obstacles not readable: obstacles[0] is not a"),
    ],
)
def test_obstacles_that_are_no_polygons_are_left_out(known: Surroundings, obstacles: Any, said: str) -> None:
    surroundings = validation.surroundings_in(known, obstacles, 1.0)
    assert surroundings.unreadable.startswith(said)
    assert "\n" not in surroundings.unreadable
    for field in fields(Surroundings):
        if field.name != "unreadable":
            assert getattr(surroundings, field.name) is getattr(known, field.name)


def test_obstacles_are_told_and_none_keeps_the_last_ones(known: Surroundings) -> None:
    surroundings = validation.surroundings_in(known, [np.array(SQUARE)], 1.0)
    assert surroundings.unreadable == ""
    assert len(surroundings.obstacles) == 1
    assert validation.surroundings_in(surroundings, None, 2.0) is surroundings
    assert validation.surroundings_in(surroundings, [], 2.0).obstacles == ()


@pytest.mark.parametrize("given", [[], [np.array(SQUARE)], [np.array(SQUARE) + 1.0]])
def test_what_is_wrong_with_obstacles_is_said_until_some_can_be_read(known: Surroundings, given: Any) -> None:
    before = validation.surroundings_in(known, [np.array(SQUARE)], 1.0)
    number: Any = 5.0
    broken = validation.surroundings_in(before, number, 2.0)
    assert validation.surroundings_in(broken, None, 3.0).unreadable == broken.unreadable != ""
    assert validation.surroundings_in(broken, given, 3.0).unreadable == ""
