from __future__ import annotations

import numpy as np
import pytest

from geometry import Corridor, Pose2, ReferencePath
from rti_mpcc.config import Vehicle
from rti_mpcc.model.bicycle import rollout
from rti_mpcc.model.footprint import body_of
from rti_mpcc.model.layout import CONTROLS, DELTA, PHI, POSE, V
from rti_mpcc.ocp.corridor_rows import (
    BOUNDARY_DISTANCE,
    MARGIN_DISTANCE,
    MARGIN_TIME,
    MEASURED,
    STRIP,
    THIN,
    CorridorRows,
    Deficit,
    Trailing,
    corridor_rows,
    free_response,
    margin_deficit,
    relaxed_bounds,
)
from rti_mpcc.types import Array
from tests.geometry.sides import Contacts, contacts_of
from tests.rti_mpcc.differences import slopes
from tests.rti_mpcc.frozen import FrozenPlanes

PIECES = 5
BODY = body_of(Vehicle(), PIECES)
RETURN_TIME, RETURN_WAY, WAY_BACK = MARGIN_TIME, MARGIN_DISTANCE, BOUNDARY_DISTANCE
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


def contacts_at(corridor: Corridor, states: Array, near: float = 1e3) -> Contacts:
    return contacts_of(corridor, 0, BODY, states[:, :POSE], MARGIN + near)


def rows_about(states: Array, contacts: Contacts, near: float = 1e3) -> CorridorRows:
    rows = corridor_rows(states[:, PHI].copy(), contacts.values, MARGIN, near=near)
    assert rows is not None
    return rows


def gap(states: Array, about: Array, contacts: Contacts) -> Array:
    """d - margin, Eq. (H1), of all pieces and sides at `states` with the half-planes and points held."""
    return FrozenPlanes.of(contacts, about).at(states).apart - MARGIN


def test_rows_are_the_half_planes_and_their_slopes(corridor: Corridor, states: Array) -> None:
    contacts = contacts_at(corridor, states)
    rows = rows_about(states, contacts)
    assert rows.slopes.shape == (12, PIECES, 3, 3)
    np.testing.assert_allclose(-rows.lower, contacts.apart - MARGIN, atol=1e-12)
    for column in range(POSE):
        step = 1e-6 * np.eye(6)[column]
        ahead, behind = (gap(states + h, states, contacts) for h in (step, -step))
        np.testing.assert_allclose(rows.slopes[..., column], (ahead - behind) / 2e-6, atol=1e-7)


@pytest.mark.parametrize("turned", [0.0, np.pi / 2, np.pi, -np.pi / 2])
def test_the_margin_is_the_same_all_round_the_body(turned: float) -> None:
    vehicle, wall = Vehicle(), 9.0
    leading = {0.0: vehicle.front, np.pi: vehicle.rear}.get(turned, 0.5 * vehicle.width)
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 5.0)])
    block = [(wall, -9.0), (wall + 1.0, -9.0), (wall + 1.0, 9.0), (wall, 9.0)]
    corridor = Corridor.from_offsets(path, left=90.0, right=-90.0, obstacles=[block])
    for room, lacks in ((MARGIN + 1e-6, False), (MARGIN - 1e-6, True)):
        states = np.array([[wall - leading - room, 0.0, turned, 0.0, 0.0, 0.0]])
        assert (rows_about(states, contacts_at(corridor, states)).lower.max() > 0.0) == lacks


def test_far_and_missing_boundaries_do_not_act(corridor: Corridor, states: Array) -> None:
    rows = rows_about(states, contacts_at(corridor, states), near=0.5)
    far = contacts_at(corridor, states).apart > MARGIN + 0.5
    assert far.any()
    assert not far.all()
    np.testing.assert_array_equal(rows.slopes.any(axis=-1), ~far)
    assert (rows.lower[far] < -10.0).all()
    assert np.isfinite(rows.lower).all()
    away = states + 1e4 * np.eye(6)[0]
    none = contacts_at(corridor, away, near=0.5)
    assert corridor_rows(away[:, PHI].copy(), none.values, MARGIN, near=0.5) is None


def test_between_walls_that_face_each_other_the_margin_is_what_they_leave() -> None:
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 30.0)])
    half = 0.5 * Vehicle().width
    for room, kept in ((0.5, MARGIN), (0.11, 0.11 - STRIP), (0.06, 0.05), (0.055, 0.055 - THIN)):
        corridor = Corridor.from_offsets(path, left=half + room, right=-half - room)
        states = np.array([[10.0, 0.02, 0.0, 0.0, 0.0, 0.0]])
        contacts = contacts_at(corridor, states)
        rows = corridor_rows(np.zeros(1), contacts.values, MARGIN, 0.05)
        assert rows is not None
        np.testing.assert_allclose((rows.lower + contacts.apart)[..., :2], kept, atol=1e-12)


def test_between_walls_that_do_not_face_each_other_the_margin_is_kept() -> None:
    """A wall beside the body and one ahead of it, both nearer than the margin."""
    vehicle, near = Vehicle(), 0.06
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 30.0)])
    ahead = 10.0 + vehicle.front + near
    block = [(ahead, -9.0), (ahead + 1.0, -9.0), (ahead + 1.0, 1.0), (ahead, 1.0)]
    corridor = Corridor.from_offsets(path, left=0.5 * vehicle.width + near, right=-90.0, obstacles=[block])
    states = np.array([[10.0, 0.0, 0.0, 0.0, 0.0, 0.0]])
    contacts = contacts_at(corridor, states)
    rows = corridor_rows(np.zeros(1), contacts.values, MARGIN, 0.05)
    assert rows is not None
    for piece, side in ((0, 0), (PIECES - 1, 2)):
        assert contacts.apart[0, piece, side] == pytest.approx(near)
        assert rows.lower[0, piece, side] == pytest.approx(MARGIN - near)


STAYS = np.tile(np.eye(POSE, MEASURED), (12, 1, 1))
"""A plan that goes on beside the one linearised about as it begins there."""


NOISE = 0.02
"""What may seem to be missing [m]."""


def relieved(
    rows: CorridorRows,
    change: Array,
    elapsed: Array,
    margin: float,
    travelled: float = 0.0,
    trails: Array | None = None,
    most: float | None = None,
) -> Array:
    """`relaxed_bounds` with what the vehicle lacks itself, all stages `travelled` [m] along."""
    missing = margin_deficit(rows, STAYS, np.append(change, [0.0, 0.0]))
    if not missing.any():
        return rows.lower
    over = np.maximum(missing[0].max(axis=0) - margin, 0.0)
    deficit = Deficit(margin, missing, np.full_like(over, margin if most is None else most), over)
    trailing = Trailing(np.zeros(5) if trails is None else trails, 0.0)
    way = np.full(len(elapsed), travelled)
    return relaxed_bounds(rows.lower, deficit, elapsed, way, trailing, NOISE)


def test_missing_margin_is_given_back_along_the_plan_and_no_more_than_the_margin(
    corridor: Corridor, states: Array
) -> None:
    rows = rows_about(states, contacts_at(corridor, states))
    elapsed = np.full(len(states), 1e-9)
    aside = -0.05 * rows.slopes[4, 2, 0]  # straight into the half-plane of one piece
    short = CorridorRows(rows.slopes, rows.lower - rows.lower[4, 2, 0])
    missing = -float(rows.slopes[4, 2, 0] @ aside)
    at_once = relieved(short, aside, elapsed, margin=1.0)[4, 2, 0]
    assert at_once == pytest.approx(-missing, rel=1e-6)
    half_time, late = (np.full(len(states), share * RETURN_TIME) for share in (0.5, 1.0))
    half_way = relieved(short, aside, half_time, 1.0, RETURN_WAY)[4, 2, 0]
    assert half_way == pytest.approx((0.5**3 - 1.0) * missing, rel=1e-6)
    after = relieved(short, aside, late, 1.0, RETURN_WAY)
    np.testing.assert_array_equal(after, short.lower)
    # A slow vehicle does not get it back by waiting.
    slow = relieved(short, aside, late, 1.0, 0.5 * RETURN_WAY)[4, 2, 0]
    assert slow == pytest.approx((0.5**3 - 1.0) * missing, rel=1e-6)
    inside = rows.lower.copy()
    inside[4, 2, 0] = 0.0
    little = relieved(CorridorRows(rows.slopes, inside - 9.0), aside, elapsed, margin=0.3 * missing)
    np.testing.assert_array_equal(little, inside - 9.0)
    inside[0] -= 9.0  # nothing is missing where the vehicle is
    little = relieved(CorridorRows(rows.slopes, inside), aside, elapsed, margin=0.3 * missing)
    assert little[4, 2, 0] == pytest.approx(-0.3 * missing, rel=1e-6)


def test_a_boundary_that_the_vehicle_is_over_comes_back_along_the_way(
    corridor: Corridor, states: Array
) -> None:
    rows = rows_about(states, contacts_at(corridor, states))
    lower = np.full_like(rows.lower, -9.0)
    lower[0, 1, 0], lower[6, 2, 1], lower[7, 0, 0] = 0.5, 0.3, 0.9
    short = CorridorRows(np.zeros_like(rows.slopes), lower)
    late = np.full(len(states), 2.0 * RETURN_TIME)
    for travelled, left in ((0.5 * WAY_BACK, 0.5), (WAY_BACK, 0.0), (2.0 * WAY_BACK, 0.0)):
        bounds = relieved(short, np.zeros(3), late, 0.1, travelled)
        # The vehicle lacks 0.5 m of the left boundary, which is relieved by no more than that at any stage.
        np.testing.assert_allclose(bounds[..., 0], lower[..., 0] - left * 0.5, atol=1e-12)
        # The others stay.
        np.testing.assert_array_equal(bounds[..., 1:], lower[..., 1:])
    at_once = relieved(short, np.zeros(3), np.full(len(states), 1e-9), 0.1)
    assert at_once[0, 1, 0] == pytest.approx(0.0, abs=1e-6)
    assert (at_once[..., 0] >= lower[..., 0] - 0.5 - 1e-12).all()
    assert at_once[6, 2, 1] == pytest.approx(0.2, abs=1e-6)


@pytest.mark.parametrize("steering", [0.0, 0.3])
@pytest.mark.parametrize("speed", [1.5, -1.5])
def test_a_plan_begun_beside_another_drifts_as_the_vehicle_does(speed: float, steering: float) -> None:
    """Against differences of the model: exact on a straight, on a bend but for what it turns meanwhile."""
    lengths = np.append(0.05, np.full(29, 0.1))
    begin = np.array([0.3, -0.2, 0.7, speed, steering, 0.0])
    controls = np.zeros((len(lengths), CONTROLS))
    by = free_response(rollout(begin, controls, lengths, 2.9), lengths, 2.9)
    assert np.cumsum(lengths)[len(by) - 1] < RETURN_TIME <= np.cumsum(lengths)[len(by)]

    def poses(measured: Array) -> Array:
        states = rollout(np.append(measured, 0.0), controls, lengths, 2.9)
        return states[1 : len(by) + 1, :POSE].ravel()

    wanted = slopes(poses, begin[:MEASURED]).reshape(len(by), POSE, MEASURED)
    for column in range(MEASURED):
        off = 0.25 if steering and column in (PHI, V, DELTA) else 1e-6
        largest = np.abs(wanted[..., column]).max()
        np.testing.assert_allclose(by[..., column], wanted[..., column], atol=off * largest)


def test_what_trails_may_swing_out_until_it_is_back(corridor: Corridor, states: Array) -> None:
    rows = rows_about(states, contacts_at(corridor, states))
    lower = np.full_like(rows.lower, -9.0)
    lower[0, 0, 1] = 0.02  # the leading piece lacks that
    short = CorridorRows(np.zeros_like(rows.slopes), lower)
    trails = np.array([0.0, 0.0, 0.5, 1.5, 3.0])
    late = np.full(len(states), 2.0 * RETURN_TIME)
    for travelled in (0.0, 1.0, RETURN_WAY, 2.0 * RETURN_WAY, RETURN_WAY + 6.0):
        relief = lower - relieved(short, np.zeros(3), late, 0.1, travelled, trails)
        wanted = 1.5 / RETURN_WAY * trails * 0.02 * (1.0 - (travelled / (RETURN_WAY + 2.0 * trails)) ** 3)
        np.testing.assert_allclose(relief[5, :, 1], np.maximum(wanted, 0.0), atol=1e-12)
        np.testing.assert_array_equal(relief[..., [0, 2]], 0.0)
    much = lower - relieved(short, np.zeros(3), late, 0.1, 0.0, 100.0 * trails)
    assert much.max() == pytest.approx(0.1)  # the margin, no more
    lower[0, :, 1] = [-9.0, -9.0, -9.0, -9.0, 0.02]  # the last one lacks it: nothing trails that
    np.testing.assert_array_equal(relieved(short, np.zeros(3), late, 0.1, RETURN_WAY, trails), lower)
