from __future__ import annotations

import numpy as np
import pytest

from geometry import Corridor, HalfPlanes, Pose2, ReferencePath
from rti_mpcc.config import Vehicle
from rti_mpcc.model.footprint import cover, disc_centres
from rti_mpcc.ocp.corridor_rows import corridor_rows
from rti_mpcc.types import Array
from tests.rti_mpcc.differences import slopes

DISCS = cover(Vehicle(), 5)
MARGIN = 0.1


@pytest.fixture
def corridor() -> Corridor:
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.4), [(1, 0.1, 15.0), (1, -0.1, 15.0)])
    block = np.array([[4.0, 4.0], [5.0, 4.0], [5.0, 5.0]])
    return Corridor.from_offsets(path, left=3.0, right=-3.0, obstacles=[block])


@pytest.fixture
def states() -> Array:
    random = np.random.default_rng(8)
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.4), [(1, 0.1, 15.0), (1, -0.1, 15.0)])
    reference = path.parts[0].reference(np.linspace(1.0, 25.0, 12))
    out = np.zeros((12, 6))
    out[:, :3] = np.column_stack([reference.x, reference.y, reference.phi]) + random.uniform(
        -0.3, 0.3, (12, 3)
    )
    return out


def planes_of(corridor: Corridor, states: Array) -> HalfPlanes:
    return corridor.half_planes(0, disc_centres(states, DISCS).reshape(-1, 2))


def gap(state: Array, planes: HalfPlanes, k: int) -> Array:
    """n · (c - b) - radius - margin, Eq. (H1), of all discs and sides of stage k with its planes held."""
    c = disc_centres(state[None], DISCS)[0]
    chosen = slice(k * 5, k * 5 + 5)
    to = c[:, None, :] - planes.point[chosen]
    return np.asarray((planes.normal[chosen] * to).sum(axis=-1) - DISCS.radius - MARGIN)


def test_rows_are_the_half_planes_and_their_slopes(corridor: Corridor, states: Array) -> None:
    planes = planes_of(corridor, states)
    rows = corridor_rows(states, planes, DISCS, MARGIN, near=1e3)
    assert rows.slopes.shape == (12, 5, 3, 3)
    for k, state in enumerate(states):
        np.testing.assert_allclose(-rows.lower[k], gap(state, planes, k), atol=1e-9)

        def held(pose: Array, k: int = k) -> Array:
            return gap(np.append(pose, np.zeros(3)), planes, k)

        np.testing.assert_allclose(rows.slopes[k], slopes(held, state[:3]), atol=1e-7)


def test_a_move_that_a_row_allows_is_allowed_by_the_half_plane_to_second_order(
    corridor: Corridor, states: Array
) -> None:
    planes = planes_of(corridor, states)
    rows = corridor_rows(states, planes, DISCS, MARGIN, near=1e3)
    for size, most in ((0.1, 0.03), (0.01, 0.0003)):
        move = size * np.array([0.5, -0.3, 1.0])
        for k, state in enumerate(states):
            linear = rows.slopes[k] @ move - rows.lower[k]
            moved = state.copy()
            moved[:3] += move
            assert np.abs(gap(moved, planes, k) - linear).max() < most


def test_far_and_missing_boundaries_do_not_act(corridor: Corridor, states: Array) -> None:
    planes = planes_of(corridor, states)
    rows = corridor_rows(states, planes, DISCS, MARGIN, near=0.5)
    far = planes.distance.reshape(12, 5, 3) > DISCS.radius + MARGIN + 0.5
    assert far.any()
    assert not far.all()
    np.testing.assert_array_equal(rows.slopes.any(axis=-1), ~far)
    assert (rows.lower[far] < -10.0).all()
    assert np.isfinite(rows.lower).all()
    none = HalfPlanes(
        point=np.zeros((60, 2, 2)),
        normal=np.zeros((60, 2, 2)),
        distance=np.full((60, 2), np.inf),
        feature=np.full((60, 2), -1),
        sample=np.full((60, 2), -1),
    )
    empty = corridor_rows(states, none, DISCS, MARGIN, near=1e3)
    assert not empty.slopes.any()
    assert np.isfinite(empty.lower).all()
