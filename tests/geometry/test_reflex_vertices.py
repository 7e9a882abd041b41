from __future__ import annotations

import numpy as np
import pytest

from geometry import Corridor, HalfPlanes, Narrowing, Pose2, ReferencePath, ReflexVertices

STRAIGHT = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 20.0)])
BLOCK = [(8.0, -1.0), (10.0, -1.0), (10.0, 1.0), (8.0, 1.0)]


def reflex_vertices(corridor: Corridor, *points: tuple[float, float]) -> ReflexVertices | None:
    return all_jutting(corridor, corridor.half_planes(0, np.array(points)))


def all_jutting(corridor: Corridor, planes: HalfPlanes) -> ReflexVertices | None:
    return corridor.reflex_vertices(0, planes, np.arange(planes.distance.size))


def only(found: ReflexVertices | None, row: int, side: int, sides: int) -> tuple[complex, complex]:
    """Tangents of the one entry, which has to be of that point and side."""
    assert found is not None
    np.testing.assert_array_equal(found.at, [row * sides + side])
    return complex(found.before[0]), complex(found.after[0])


def test_beside_straight_walls_nothing_juts_out() -> None:
    assert (
        reflex_vertices(Corridor.from_offsets(STRAIGHT, left=4.0, right=-3.0), (3.0, 1.0), (12.0, -1.0))
        is None
    )


def test_beyond_open_ends_the_tangent_that_leads_nowhere_is_missing() -> None:
    corridor = Corridor.from_offsets(STRAIGHT, left=4.0, right=-3.0)
    # The left wall is stored from its far end on, so that the allowed side is on its left.
    found = reflex_vertices(corridor, (-2.0, 1.0), (22.0, 1.0), (5.0, 0.0))
    assert found is not None
    tangents = dict(zip(found.at.tolist(), zip(found.before, found.after, strict=True), strict=True))
    assert tangents == {0: (-1.0, 0.0), 1: (0.0, 1.0), 2: (0.0, -1.0), 3: (1.0, 0.0)}


def test_at_corners_that_jut_out_both_tangents_are_there() -> None:
    stepped = Corridor.from_offsets(
        STRAIGHT, left=4.0, right=-3.0, narrowings=[Narrowing(10.0, 14.0, left=2.0)]
    )
    before, after = only(reflex_vertices(stepped, (9.0, 0.5)), 0, 0, 2)
    assert before == pytest.approx(-1.0)
    assert after == pytest.approx(1j)


def test_corners_that_recede_are_none() -> None:
    stepped = Corridor.from_offsets(
        STRAIGHT, left=4.0, right=-3.0, narrowings=[Narrowing(10.0, 14.0, left=2.0)]
    )
    assert reflex_vertices(stepped, (9.9, 4.4)) is None


@pytest.mark.parametrize("turns", range(4))
def test_all_corners_of_a_ring_jut_out_that_it_is_closed_at_too(turns: int) -> None:
    outline = np.roll(np.array(BLOCK), turns, axis=0)
    corridor = Corridor.from_offsets(STRAIGHT, left=40.0, right=-40.0, obstacles=[outline])
    corners = [
        (x + dx, y + dy) for (x, y), (dx, dy) in zip(BLOCK, np.sign(np.array(BLOCK) - [9, 0]), strict=True)
    ]
    found = reflex_vertices(corridor, *corners)
    assert found is not None
    np.testing.assert_array_equal(found.at, [2, 5, 8, 11])
    # The outside is on the left, so the outline turns right by 90 deg.
    np.testing.assert_allclose(found.after / found.before, -1j, atol=1e-12)


def test_a_smooth_bend_has_no_corners() -> None:
    bend = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.2, 8.0)])
    corridor = Corridor.from_offsets(bend, left=3.0, right=-3.0)
    assert reflex_vertices(corridor, (2.0, 0.0), (3.0, 0.5)) is None


def test_what_was_not_looked_up_does_not_jut_out() -> None:
    corridor = Corridor.from_offsets(STRAIGHT, left=4.0, right=-3.0)
    points = np.array([(-2.0, 0.5), (22.0, 0.5)])
    planes = corridor.half_planes(0, points)
    assert all_jutting(corridor, planes) is not None
    far = corridor.half_planes(0, points + 0.01, planes, within=0.5)
    assert (far.sample < 0).all()
    assert all_jutting(corridor, far) is None


def test_only_those_asked_for_are_told_of() -> None:
    corridor = Corridor.from_offsets(STRAIGHT, left=4.0, right=-3.0)
    planes = corridor.half_planes(0, np.array([(-2.0, 1.0), (22.0, 1.0), (5.0, 0.0)]))
    found = corridor.reflex_vertices(0, planes, np.array([5, 3, 0]))
    assert found is not None
    told = dict(zip(found.at.tolist(), found.before.tolist(), strict=True))
    assert told == {1: 1.0, 2: -1.0}
    assert corridor.reflex_vertices(0, planes, np.array([4, 5])) is None
