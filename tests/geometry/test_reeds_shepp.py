"""Reeds-Shepp words: where they lead, that none is missing, and their lengths beside OMPL's."""

from __future__ import annotations

from itertools import product
from math import acos, cos, hypot, pi, sin
from typing import Any

import numpy as np
import pytest

from geometry.arrays import Array
from geometry.reeds_shepp import PIECES, WORDS, after, least_cost, shortest, words

Pose = tuple[float, float, float]
START: Pose = (0.0, 0.0, 0.0)
GRID: list[Pose] = [
    (x, y, phi * pi / 4.0)
    for x, y, phi in product((-4.0, -2.0, -1.0, 0.0, 1.0, 2.0, 4.0), (-4.0, -2.0, 0.0, 2.0), range(-8, 9))
]
"""Where equations are at the ends of their domains, and headings on all branches."""


def drawn(count: int, seed: int, *, least: float = -3.0, most: float = 2.0) -> list[Pose]:
    """Poses within 10**least to 10**most radii, half of them within a few radii."""
    random = np.random.default_rng(seed)
    found = []
    for i in range(count):
        size = 10.0 ** random.uniform(least, most) if i % 2 else 4.0
        x, y = random.uniform(-size, size, 2)
        found.append((float(x), float(y), float(random.uniform(-2.0 * pi, 2.0 * pi))))
    return found


def words_to(pose: Pose) -> tuple[Array, Array]:
    lengths, turns = np.full((WORDS, PIECES), np.nan), np.full((WORDS, PIECES), np.nan)
    count = words(*pose, lengths, turns)
    assert 0 < count <= WORDS
    assert np.isnan(lengths[count:]).all()
    return lengths[:count], turns[:count]


def ends(lengths: Array, turns: Array) -> Array:
    """Poses (n, 3) after words of radius 1, by closed forms of this file's own."""
    heading = np.cumsum(np.column_stack((np.zeros(len(lengths)), lengths * turns)), axis=1)
    a, b = heading[:, :-1], heading[:, 1:]
    side = np.where(turns == 0.0, 1.0, turns)
    x = np.where(turns == 0.0, lengths * np.cos(a), (np.sin(b) - np.sin(a)) / side).sum(axis=1)
    y = np.where(turns == 0.0, lengths * np.sin(a), (np.cos(a) - np.cos(b)) / side).sum(axis=1)
    return np.column_stack((x, y, heading[:, -1]))


def cost_of(lengths: Array, back: float, cusp: float) -> float:
    """Cost of the pieces (PIECES,) of one word."""
    driven = lengths[lengths != 0.0]
    cusps = np.count_nonzero(np.diff(np.sign(driven)))
    return float(np.where(driven > 0.0, driven, -back * driven).sum() + cusp * cusps)


def length_to(pose: Pose) -> float:
    return float(least_cost(*pose, 1.0, 1.0, 0.0))


def seen_from(start: Pose, goal: Pose) -> Pose:
    c, s = cos(start[2]), sin(start[2])
    dx, dy = goal[0] - start[0], goal[1] - start[1]
    return c * dx + s * dy, c * dy - s * dx, goal[2] - start[2]


def driven(*pieces: tuple[float, float], radius: float = 1.0) -> Pose:
    pose = START
    for length, turn in pieces:
        pose = after(*pose, length, turn, radius)
    return pose


def check_words(pose: Pose) -> None:
    lengths, turns = words_to(pose)
    assert set(np.unique(turns)) <= {-1.0, 0.0, 1.0}
    apart = ends(lengths, turns) - pose
    apart[:, 2] = 2.0 * np.sin(0.5 * apart[:, 2])
    np.testing.assert_allclose(apart, 0.0, atol=1e-9)


@pytest.mark.parametrize("seed", range(4))
def test_every_word_leads_to_its_pose(seed: int) -> None:
    for pose in drawn(1500, seed):
        check_words(pose)


def test_every_word_leads_to_its_pose_on_a_grid() -> None:
    for pose in GRID:
        check_words(pose)


def test_every_word_leads_to_its_pose_around_a_grid() -> None:
    random = np.random.default_rng(5)
    for x, y, phi in GRID:
        off = random.choice([1e-15, 1e-13, 1e-11, 1e-9, 1e-6]) * random.uniform(-1.0, 1.0, 3)
        check_words((x + float(off[0]), y + float(off[1]), phi + float(off[2])))


# The words of the paper's table: the base ones, `u` for a length that two pieces share.
FORMS = [
    "L+S+L+", "L+S+R+",
    "L+R-L+", "L+R-L-", "L+R+L-",
    "L+Ru+Lu-R-", "L+Ru-Lu-R+",
    "L+Rq-S-L-", "L+Rq-S-R-", "L+S+Lq+R-", "R+S+Lq+R-",
    "L+Rq-S-Lq-R+",
]  # fmt: skip


def drawn_word(form: str, random: np.random.Generator) -> list[tuple[float, float]]:
    """Pieces of such a form: arcs up to half a turn, `q` a quarter, and up to that long what is shared."""
    shared, pieces, at = random.uniform(0.01, 1.0), [], 0
    # Beyond 60 deg two arcs that share their length are no word of (RS5); (RS6) has them up to 90 deg.
    shared *= pi / 3.0 if "+Lu-" in form else pi / 2.0
    while at < len(form):
        turn = {"L": 1.0, "R": -1.0, "S": 0.0}[form[at]]
        kind = form[at + 1] if form[at + 1] in "uq" else ""
        at += 1 + len(kind)
        free = random.uniform(0.01, 0.99 * pi) if turn else random.uniform(0.01, 20.0)
        length = {"u": shared, "q": 0.5 * pi, "": free}[kind]
        pieces.append((length if form[at] == "+" else -length, turn))
        at += 1
    return pieces


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("flip", [1.0, -1.0])
@pytest.mark.parametrize("mirror", [1.0, -1.0])
def test_each_of_the_48_words_is_found(form: str, flip: float, mirror: float) -> None:
    random = np.random.default_rng([6, FORMS.index(form)])
    for _ in range(100):
        pieces = [(flip * length, mirror * turn) for length, turn in drawn_word(form, random)]
        lengths, turns = words_to(driven(*pieces))
        wanted = np.zeros((2, PIECES))
        wanted[:, : len(pieces)] = np.transpose(pieces)
        same = np.abs(lengths - wanted[0]).max(axis=1) < 1e-6
        same &= (np.abs(turns - wanted[1])[:, : len(pieces)] == 0.0).all(axis=1)
        assert same.any(), pieces


@pytest.mark.parametrize("off", [0.0, 1e-14, -1e-14])
def test_arcs_of_more_than_half_a_turn_are_found_where_the_direction_is_kept(off: float) -> None:
    arcs, last_arcs = (0.0, 0.5, 4.0, 6.0), (0.0, 0.3, 5.9)
    for first, last, straight, turn in product(arcs, last_arcs, (0.0, 2.0), (1.0, -1.0)):
        x, y, phi = driven((first, 1.0), (straight, 0.0), (last, turn))
        x, y, phi = x + off, y + off, phi - off
        wanted = first + straight + last
        assert least_cost(x, y, phi, 1.0, 20.0, 100.0) <= wanted + 1e-9
        assert least_cost(-x, y, -phi, 1.0, 1.5, 100.0) <= 1.5 * wanted + 1e-9


class TestBesideOmpl:
    @pytest.fixture
    def distance(self) -> Any:
        base = pytest.importorskip("ompl.base")
        space = base.ReedsSheppStateSpace(1.0)
        start, goal = space.allocState(), space.allocState()
        start.setXY(0.0, 0.0)
        start.setYaw(0.0)

        def between(pose: Pose) -> float:
            goal.setXY(pose[0], pose[1])
            goal.setYaw(pose[2])
            return float(space.distance(start, goal))

        return between

    def test_the_length_is_the_same(self, distance: Any) -> None:
        for pose in drawn(20_000, seed=10):
            assert length_to(pose) == pytest.approx(distance(pose), rel=1e-6, abs=1e-9)

    def test_the_length_is_the_same_on_a_grid(self, distance: Any) -> None:
        for pose in GRID:
            assert length_to(pose) == pytest.approx(distance(pose), rel=1e-6, abs=1e-6)


def test_the_shortest_way_is_no_longer_than_by_another_pose() -> None:
    poses = drawn(6000, seed=11, most=1.0)
    for via, goal in zip(poses[::2], poses[1::2], strict=True):
        assert length_to(goal) <= length_to(via) + length_to(seen_from(via, goal)) + 1e-9


def test_the_length_to_close_poses_differs_little() -> None:
    random = np.random.default_rng(12)
    for pose in [*drawn(2000, seed=13, most=1.0), *GRID]:
        off = random.uniform(-1.0, 1.0, 3) * 10.0 ** random.uniform(-12.0, -4.0)
        other = (pose[0] + float(off[0]), pose[1] + float(off[1]), pose[2] + float(off[2]))
        # Sideways the car gets by ways as long as the root of it.
        assert abs(length_to(pose) - length_to(other)) < 8.0 * np.sqrt(np.abs(off).max()) + 1e-9


def test_it_is_neither_shorter_than_the_straight_line_nor_than_the_turn() -> None:
    for x, y, phi in drawn(3000, seed=14):
        length = length_to((x, y, phi))
        assert length >= hypot(x, y) - 1e-9
        assert length >= acos(cos(phi)) - 1e-7


def test_it_is_symmetric() -> None:
    for pose in drawn(3000, seed=15):
        x, y, phi = pose
        length = pytest.approx(length_to(pose), rel=1e-9)
        assert length_to((x, -y, -phi)) == length
        assert length_to((-x, y, -phi)) == length
        assert length_to(seen_from(pose, START)) == length
        assert length_to((x, y, phi + 2.0 * pi)) == length
        assert length_to((x, y, phi - 4.0 * pi)) == length


def test_costs_are_symmetric() -> None:
    for x, y, phi in drawn(3000, seed=16):
        cost = least_cost(x, y, phi, 1.0, 3.0, 2.0)
        assert least_cost(x, -y, -phi, 1.0, 3.0, 2.0) == pytest.approx(cost, rel=1e-9)
        # Driven in the other direction all of it costs a third, but for the cusps.
        other = least_cost(-x, y, -phi, 1.0, 1.0 / 3.0, 2.0 / 3.0)
        assert 3.0 * other == pytest.approx(cost, rel=1e-9)


@pytest.mark.parametrize(("back", "cusp"), [(1.0, 0.0), (1.0, 1.5), (2.0, 0.0), (3.0, 4.0), (0.5, 0.1)])
def test_the_least_cost_is_that_of_the_cheapest_word(back: float, cusp: float) -> None:
    for pose in [*drawn(1000, seed=17), *GRID]:
        radius = 4.0
        lengths, _ = words_to(pose)
        wanted = min(cost_of(radius * each, back, cusp) for each in lengths)
        x, y, phi = radius * pose[0], radius * pose[1], pose[2]
        assert least_cost(x, y, phi, radius, back, cusp) == pytest.approx(wanted, rel=1e-9, abs=1e-8)
        found, turns = np.full(PIECES, np.nan), np.full(PIECES, np.nan)
        assert shortest(x, y, phi, radius, back, cusp, found, turns) == pytest.approx(wanted, abs=1e-8)
        assert cost_of(found, back, cusp) == pytest.approx(wanted, rel=1e-9, abs=1e-8)


def test_costs_grow_with_what_is_costed() -> None:
    for pose in drawn(1000, seed=18):
        costs = [least_cost(*pose, 1.0, back, cusp) for back, cusp in ((1.0, 0.0), (1.5, 0.0), (1.5, 1.0))]
        assert costs == sorted(costs)


@pytest.mark.parametrize("radius", [0.3, 1.0, 7.5])
def test_the_shortest_way_leads_to_its_pose_with_any_radius(radius: float) -> None:
    lengths, turns = np.empty(PIECES), np.empty(PIECES)
    for x, y, phi in drawn(1000, seed=19, most=1.0):
        cost = shortest(radius * x, radius * y, phi, radius, 2.0, radius, lengths, turns)
        assert cost == pytest.approx(radius * least_cost(x, y, phi, 1.0, 2.0, 1.0), rel=1e-9)
        end = driven(*zip(lengths.tolist(), turns.tolist(), strict=True), radius=radius)
        assert end[:2] == pytest.approx((radius * x, radius * y), abs=1e-8)
        assert sin(0.5 * (end[2] - phi)) == pytest.approx(0.0, abs=1e-9)


def test_nothing_is_driven_to_the_same_pose() -> None:
    lengths, turns = np.full(PIECES, np.nan), np.full(PIECES, np.nan)
    for branch in (-2.0 * pi, 0.0, 2.0 * pi, 20.0 * pi):
        assert shortest(0.0, 0.0, branch, 2.0, 3.0, 5.0, lengths, turns) == pytest.approx(0.0, abs=1e-12)
        assert not lengths.any()


@pytest.mark.parametrize("heading", np.linspace(-pi, pi, 17))
@pytest.mark.parametrize("length", [12.0, -12.0, 0.1, -0.1])
def test_straight_ahead_and_behind_is_one_piece(heading: float, length: float) -> None:
    lengths, turns = np.empty(PIECES), np.empty(PIECES)
    goal = (3.0 + length * cos(heading), -7.0 + length * sin(heading), heading)
    pose = seen_from((3.0, -7.0, heading), goal)
    cost = shortest(*pose, 2.0, 1.5, 10.0, lengths, turns)
    assert cost == pytest.approx(length if length > 0.0 else -1.5 * length, abs=1e-9)
    assert least_cost(*pose, 2.0, 1.5, 10.0) == pytest.approx(cost)
    assert lengths[lengths != 0.0] == pytest.approx([length])
    assert turns[lengths != 0.0].tolist() == [0.0]


@pytest.mark.parametrize("turn", [1.0, -1.0])
@pytest.mark.parametrize("angle", [1e-3, 0.5, 0.5 * pi, 2.0, pi, -1e-3, -0.5, -0.5 * pi, -2.0, -2.5])
def test_an_arc_is_one_piece(turn: float, angle: float) -> None:
    lengths, turns = np.empty(PIECES), np.empty(PIECES)
    pose = driven((2.0 * angle, turn), radius=2.0)
    cost = shortest(*pose, 2.0, 1.2, 10.0, lengths, turns)
    assert cost == pytest.approx(2.0 * angle if angle > 0.0 else -2.4 * angle, abs=1e-8)
    assert least_cost(*pose, 2.0, 1.2, 10.0) == pytest.approx(cost)
    assert lengths[lengths != 0.0] == pytest.approx([2.0 * angle])
    assert turns[lengths != 0.0].tolist() == [turn]


@pytest.mark.parametrize("off", [0.0, 1e-15, -1e-15, 1e-12, -1e-12])
def test_half_a_turn_is_one_arc_in_either_direction(off: float) -> None:
    for side in (1.0, -1.0):
        for branch in (pi, -pi):
            pose = (off, 2.0 * side, branch + off)
            assert least_cost(*pose, 1.0, 5.0, 100.0) == pytest.approx(pi)
            assert least_cost(*pose, 1.0, 0.2, 100.0) == pytest.approx(0.2 * pi)


@pytest.mark.parametrize("off", [0.0, 1e-15, -1e-15, 1e-13, -1e-13])
def test_two_arcs_that_touch_are_no_change_of_direction(off: float) -> None:
    for first, last in product((0.3, 1.0, 2.5), (0.2, 0.5 * pi, 2.0, pi)):
        x, y, phi = driven((first, 1.0), (last, -1.0))
        assert least_cost(x + off, y - off, phi + off, 1.0, 5.0, 100.0) == pytest.approx(first + last)


@pytest.mark.parametrize("off", [0.0, 1e-15, -1e-15, 1e-14, -1e-14])
def test_no_piece_is_there_by_rounding_alone(off: float) -> None:
    random = np.random.default_rng(21)
    touching = [driven((first, 1.0), (last, -1.0)) for first, last in random.uniform(-3.0, 3.0, (200, 2))]
    for x, y, phi in [*GRID, *touching]:
        lengths, _ = words_to((x + off, y - off, phi + off))
        assert not ((lengths != 0.0) & (np.abs(lengths) < 1e-6)).any()


def test_rounding_decides_about_no_word() -> None:
    random = np.random.default_rng(22)
    for first, last in random.uniform(-3.0, 3.0, (200, 2)):
        # At r = 2 and at r = 4; and an arc, which has pieces of length 0 at both ends.
        for pieces in (
            [(first, 1.0), (last, -1.0)],
            [(first, 1.0), (-pi, -1.0), (last, 1.0)],
            [(first, 1.0)],
        ):
            x, y, phi = driven(*pieces)
            offs = [(0.0, 0.0, 0.0), *random.uniform(-1e-14, 1e-14, (8, 3)).tolist()]
            assert len({len(words_to((x + a, y + b, phi + c))[0]) for a, b, c in offs}) == 1


@pytest.mark.parametrize("off", [0.0, 1e-15, -1e-15, 1e-14, -1e-14])
def test_half_a_turn_keeps_its_direction_whatever_its_rounding(off: float) -> None:
    for pieces in ([(pi, 1.0), (-0.7, -1.0), (0.4, 1.0)], [(-pi, 1.0), (0.7, -1.0), (-0.4, 1.0)]):
        x, y, phi = driven(*pieces)
        lengths, turns = words_to((x + off, y + off, phi - off))
        same = np.abs(lengths[:, :3] - [length for length, _ in pieces]).max(axis=1) < 1e-9
        assert (turns[same, :3] == [1.0, -1.0, 1.0]).all(axis=1).any()


def test_to_turn_in_place_costs_the_angle() -> None:
    # L(t) R(u) L(v), u in the other direction: all three turn to the left.
    for phi in np.linspace(-pi, pi, 41):
        assert length_to((0.0, 0.0, float(phi))) == pytest.approx(abs(phi), abs=1e-9)
    assert least_cost(0.0, 0.0, pi, 1.0, 1.0, 0.7) == pytest.approx(pi + 1.4)


def test_a_piece_is_driven_exactly() -> None:
    assert after(1.0, 2.0, 0.0, pi, 1.0, 2.0) == pytest.approx((3.0, 4.0, 0.5 * pi))
    assert after(1.0, 2.0, 0.0, pi, -1.0, 2.0) == pytest.approx((3.0, 0.0, -0.5 * pi))
    assert after(1.0, 2.0, 0.0, -pi, 1.0, 2.0) == pytest.approx((-1.0, 4.0, -0.5 * pi))
    assert after(1.0, 2.0, 0.5 * pi, -3.0, 0.0, 2.0) == pytest.approx((1.0, -1.0, 0.5 * pi))
    assert after(1.0, 2.0, 0.3, 0.0, 1.0, 2.0) == (1.0, 2.0, 0.3)
    assert after(0.0, 0.0, 0.0, 1e-9, 1.0, 2.0) == pytest.approx((1e-9, 0.25e-18, 0.5e-9), rel=1e-9, abs=0.0)


def test_a_piece_may_be_driven_in_parts_and_back() -> None:
    random = np.random.default_rng(20)
    for _ in range(500):
        x, y, phi, a, b = random.uniform(-3.0, 3.0, 5).tolist()
        turn, radius = float(random.integers(-1, 2)), float(random.uniform(0.5, 5.0))
        parts = after(*after(x, y, phi, a, turn, radius), b, turn, radius)
        assert parts == pytest.approx(after(x, y, phi, a + b, turn, radius), abs=1e-12)
        assert after(*parts, -a - b, turn, radius) == pytest.approx((x, y, phi), abs=1e-12)
