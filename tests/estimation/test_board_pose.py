"""The goal's pose from corners: exact, with noise, with a mounting that is a little wrong, ambiguous."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest

from estimation import Camera, CharucoBoard
from estimation.board_pose import fit_board, slopes_of_corners
from estimation.camera import turn
from estimation.types import Array
from geometry import wrap

CAMERA, BOARD = Camera(), CharucoBoard()
GRID = [np.array([x, y, phi]) for x in (0.0, -3.0, -9.0) for y in (-0.4, 0.5) for phi in (-0.3, 0.0, 0.2)]


def corners(board: CharucoBoard = BOARD) -> Array:
    columns, rows = np.meshgrid(np.arange(1, board.columns), np.arange(1, board.rows))
    return board.in_goal_frame(np.column_stack([columns.ravel(), rows.ravel()]) * board.square)


def pixels(goal: Array, camera: Camera = CAMERA, board: CharucoBoard = BOARD) -> Array:
    return camera.project(corners(board) @ turn(goal[2]).T + (goal[0], goal[1], 0.0))


def error(found: Array, goal: Array) -> Array:
    off = found - goal
    off[2] = wrap(off[2])
    return off


@pytest.mark.parametrize("goal", GRID, ids=str)
def test_exact_pixels_give_the_exact_pose(goal: Array) -> None:
    pose = fit_board(CAMERA, corners(), pixels(goal), [goal + np.array([0.3, -0.2, 0.1])])
    assert pose is not None
    assert pose.value == pytest.approx(goal, abs=1e-6)
    assert np.linalg.eigvalsh(pose.covariance)[0] > 0.0


@pytest.mark.parametrize("yaw", [pi, 0.0, 2.0])
def test_slopes_are_those_of_central_differences(yaw: float) -> None:
    camera = CAMERA.model_copy(update={"yaw": yaw, "pitch": 0.1, "roll": -0.05})
    # The board 4 m before the lens, whichever way that looks
    ahead = camera.position + 4.0 * camera.rotation[:, 2]
    unknown = np.array([ahead[0] - BOARD.x, ahead[1] - BOARD.y, 0.2, 0.02, 0.01, -0.02])
    found = slopes_of_corners(camera, corners(), unknown)
    assert found is not None
    for column in range(6):
        step = np.zeros(6)
        step[column] = 1e-6
        above = slopes_of_corners(camera, corners(), unknown + step)
        below = slopes_of_corners(camera, corners(), unknown - step)
        assert above is not None
        assert below is not None
        difference = (above[0] - below[0]).ravel() / 2e-6
        assert found[1][:, column] == pytest.approx(difference, rel=1e-5, abs=1e-3)


def test_a_mounting_taken_for_exact_pulls_the_pose_away() -> None:
    # Why height and tilt are not taken as known: 0.3 deg of pitch move the goal by far more than noise.
    strict = CAMERA.model_copy(update={"height_std": 1e-6, "tilt_std": 1e-6})
    goal = np.array([0.0, 0.1, 0.05])
    seen = pixels(goal, CAMERA.model_copy(update={"pitch": 0.005}))
    tied, rigid = (fit_board(camera, corners(), seen, [goal]) for camera in (CAMERA, strict))
    assert tied is not None
    assert rigid is not None
    assert np.abs(error(tied.value, goal)[:2]).max() < 0.005
    assert np.abs(error(rigid.value, goal)[:2]).max() > 0.02


def test_the_lower_of_two_minima_is_taken() -> None:
    goal = np.array([-3.0, 0.2, 0.3])
    # Mirrored about the line of sight to the board, and moved so that the board stays where it is
    mirrored = np.array([*(goal[:2] + (turn(0.3) - turn(-0.35))[:2, 0] * BOARD.x), -0.35])
    for starts in ([goal, mirrored], [mirrored, goal]):
        pose = fit_board(CAMERA, corners(), pixels(goal), starts)
        assert pose is not None
        assert pose.value == pytest.approx(goal, abs=1e-4)


def test_what_cannot_be_told_apart_widens_the_covariance() -> None:
    # 0.5 px at 20 m: left or right of frontal is a guess, and the heading's deviation has to say so.
    random, squares, widths = np.random.default_rng(5), [], []
    for _ in range(60):
        goal = np.array([-20.0, 0.0, 0.25])
        other = np.array([*(goal[:2] + (turn(0.25) - turn(-0.25))[:2, 0] * BOARD.x), -0.25])
        seen = pixels(goal) + 0.5 * random.standard_normal((12, 2))
        pose = fit_board(CAMERA, corners(), seen, [goal, other])
        assert pose is not None
        squares.append(error(pose.value, goal)[2] ** 2)
        widths.append(pose.covariance[2, 2])
    assert np.mean(squares) < 1.5 * np.mean(widths)


def test_a_start_behind_the_lens_leads_nowhere() -> None:
    assert fit_board(CAMERA, corners(), pixels(GRID[0]), [np.array([5.0, 0.0, 0.0])]) is None
    assert fit_board(CAMERA, corners(), pixels(GRID[0]), []) is None
