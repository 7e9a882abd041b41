"""Reeds-Shepp words: where they lead, that none is missing, and their lengths beside OMPL's."""

from __future__ import annotations

from itertools import product
from math import pi
from typing import Any

import numpy as np
import pytest

from geometry import reeds_shepp
from geometry.arrays import Array
from geometry.reeds_shepp import PIECES, WORDS
from tests.kernels import called
from tests.lists import some_of

words, least_cost = called(reeds_shepp.words), called(reeds_shepp.least_cost)
Pose = tuple[float, float, float]
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


def driven(*pieces: tuple[float, float]) -> Pose:
    x, y, phi = ends(*np.array(pieces).T[:, None])[0].tolist()
    return x, y, phi


def check_words(pose: Pose) -> None:
    lengths, turns = words_to(pose)
    assert set(np.unique(turns)) <= {-1.0, 0.0, 1.0}
    apart = ends(lengths, turns) - pose
    apart[:, 2] = 2.0 * np.sin(0.5 * apart[:, 2])
    np.testing.assert_allclose(apart, 0.0, atol=1e-9)


@pytest.mark.parametrize("seed", some_of(range(4), 4))
def test_every_word_leads_to_its_pose(seed: int) -> None:
    random = np.random.default_rng(5)
    for pose in [*drawn(1500, seed), *(GRID if seed == 0 else [])]:
        check_words(pose)
        off = random.choice([1e-15, 1e-13, 1e-11, 1e-9, 1e-6]) * random.uniform(-1.0, 1.0, 3)
        check_words((pose[0] + float(off[0]), pose[1] + float(off[1]), pose[2] + float(off[2])))


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


@pytest.mark.parametrize(
    ("back", "cusp"), some_of([(1.0, 1.5), (1.0, 0.0), (2.0, 0.0), (3.0, 4.0), (0.5, 0.1)], 3)
)
def test_the_least_cost_is_that_of_the_cheapest_word(back: float, cusp: float) -> None:
    for pose in [*drawn(1000, seed=17), *GRID]:
        radius = 4.0
        lengths, _ = words_to(pose)
        wanted = min(cost_of(radius * each, back, cusp) for each in lengths)
        x, y, phi = radius * pose[0], radius * pose[1], pose[2]
        assert least_cost(x, y, phi, radius, back, cusp) == pytest.approx(wanted, rel=1e-9, abs=1e-8)
