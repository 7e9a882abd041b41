"""What can be a goal, and what is looked at again when it is told again."""

from __future__ import annotations

from math import hypot, pi, radians
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from geometry import Corridor, Pose2, ReferencePath
from rti_mpcc.config import Clearance, ControllerConfig
from rti_mpcc.planning import goals, validation
from rti_mpcc.planning.goals import GoalFit
from rti_mpcc.planning.state import GoalState
from rti_mpcc.planning.surroundings import Surroundings
from rti_mpcc.types import Array

PATH = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 20.0)])
CONFIG = ControllerConfig()
LIMITS = CONFIG.goal_limits
HALF = 0.5 * CONFIG.vehicle.width
LANE = Surroundings.of(Corridor.from_offsets(PATH, left=3.0, right=-3.0), PATH, CONFIG)
BOX = [(-5.0, -3.0), (28.0, -3.0), (28.0, 3.0), (-5.0, 3.0)]
YARD = Surroundings.of(Corridor.from_polygon(PATH, BOX), PATH, CONFIG)


def block(x: float, y: float) -> Array:
    """A square of 1 m around a place."""
    return np.array([[x - 0.5, y - 0.5], [x + 0.5, y - 0.5], [x + 0.5, y + 0.5], [x - 0.5, y + 0.5]])


def check(goal: Pose2, where: Surroundings = LANE) -> GoalFit:
    return goals.checked(goal, PATH, where.corridor, CONFIG.vehicle, LIMITS, margin=0.1)


def again(last: GoalFit | None, goal: Pose2, where: Surroundings = LANE) -> GoalFit:
    return goals.checked_again(last, goal, PATH, where, CONFIG)


@pytest.fixture
def looked(monkeypatch: pytest.MonkeyPatch) -> list[Pose2]:
    """The goals that the exact check was made for."""
    found: list[Pose2] = []

    def counted(goal: Pose2, *args: Any, **settings: Any) -> GoalFit:
        found.append(goal)
        return exact(goal, *args, **settings)

    exact = goals.checked
    monkeypatch.setattr(goals, "checked", counted)
    return found


@pytest.mark.parametrize(
    ("goal", "problem"),
    [
        (Pose2(500.0, 0.0, 0.0), "480 m from the path's last part, at most 20 m"),
        (Pose2(20.0, 0.0, pi), "turned by 3.142 rad from the path beside it, at most 1.571 rad"),
        (Pose2(20.0, 2.5, 0.0), "the body there crosses a boundary or obstacle by 0.534 m"),
        (Pose2(10.0, 8.0, 0.0), "a boundary lies between it and the path"),
        (Pose2(10.0, -14.0, 0.0), "a boundary lies between it and the path"),
    ],
)
def test_a_goal_out_of_reach_is_told_by_its_value_and_limit(goal: Pose2, problem: str) -> None:
    assert check(goal).problem == problem
    known, taken = validation.goal_in(goal, GoalState(), PATH, LANE, CONFIG)
    assert taken is None
    text = f"({goal.x:.6g}, {goal.y:.6g}, {goal.phi:.6g})"
    assert known.refusal == f"goal {text} out of reach, {problem}"


@pytest.mark.parametrize("y", [2.5, 6.0, 15.0])
def test_a_goal_outside_a_polygon_is_out_of_reach_however_far(y: float) -> None:
    assert "crosses a boundary" in check(Pose2(15.0, y, 0.0), YARD).problem


@pytest.mark.parametrize("turns", [-14, -1, 0, 1, 14])
@pytest.mark.parametrize("phi", [-1.5, 0.0, 0.3, 1.5])
def test_a_heading_may_be_on_any_branch(phi: float, turns: int) -> None:
    assert check(Pose2(25.0, 0.0, phi + 2.0 * pi * turns)).problem == ""


def test_a_goal_may_lie_before_the_path_behind_it_and_beside_it() -> None:
    for goal in (Pose2(-15.0, 0.0, 0.0), Pose2(35.0, 10.0, 0.0), Pose2(18.0, 1.5, 0.1)):
        assert check(goal).problem == check(goal).remark == ""


@pytest.mark.parametrize(("room", "said"), [(0.05, True), (0.099, True), (0.101, False), (1.0, False)])
def test_less_room_than_the_margin_is_remarked(room: float, said: bool) -> None:
    fit = check(Pose2(15.0, 3.0 - HALF - room, 0.0))
    assert fit.problem == ""
    assert fit.room == pytest.approx(room)
    expected = f"the goal leaves {room:.2f} m beside the body, less than the margin of 0.10 m"
    assert fit.remark == (expected if said else "")


def test_where_no_margin_is_kept_none_is_missed() -> None:
    tight = Pose2(15.0, 3.0 - HALF - 0.05, 0.0)
    config = ControllerConfig(clearance=Clearance(least=0.0, wanted=0.0))
    assert goals.checked_again(None, tight, PATH, LANE, config).remark == ""


def test_the_end_of_the_path_is_the_goal_all_the_same_and_what_is_odd_there_is_said() -> None:
    assert goals.end_checked(PATH, LANE, CONFIG).remark == ""
    tight = Corridor.from_offsets(PATH, left=HALF + 0.06, right=-3.0)
    remark = goals.end_checked(PATH, Surroundings.of(tight, PATH, CONFIG), CONFIG).remark
    assert remark == "the goal leaves 0.06 m beside the body, less than the margin of 0.10 m"


def test_obstacles_at_the_end_of_the_path_are_waited_for_and_not_remarked() -> None:
    across = LANE.updated([block(21.0, HALF)], 0.0, CONFIG)
    assert goals.end_checked(PATH, across, CONFIG).remark == ""


# -- degrees ----------------------------------------------------------------------------------------


def along(heading: float) -> ReferencePath:
    return ReferencePath.from_segments(Pose2(0.0, 0.0, heading), [(1, 0.0, 20.0)])


@pytest.mark.parametrize("degrees", [30, 45, 60, 90, 135, 180, 225, 270, 315, 360, -90, -180])
def test_a_heading_in_degrees_is_found_out(degrees: int) -> None:
    part = along(radians(degrees)).parts[0]
    hint = goals.degrees_beside("heading", Pose2(part.last.x, part.last.y, float(degrees)), part, LIMITS)
    assert hint == f"heading {degrees}: in degrees? radians are expected"


@settings(deadline=None)
@given(heading=st.floats(-pi, pi), off=st.floats(-0.19, 0.19), turns=st.integers(-20, 20))
def test_a_heading_near_the_paths_is_not_suspected_on_any_branch(
    heading: float, off: float, turns: int
) -> None:
    part = along(heading).parts[0]
    assert (
        goals.degrees_beside("heading", Pose2(0.0, 0.0, heading + off + 2.0 * pi * turns), part, LIMITS) == ""
    )


def test_a_vehicle_that_is_turned_is_not_suspected_where_it_is_told_within_a_turn() -> None:
    for phi in (-pi, -2.0, 2.0, pi, 4.0, 6.0):
        assert goals.degrees_beside("heading", Pose2(0.0, 0.0, phi), along(0.0).parts[0], LIMITS) == ""


def test_the_hint_is_part_of_a_refusal_and_of_the_remark_on_an_odd_goal() -> None:
    flat, up = along(0.0), along(0.5 * pi)
    wide = Corridor.from_offsets(flat, left=9.0, right=-9.0)
    refused = goals.checked(Pose2(20.0, 0.0, 360.0), flat, wide, CONFIG.vehicle, LIMITS)
    assert refused.problem.startswith("turned by 1.858 rad")
    assert refused.problem.endswith("goal heading 360: in degrees? radians are expected")
    wide = Corridor.from_offsets(up, left=9.0, right=-9.0)
    odd = goals.checked(Pose2(0.0, 20.0, 90.0), up, wide, CONFIG.vehicle, LIMITS)
    assert (odd.problem, odd.remark) == ("", "goal heading 90: in degrees? radians are expected")


# -- told again -------------------------------------------------------------------------------------


def test_a_goal_that_jitters_is_not_looked_at_again(looked: list[Pose2]) -> None:
    rng, fit = np.random.default_rng(0), None
    for _ in range(200):
        x, y, phi = rng.normal((18.0, 0.0, 0.0), (0.02, 0.02, 0.01))
        fit = again(fit, Pose2(x, y, phi))
        assert fit.problem == ""
    assert len(looked) < 20


def test_nor_is_one_far_out_of_reach(looked: list[Pose2]) -> None:
    rng, fit = np.random.default_rng(0), None
    for x, phi in ((500.0, 0.0), (18.0, 3.0)):
        for _ in range(50):
            fit = again(fit, Pose2(*rng.normal((x, 0.0, phi), (0.005, 0.005, 0.002))))
            assert fit.problem
    assert len(looked) == 2


def test_one_that_moves_away_is_looked_at_in_time(looked: list[Pose2]) -> None:
    fit = again(None, Pose2(18.0, 0.0, 0.0))
    for k in range(1, 300):
        goal = Pose2(18.0, 0.01 * k, 0.0)
        fit = again(fit, goal)
        room = 3.0 - HALF - goal.y
        assert bool(fit.problem) == (room < 0.0) or abs(room) <= LIMITS.unmoved
        assert bool(fit.remark) == (0.0 <= room < 0.1) or abs(room) <= LIMITS.unmoved or 0.07 < room < 0.11
    assert len(looked) < 40


@pytest.mark.parametrize("y", [3.0 - HALF - 0.05, 2.5])
def test_nor_is_one_beside_or_in_a_wall_that_moves_by_less_than_a_centimetre(
    y: float, looked: list[Pose2]
) -> None:
    fits: list[GoalFit] = []
    for k in range(50):
        fits.append(again(fits[-1] if fits else None, Pose2(18.0 + 1e-4 * k, y, 0.0)))
    assert len(looked) == 1
    assert len(set(fits)) == 1


def test_an_obstacle_that_comes_onto_the_goal_does_not_refuse_it(looked: list[Pose2]) -> None:
    goal = Pose2(18.0, 0.0, 0.0)
    fit = again(None, goal)
    covered = LANE.updated([block(19.0, 0.0)], 0.0, CONFIG)
    assert again(fit, goal, covered) is fit
    assert again(fit, Pose2(18.005, 0.0, 0.0), covered).problem == ""
    assert len(looked) == 1
    assert "crosses" in again(fit, Pose2(18.5, 0.0, 0.0), covered).problem  # another goal


def test_a_goal_refused_for_an_obstacle_is_looked_at_again_once_that_has_changed(
    looked: list[Pose2],
) -> None:
    goal, covered = Pose2(18.0, 0.0, 0.0), LANE.updated([block(19.0, 0.0)], 0.0, CONFIG)
    fit = again(None, goal, covered)
    assert "crosses" in fit.problem
    assert again(fit, goal, covered) is fit
    assert len(looked) == 1
    elsewhere = covered.updated([block(5.0, 2.0)], 0.0, CONFIG)
    assert again(fit, goal, elsewhere).problem == ""


def test_what_is_refused_whatever_stands_there_is_not_looked_at_again(looked: list[Pose2]) -> None:
    goal, where = Pose2(500.0, 0.0, 0.0), LANE
    fit = again(None, goal, where)
    for k in range(5):
        where = where.updated([block(5.0 + k, 2.0)], 0.0, CONFIG)
        assert again(fit, goal, where) is fit
    assert len(looked) == 1


steps = st.tuples(st.floats(-0.6, 0.6), st.floats(-0.6, 0.6), st.floats(-0.15, 0.15))


@settings(deadline=None, max_examples=60)
@given(begin=st.floats(-3.0, 3.0), moves=st.lists(steps, min_size=1, max_size=12))
def test_what_is_known_from_before_says_the_same_as_a_new_check(
    begin: float, moves: list[tuple[float, float, float]]
) -> None:
    where = LANE.updated([block(17.0, 0.5), block(24.0, -1.0)], 0.0, CONFIG)
    goal, fit = Pose2(16.0, begin, 0.0), None
    for x, y, phi in moves:
        goal = Pose2(goal.x + x, goal.y + y, goal.phi + phi)
        fit, exact = again(fit, goal, where), check(goal, where)
        # Within a centimetre of a change of the verdict either is right.
        near = abs(exact.room) <= LIMITS.unmoved
        assert near or bool(fit.problem) == bool(exact.problem)


# -- what the controller remembers ------------------------------------------------------------------


def told(known: GoalState, goal: Pose2 | None, where: Surroundings = LANE) -> GoalState:
    known, taken = validation.goal_in(goal, known, PATH, where, CONFIG)
    if taken is None:
        return known
    return GoalState(planned=taken, fit=known.fit, given_fit=known.given_fit, refusal=known.refusal)


def test_a_refusal_is_remembered_until_a_goal_is_taken() -> None:
    good, bad = Pose2(18.0, 0.0, 0.0), Pose2(500.0, 0.0, 0.0)
    known = told(GoalState(), good)
    assert (known.planned, known.refusal) == (good, "")
    for goal in (bad, bad, None, None):
        known = told(known, goal)
        assert known.planned == good
        assert known.refusal.startswith("goal (500, 0, 0) out of reach, 480 m")
    assert told(known, good).refusal == ""


def test_the_remark_on_the_goal_stays_while_others_are_refused() -> None:
    tight = Pose2(18.0, 3.0 - HALF - 0.05, 0.0)
    known = told(told(GoalState(), tight), Pose2(500.0, 0.0, 0.0))
    assert known.fit is not None
    assert known.fit.remark.startswith("the goal leaves 0.05 m")


numbers = st.one_of(st.floats(), st.integers(-(10**320), 10**320), st.sampled_from([None, "x", True, 1j]))


@settings(deadline=None, max_examples=200)
@given(x=numbers, y=numbers, phi=numbers, near=st.booleans())
def test_no_value_raises_and_what_is_taken_can_be_reached(x: Any, y: Any, phi: Any, near: bool) -> None:
    class Told:
        pass

    goal: Any = Told()
    goal.x, goal.y, goal.phi = (18.0, 0.1, phi) if near else (x, y, phi)
    known, taken = validation.goal_in(goal, GoalState(), PATH, LANE, CONFIG)
    assert (taken is None) == bool(known.refusal)
    if taken is not None:
        assert hypot(taken.x - 10.0, taken.y) <= 30.0 + 1e-9
