"""Drawn courses: repeatable, within their range, and all of them scenarios."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from benchmarks.problems.courses import CAMPAIGN, CourseRange, drawn_course
from rti_mpcc.errors import InputError
from rti_mpcc.simulation import Scenario
from rti_mpcc.simulation.sections.ground import CorridorSection

REPORT = CourseRange()
HALF = 2.069 / 2


@pytest.fixture(
    scope="module",
    params=[pytest.param(REPORT, marks=pytest.mark.acceptance), CAMPAIGN],
    ids=["report", "campaign"],
)
def drawn(request: pytest.FixtureRequest) -> tuple[CourseRange, tuple[Scenario, ...]]:
    return request.param, tuple(drawn_course(11, index, request.param) for index in range(12))


def arcs(course: Scenario) -> Iterator[tuple[int, float, float]]:
    assert course.path is not None
    assert course.path.segments is not None
    return ((piece.direction, piece.curvature, piece.length) for piece in course.path.segments)


def corridor(course: Scenario) -> CorridorSection:
    assert course.corridor is not None
    return course.corridor


def place(course: Scenario) -> tuple[float, float, float]:
    """Of the goal: behind the end of the route (negative: inside), beside it [m], turned [rad]."""
    assert course.goal.offset is not None
    along, beside, turned = course.goal.offset
    return list(arcs(course))[-1][0] * along, beside, turned


def test_the_same_seed_draws_the_same_course() -> None:
    assert drawn_course(7, 3) == drawn_course(7, 3)
    assert drawn_course(7, 3).name == "course_7_03"
    different = [drawn_course(7, 3), drawn_course(8, 3), drawn_course(7, 7), drawn_course(7, 3, CAMPAIGN)]
    assert len({course.path for course in different}) == 4


def test_routes_are_within_the_range(drawn: tuple[CourseRange, tuple[Scenario, ...]]) -> None:
    within, some = drawn
    for course in some:
        path = course.build_path()
        assert within.pieces[0] <= len(list(arcs(course))) <= within.pieces[1]
        assert within.length[0] - 1e-3 <= path.length <= within.length[1] + 1e-3
        assert path.max_curvature <= within.curvature
        assert len(path.cusps) <= (1 if within.cusp_share else 0)
        for _, curvature, length in arcs(course):
            assert length >= within.shortest_piece - 1e-4
            assert abs(curvature) * length <= within.turn + 0.01


def test_corridors_are_within_the_range(drawn: tuple[CourseRange, tuple[Scenario, ...]]) -> None:
    within, some = drawn
    for course in some:
        section = corridor(course)
        assert section.left is not None
        assert section.right is not None
        for side in (section.left, -section.right):
            assert within.half_width[0] <= side <= within.half_width[1]
        assert len(section.narrowings) <= within.narrowings
        assert len(section.obstacles) <= within.obstacles
        for narrowing in section.narrowings:
            for offset in (narrowing.left, narrowing.right):
                if offset is not None:
                    room = abs(offset) - HALF
                    assert within.narrow_room[0] - 1e-3 <= room <= within.narrow_room[1] + 1e-3


def test_goals_are_within_the_range_and_of_all_kinds(
    drawn: tuple[CourseRange, tuple[Scenario, ...]],
) -> None:
    within, some = drawn
    for index, course in enumerate(some):
        behind, beside, turned = place(course)
        assert list(arcs(course))[-1][0] == (1, -1)[index % 2]
        assert (behind > 0) == (index % 4 > 1)
        assert -within.inside <= behind <= within.behind
        assert abs(beside) <= within.beside
        assert abs(turned) <= within.turned


def test_many_courses_use_the_whole_range(drawn: tuple[CourseRange, tuple[Scenario, ...]]) -> None:
    within, some = drawn
    places = [place(course) for course in some]
    assert max(abs(beside) for _, beside, _ in places) > 0.8 * within.beside
    assert max(abs(turned) for _, _, turned in places) > 0.7 * within.turned
    assert len({len(list(arcs(course))) for course in some}) == 3
    assert any(corridor(course).narrowings for course in some)
    assert any(course.build_path().cusps for course in some) == (within is CAMPAIGN)
    assert any(corridor(course).obstacles for course in some) == (within is CAMPAIGN)
    assert {course.start_pose().phi > 0.0 for course in some} == {True, False}


def test_a_range_in_which_nothing_can_be_docked_in_says_so() -> None:
    with pytest.raises(InputError, match="must be >= 0"):
        drawn_course(-1, 0)
    with pytest.raises(InputError, match="course 0 of seed 1: none of 200 draws can be docked in"):
        drawn_course(1, 0, CourseRange(half_width=(1.1, 1.1), narrowings=0))
