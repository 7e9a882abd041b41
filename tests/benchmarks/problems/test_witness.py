"""Drives: where they lead, backwards and mirrored, and how far they are clear."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.problems.witness import SPACING, Drive, Ground, Piece
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


def test_backwards_it_is_the_same_way(drive: Drive) -> None:
    back = drive.back()
    assert numbers(back.end) == pytest.approx(numbers(drive.begin), abs=1e-12)
    assert back.poses(0.1)[::-1] == pytest.approx(drive.poses(0.1), abs=1e-9)
    assert back.back().pieces == drive.pieces


def test_mirrored_left_is_right(drive: Drive) -> None:
    mirrored = drive.mirrored()
    assert mirrored.poses(0.1) == pytest.approx(drive.poses(0.1) * [1.0, -1.0, -1.0], abs=1e-9)


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


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("lateral", [0.0, 0.5, -2.0, 7.0, -12.0])
def test_shifts_end_beside_where_they_began(ground: Ground, lateral: float, direction: int) -> None:
    shifted = ground.shifted(Drive.at(Pose2(-60.0, 0.0, 0.0)), lateral, direction)
    assert shifted is not None
    assert shifted.end.y == pytest.approx(lateral)
    assert shifted.end.phi == pytest.approx(0.0, abs=1e-12)
    assert all(piece.direction == direction for piece in shifted.pieces)
