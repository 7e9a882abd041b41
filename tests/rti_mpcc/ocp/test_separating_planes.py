"""(H7): how near the pieces of the body are to corners, against the exact distances of polygons."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
import shapely
from shapely import affinity

from geometry import Corridor, Pose2, ReferencePath
from rti_mpcc.config import Footprint, Vehicle
from rti_mpcc.model.footprint import cover, disc_centres
from rti_mpcc.model.layout import PHI, X, Y
from rti_mpcc.ocp.corridor_rows import corridor_rows
from rti_mpcc.ocp.separating_planes import SeparatingPlanes, separating_planes
from rti_mpcc.types import Array
from tests.rti_mpcc.corners import corners_of, no_corners
from tests.rti_mpcc.differences import slopes

FOOTPRINT = Footprint(margin=0.1, near=1e3)
DISCS = cover(Vehicle(), FOOTPRINT)
PATH = ReferencePath.from_segments(Pose2(-40.0, 0.0, 0.0), [(1, 0.0, 80.0)])
BLOCK = np.array([(0.0, 0.0), (3.0, 0.0), (3.0, 2.0), (0.0, 2.0)])
OBSTACLE = 2


def beside(block: Array = BLOCK) -> Corridor:
    """One obstacle, the boundaries far away."""
    return Corridor.from_offsets(PATH, left=30.0, right=-30.0, obstacles=[block])


def drawn(seed: int, count: int = 300) -> Array:
    """Bodies round the block, most of them clear of it; every other one has a corner of it before an end."""
    random, vehicle = np.random.default_rng(seed), Vehicle()
    states = np.zeros((count, 6))
    states[:, [X, Y]] = random.uniform(-6.0, 8.0, (count, 2))
    states[:, PHI] = random.uniform(-7.0, 7.0, count)
    some = states[::2]
    ahead, aside = random.uniform(0.05, 0.5, len(some)), random.uniform(-1.2, 1.2, len(some))
    ahead = np.where(random.random(len(some)) < 0.5, vehicle.front + ahead, -vehicle.rear - ahead)
    c, s = np.cos(some[:, PHI]), np.sin(some[:, PHI])
    corners = BLOCK[random.integers(0, 4, len(some))]
    some[:, X], some[:, Y] = corners[:, 0] - ahead * c + aside * s, corners[:, 1] - ahead * s - aside * c
    return states


def faced(states: Array, corridor: Corridor, *, at_corners: bool = True) -> SeparatingPlanes:
    planes = corridor.half_planes(0, disc_centres(states, DISCS).reshape(-1, 2))
    reflex_vertices = corners_of(corridor, planes) if at_corners else no_corners
    every = np.arange(planes.distance.size)
    return separating_planes(states, planes, every, DISCS, FOOTPRINT, reflex_vertices)


def gaps(states: Array, corridor: Corridor, *, at_corners: bool = True, side: int = OBSTACLE) -> Array:
    """(states * discs,) to one side [m]."""
    return faced(states, corridor, at_corners=at_corners).gap.reshape(-1, 3 if corridor.obstacles else 2)[
        :, side
    ]


def pieces(states: Array) -> list[shapely.Polygon]:
    """What each disc covers, in the order of the discs of the states."""
    a, b, out = DISCS.half_length, DISCS.half_width, []
    for state, centres in zip(states, disc_centres(states, DISCS), strict=True):
        for x, y in centres:
            box = affinity.rotate(shapely.box(-a, -b, a, b), state[PHI], origin=(0, 0), use_radians=True)
            out.append(affinity.translate(box, x, y))
    return out


def exact(states: Array, block: Array = BLOCK) -> Array:
    return np.asarray(shapely.distance(pieces(states), shapely.Polygon(block)))


def test_no_gap_is_wider_than_the_exact_one() -> None:
    """Far away the nearest sample is found but roughly; (H6) is rounded, which makes gaps narrower."""
    states = drawn(1)
    gap, distance = gaps(states, beside()), exact(states)
    clear = distance > 0.0
    assert clear.mean() > 0.5
    assert (gap[clear] <= distance[clear] + 0.01).all()
    turned = clear & (gap > gaps(states, beside(), at_corners=False))
    assert turned.sum() > 50
    assert (gap[turned] <= distance[turned] + 1e-9).all()
    assert (gap[~clear] <= 1e-9).all()


def test_no_gap_is_narrower_than_without_corners_and_some_are_much_wider() -> None:
    states = drawn(2)
    plain, turned = faced(states, beside(), at_corners=False).gap, faced(states, beside()).gap
    assert (turned >= plain - 1e-12).all()
    wider = (turned - plain).reshape(-1, 3)[:, OBSTACLE]
    assert 0.02 < (wider > 0.05).mean() < 0.2
    assert wider.max() > 0.3


def test_where_the_end_of_a_piece_points_at_a_corner_the_gap_is_exact() -> None:
    states = drawn(3)
    gap, distance = gaps(states, beside()), exact(states)
    changed = (gap > gaps(states, beside(), at_corners=False) + 1e-9) & (distance > 0.0)
    short = (distance - gap)[changed]
    # (H6) takes a little off where a side of the block, not its corner, is what the piece faces.
    assert (np.abs(short) < 1e-9).mean() > 0.7
    assert (short <= DISCS.half_width * FOOTPRINT.rounding + 1e-9).all()


def test_the_case_that_it_is_for() -> None:
    """A block whose corner stands 0.15 m before the bumper, half-way between its middle and its end."""
    vehicle = Vehicle()
    corner = np.array([vehicle.front + 0.15, 0.25 * vehicle.width])
    block = corner + np.array([(0, 0), (1, 0), (1, 1), (0, 1)])
    states = np.zeros((1, 6))
    assert gaps(states, beside(block)).min() == pytest.approx(0.15, abs=1e-9)
    assert gaps(states, beside(block), at_corners=False).min() < -0.2


@pytest.mark.parametrize("seed", range(3))
def test_slopes_are_those_of_the_exact_gap_to_a_corner(seed: int) -> None:
    corridor, states = beside(), drawn(10 + seed, 150)
    planes = corridor.half_planes(0, disc_centres(states, DISCS).reshape(-1, 2))
    rows = corridor_rows(states, planes, DISCS, FOOTPRINT, corners_of(corridor, planes))
    plain = corridor_rows(states, planes, DISCS, FOOTPRINT, no_corners)
    assert rows is not None
    assert plain is not None
    distance = exact(states).reshape(len(states), -1)
    gap = 0.1 - rows.lower[..., OBSTACLE]
    is_exact = (np.abs(gap - distance) < 1e-9) & (gap > 0.1 - plain.lower[..., OBSTACLE] + 1e-6)
    assert is_exact.sum() > 10
    for k, disc in np.argwhere(is_exact):

        def held(pose: Array, disc: int = disc) -> Array:
            return exact(np.append(pose, np.zeros(3))[None])[disc : disc + 1]

        found = slopes(held, states[k, :3])[0]
        np.testing.assert_allclose(rows.slopes[k, disc, OBSTACLE], found, atol=1e-5)


def test_mirrored_bodies_and_blocks_have_the_same_gaps() -> None:
    states = drawn(5, 6)  # of few points the nearest sample is found exactly
    mirrored = states * np.array([1.0, -1.0, -1.0, 1.0, 1.0, 1.0])
    gap = gaps(states, beside())
    np.testing.assert_allclose(gaps(mirrored, beside(BLOCK * np.array([1.0, -1.0]))), gap, atol=1e-9)


def test_headings_count_on_any_branch() -> None:
    states = drawn(6)
    turned = states.copy()
    turned[:, PHI] += 6.0 * pi
    np.testing.assert_allclose(faced(turned, beside()).gap, faced(states, beside()).gap, atol=1e-9)


def test_open_ends_count_as_the_points_that_they_are() -> None:
    """Both walls end at x = 0; the body stands beyond, turned towards the end of the left one."""
    path = ReferencePath.from_segments(Pose2(-20.0, 0.0, 0.0), [(1, 0.0, 20.0)])
    corridor = Corridor.from_offsets(path, left=2.0, right=-2.0)
    random = np.random.default_rng(7)
    states = np.zeros((200, 6))
    states[:, X], states[:, Y] = random.uniform(1.0, 6.0, 200), random.uniform(0.0, 5.0, 200)
    states[:, PHI] = random.uniform(-pi, pi, 200)
    wall = shapely.LineString([(-20.0, 2.0), (0.0, 2.0)])
    distance = np.asarray(shapely.distance(pieces(states), wall))
    gap, clear = gaps(states, corridor, side=0), distance > 0.0
    assert (gap[clear] <= distance[clear] + 1e-9).all()
    assert (gap - gaps(states, corridor, at_corners=False, side=0)).max() > 0.3
