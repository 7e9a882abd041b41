"""Drives: where they lead, backwards and mirrored, and how far they are clear."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
import shapely

from benchmarks.problems.witness import LEAST, SPACING, Drive, Ground, Piece
from geometry import Pose2
from rti_mpcc.config import Vehicle

PIECES = (Piece(1, 0.2, 4.0), Piece(1, 0.0, 2.0), Piece(-1, -0.25, 3.0), Piece(1, 0.1, 1.0))
VEHICLE = Vehicle()
WALL = np.array([(10.0, -20.0), (11.0, -20.0), (11.0, 20.0), (10.0, 20.0)])


def numbers(pose: Pose2) -> list[float]:
    return [pose.x, pose.y, pose.phi]


@pytest.fixture
def drive() -> Drive:
    return Drive.at(Pose2(3.0, -2.0, 2.5), PIECES)


@pytest.fixture
def ground() -> Ground:
    return Ground.of(VEHICLE, 0.2, 0.15, [WALL])


def test_a_drive_leads_where_a_path_of_its_pieces_does(drive: Drive) -> None:
    assert numbers(drive.end) == pytest.approx(numbers(drive.path.end), abs=1e-12)
    assert drive.length == pytest.approx(10.0)
    assert drive.cusps == 2


def test_poses_are_those_of_the_path(drive: Drive) -> None:
    poses = drive.poses(0.1)
    assert poses[0] == pytest.approx(numbers(drive.begin))
    assert poses[-1] == pytest.approx(numbers(drive.end), abs=1e-12)
    assert np.linalg.norm(np.diff(poses[:, :2], axis=0), axis=1).max() <= 0.1 + 1e-9
    part = drive.path.parts[1]
    assert poses[60 : 60 + 31, 0] == pytest.approx(part.reference(np.linspace(6.0, 9.0, 31)).x)


def test_backwards_it_is_the_same_way(drive: Drive) -> None:
    back = drive.back()
    assert numbers(back.end) == pytest.approx(numbers(drive.begin), abs=1e-12)
    assert back.poses(0.1)[::-1] == pytest.approx(drive.poses(0.1), abs=1e-9)
    assert back.back().pieces == drive.pieces


def test_mirrored_left_is_right(drive: Drive) -> None:
    mirrored = drive.mirrored()
    assert mirrored.poses(0.1) == pytest.approx(drive.poses(0.1) * [1.0, -1.0, -1.0], abs=1e-9)


def test_pieces_of_no_length_are_left_out(drive: Drive) -> None:
    assert drive.on(1, 0.1, 0.0) is drive


def test_the_swept_area_holds_all_bodies(drive: Drive) -> None:
    swept = drive.swept(VEHICLE)
    alone = Drive.at(Pose2(0.0, 0.0, 0.0)).swept(VEHICLE)
    assert alone.area == pytest.approx(VEHICLE.width * (VEHICLE.front + VEHICLE.rear))
    corners = drive.poses(0.01)
    assert shapely.contains(swept, shapely.points(corners[:, :2])).all()


def test_a_piece_is_clear_as_far_as_the_body_keeps_its_distance(ground: Ground) -> None:
    start = Pose2(0.0, 0.0, 0.0)
    clear = 10.0 - VEHICLE.front - 0.15
    assert ground.free_length(start, 1, 0.0, 20.0) == pytest.approx(clear, abs=SPACING)
    assert ground.free_length(start, 1, 0.0, 20.0) <= clear
    assert ground.free_length(start, -1, 0.0, 20.0) == 20.0
    assert ground.free_length(start, 1, 0.0, 2.0) == 2.0
    assert ground.free(start)
    assert not ground.free(Pose2(9.0, 0.0, 0.0))
    assert ground.free_length(Pose2(9.0, 0.0, 0.0), -1, 0.0, 20.0) == 0.0


def test_the_lines_of_a_boundary_stand(ground: Ground) -> None:
    within = Ground.of(VEHICLE, 0.2, 0.15, [], WALL - np.array([15.0, 0.0]) * [1.0, 0.0])
    assert within.free_length(Pose2(0.0, 0.0, pi), 1, 0.0, 20.0) < 1.0
    drive = Drive.at(Pose2(0.0, 0.0, 0.0))
    assert ground.driven(drive, 1, 0.0, 8.0) is None
    assert ground.driven(drive, 1, 0.0, 4.0) == drive.on(1, 0.0, 4.0)


def test_turns_end_at_their_heading_and_alternate_where_something_is_in_the_way(ground: Ground) -> None:
    free = ground.turned(Drive.at(Pose2(-20.0, 0.0, 0.0)), pi, 1, moves=1)
    assert free is not None
    assert free.end.phi == pytest.approx(pi)
    turned = ground.turned(Drive.at(Pose2(4.0, 0.0, 0.0)), -pi, 1, moves=20)
    assert turned is not None
    assert turned.end.phi == pytest.approx(-pi)
    assert [piece.direction for piece in turned.pieces[:3]] == [1, -1, 1][: len(turned.pieces[:3])]
    assert all(piece.length >= LEAST for piece in turned.pieces)
    assert ground.turned(Drive.at(Pose2(4.0, 0.0, 0.0)), -pi, 1, moves=1) is None


def test_a_place_without_any_room_is_not_turned_in() -> None:
    tight = Ground.of(VEHICLE, 0.2, 0.15, [], np.array([(-1.1, -1.3), (4.0, -1.3), (4.0, 1.3), (-1.1, 1.3)]))
    assert tight.turned(Drive.at(Pose2(0.0, 0.0, 0.0)), pi, 1, moves=50) is None


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("lateral", [0.0, 0.5, -2.0, 7.0, -12.0])
def test_shifts_end_beside_where_they_began(ground: Ground, lateral: float, direction: int) -> None:
    shifted = ground.shifted(Drive.at(Pose2(-60.0, 0.0, 0.0)), lateral, direction)
    assert shifted is not None
    assert shifted.end.y == pytest.approx(lateral)
    assert shifted.end.phi == pytest.approx(0.0, abs=1e-12)
    assert all(piece.direction == direction for piece in shifted.pieces)


def test_wandering_never_comes_too_near(ground: Ground) -> None:
    random = np.random.default_rng(3)
    for _ in range(50):
        drive = ground.wandered(random, Drive.at(Pose2(0.0, 0.0, 0.0)), 1, 30.0)
        assert all(ground.free(Pose2(*pose)) for pose in drive.poses(0.5).tolist())
        assert drive.length <= 30.0
