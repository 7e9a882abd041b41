"""Distances near what they divide by: corners told twice or on a line, gaps of 0, parts without length."""

from __future__ import annotations

from math import cos, hypot, pi, sin

import numpy as np
import pytest
import shapely
from hypothesis import example, given, settings
from hypothesis import strategies as st

from geometry import Area, Corridor, Pose2, ReferencePath
from geometry.arrays import Array
from geometry.convex import NORMAL_X, NORMAL_Y, ON_A_X, ON_A_Y, ON_B_X, ON_B_Y, VALUE
from geometry.shape_grid import Body
from tests.geometry.convex_shapes import between
from tests.geometry.sides import contacts_of, distances

FEW = settings(derandomize=True, deadline=None, max_examples=60)

Ring = list[tuple[float, float]]
Segment = tuple[int, float, float]

GAPS = st.one_of(st.sampled_from([0.0, 1e-17, 1e-16, 3e-16, 1e-15, 1e-12, 1e-9, 1e-6]), st.floats(-1.0, 3.0))
"""Between two bodies [m], negative where they overlap."""
CONVEX: Ring = [(-0.8, -1.0), (3.7, -1.0), (3.7, 1.0), (-0.8, 1.0)]
L_SHAPE: Ring = [(0.0, 0.0), (4.0, 0.0), (4.0, 1.0), (1.0, 1.0), (1.0, 4.0), (0.0, 4.0)]
T_SHAPE: Ring = [
    (0.0, 0.0),
    (6.0, 0.0),
    (6.0, 1.0),
    (4.0, 1.0),
    (4.0, 3.0),
    (2.0, 3.0),
    (2.0, 1.0),
    (0.0, 1.0),
]


def box(length: float, width: float, x: float, y: float, phi: float) -> Array:
    """Corners (4, 2) of a rectangle around a pose."""
    c, s = cos(phi), sin(phi)
    half = 0.5 * np.array([(-length, -width), (length, -width), (length, width), (-length, width)])
    return np.asarray(half @ np.array([(c, s), (-s, c)]) + (x, y))


@st.composite
def repeated(draw: st.DrawFn, ring: Ring) -> Ring:
    """The same outline, with some corners twice, some in the middle of an edge, from any corner on."""
    found: Ring = []
    for i, (x, y) in enumerate(ring):
        next_x, next_y = ring[(i + 1) % len(ring)]
        found += [(x, y)] * draw(st.integers(1, 3))
        if draw(st.booleans()):
            found.append((0.5 * (x + next_x), 0.5 * (y + next_y)))
    first = draw(st.integers(0, len(found) - 1))
    return found[first:] + found[:first]


# -- two convex shapes ---------------------------------------------------------------------------------------


@FEW
@given(gap=GAPS, aside=st.floats(-1.0, 1.0), turn=st.floats(-pi, pi), x=st.floats(-50.0, 50.0))
@example(gap=0.0, aside=0.0, turn=0.0, x=0.0)
@example(gap=1e-16, aside=0.0, turn=0.3, x=1.1)
@example(gap=0.0, aside=0.0, turn=0.3, x=47.0)
def test_the_distance_of_two_bodies_is_the_gap_between_them(
    gap: float, aside: float, turn: float, x: float
) -> None:
    ahead, across = np.array([cos(turn), sin(turn)]), np.array([-sin(turn), cos(turn)])
    a = box(2.0, 2.0, x, 0.0, turn)
    at = np.array([x, 0.0]) - (3.0 + gap) * ahead + aside * across
    b = box(4.0, 4.0, float(at[0]), float(at[1]), turn)
    found, other = between(a, b), between(b, a)
    assert found[VALUE] == pytest.approx(gap, abs=1e-12)
    assert other[VALUE] == pytest.approx(found[VALUE], abs=1e-12)


@FEW
@given(
    gap=GAPS,
    along=st.floats(-4.0, 4.0),
    turn=st.floats(-pi, pi),
    bent=st.floats(-pi, pi),
    x=st.floats(-50.0, 50.0),
)
@example(gap=0.0, along=0.0, turn=0.0, bent=0.0, x=0.0)
@example(gap=0.0, along=0.5, turn=0.3, bent=0.0, x=1.1)
@example(gap=1e-16, along=0.5, turn=0.7, bent=0.4, x=3.3)
def test_the_normal_between_two_bodies_has_length_1_and_leads_from_one_to_the_other(
    gap: float, along: float, turn: float, bent: float, x: float
) -> None:
    a = box(2.0, 1.0, x, 0.0, turn)
    ahead, across = np.array([cos(turn), sin(turn)]), np.array([-sin(turn), cos(turn)])
    at = np.array([x, 0.0]) - (1.0 + gap) * ahead + along * across
    b = box(3.0, 2.0, float(at[0]), float(at[1]), turn + bent)
    b = b - max(float(((b - (x, 0.0)) @ ahead).max()) + 1.0 + gap, 0.0) * ahead
    found = between(a, b)
    normal = found[[NORMAL_X, NORMAL_Y]]
    assert hypot(*normal) == pytest.approx(1.0, abs=1e-5)
    apart = found[[ON_A_X, ON_A_Y]] - found[[ON_B_X, ON_B_Y]]
    assert float(normal @ apart) == pytest.approx(found[VALUE], abs=1e-9)


# -- polygons ------------------------------------------------------------------------------------------------


@FEW
@given(
    ring=st.sampled_from([CONVEX, L_SHAPE, T_SHAPE]).flatmap(repeated),
    x=st.floats(-3.0, 8.0),
    y=st.floats(-3.0, 6.0),
    phi=st.floats(-pi, pi),
)
@example(ring=L_SHAPE, x=3.0, y=0.5, phi=0.0)
@example(ring=[*L_SHAPE[:4], *L_SHAPE[3:]], x=3.0, y=0.5, phi=0.0)  # in the obstacle
@example(ring=[*L_SHAPE[:4], *L_SHAPE[3:]], x=4.1, y=0.5, phi=0.0)  # across its outline
def test_a_body_is_as_far_from_an_obstacle_however_often_its_corners_are_told(
    ring: Ring, x: float, y: float, phi: float
) -> None:
    body = Body.of(box(0.6, 0.4, 0.0, 0.0, 0.0))
    poses = np.array([(x, y, phi)])
    apart = float(Area(obstacles=[ring]).signed_distances(body, poses)[0])
    in_corridor = distances(Corridor.in_area(Area()).with_obstacles([ring]), 0, body, poses).min()
    truth = float(shapely.distance(shapely.Polygon(box(0.6, 0.4, x, y, phi)), shapely.Polygon(ring)))
    assert max(apart, 0.0) == pytest.approx(truth, abs=1e-9)
    assert max(float(in_corridor), 0.0) == pytest.approx(truth, abs=1e-9)


# -- half-planes beside a body -------------------------------------------------------------------------------


@FEW
@given(gap=GAPS, x=st.floats(-20.0, 20.0), phi=st.floats(-0.05, 0.05))
@example(gap=0.0, x=0.0, phi=0.0)
@example(gap=1e-16, x=0.1, phi=0.0)
@example(gap=1e-16, x=0.3, phi=0.02)
def test_half_planes_beside_a_body_have_normals_of_length_1_and_turn_no_faster_than_its_reach(
    gap: float, x: float, phi: float
) -> None:
    body, reach = Body.of(CONVEX), hypot(3.7, 1.0)
    beside = -(1.0 + gap) - 5.0 * abs(phi)
    wall: Ring = [(x - 9.0, beside - 1.0), (x + 9.0, beside - 1.0), (x + 9.0, beside), (x - 9.0, beside)]
    path = ReferencePath.from_segments(Pose2(-40.0, 0.0, 0.0), [(1, 0.0, 80.0)])
    for corridor in (
        Corridor.in_area(Area(obstacles=[wall])),
        Corridor.from_offsets(path, left=9.0, right=beside),
    ):
        found = contacts_of(corridor, 0, body, np.array([(x, 0.0, phi)]), 2.0, 0.02)
        near = np.isfinite(found.apart)
        assert np.abs(found.normal[near]) == pytest.approx(np.ones(near.sum()), abs=1e-5)
        assert (np.abs((found.at.conj() * found.normal).imag[near]) <= reach + 1e-6).all()


# -- boundaries along a path ---------------------------------------------------------------------------------

LENGTHS = st.one_of(st.sampled_from([1e-17, 1e-9, 1e-5, 1e-3]), st.floats(0.5, 8.0))
SEGMENTS = st.lists(
    st.tuples(st.sampled_from([1, -1]), st.sampled_from([0.0, 1e-17, 0.05, -0.1]), LENGTHS),
    min_size=1,
    max_size=4,
)


@FEW
@given(segments=SEGMENTS)
@example(segments=[(1, 0.0, 10.0), (-1, 0.0, 1e-17), (1, 0.0, 5.0)])
@example(segments=[(1, 0.0, 10.0), (1, 0.2, 1e-17), (1, 0.1, 5.0)])
@example(segments=[(1, 0.0, 1e-17)])
def test_boundaries_beside_a_path_are_as_far_from_it_as_they_are_told(segments: list[Segment]) -> None:
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), segments)
    corridor = Corridor.from_offsets(path, left=2.0, right=-1.5)
    assert corridor.narrowest()[0] == pytest.approx(3.5)
    for k, part in enumerate(path.parts):
        at = part.reference(np.linspace(part.start, part.end, 50))
        driven = shapely.MultiPoint(np.column_stack([at.x, at.y]))
        for lines, offset in zip(corridor.lines(k), (2.0, 1.5), strict=True):
            for line in lines:
                assert np.isfinite(line).all()
                assert shapely.distance(driven, shapely.MultiPoint(line)) >= offset - 1e-2
