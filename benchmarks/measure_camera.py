"""Accuracy of the goal's pose from a rendered ChArUco board: four estimators on the same corners.

    OMP_NUM_THREADS=1 python -m benchmarks.measure_camera [--exact]

The camera's mounting is off by chance, as its tolerances say (--exact: not at all), and the light changes.
"""

from __future__ import annotations

from math import degrees

import cv2
import numpy as np

from benchmarks.tables import command_line
from estimation import Camera, CharucoBoard, CharucoDetection, CharucoGoalDetector
from estimation.camera import turn
from estimation.charuco import opencv_board
from geometry import Pose2, wrap
from rti_mpcc.simulation.camera import BoardCamera, Image, Optics
from rti_mpcc.types import Array

RANGES = (0.0, 1.0, 2.0, 4.0, 6.0, 8.0, 10.0)
CAMERA, BOARD = Camera(), CharucoBoard()
BELIEVED = {
    "tied": CAMERA,
    "rigid": CAMERA.changed(height_std=1e-6, tilt_std=1e-6),
    "free": CAMERA.changed(height_std=1.0, tilt_std=1.0),
}
"""Height, roll and pitch tied by their tolerances, taken for known, and not known at all."""
Rows = dict[str, list[Array]]


def solve_pnp(detection: CharucoDetection) -> Array:
    """(3,) x, y, phi by OpenCV alone: IPPE's better solution, refined in six degrees of freedom."""
    flat, pixels = opencv_board(BOARD).matchImagePoints(
        detection.corners.astype(np.float32)[:, None], detection.ids
    )
    _, turns, ways, _ = cv2.solvePnPGeneric(flat, pixels, CAMERA.matrix, None, flags=cv2.SOLVEPNP_IPPE)
    turned, way = cv2.solvePnPRefineLM(flat, pixels, CAMERA.matrix, None, turns[0].copy(), ways[0].copy())
    rotation = cv2.Rodrigues(turned)[0]
    middle = rotation @ (*(0.5 * np.array(BOARD.size)), 0.0) + way.ravel()
    normal = -CAMERA.rotation @ rotation[:, 2]
    phi = float(np.arctan2(normal[1], normal[0])) - BOARD.yaw
    at = CAMERA.rotation @ middle + CAMERA.position - turn(phi) @ BOARD.middle
    return np.array([at[0], at[1], phi])


def take(
    pictures: BoardCamera, distance: float, exact: bool, random: np.random.Generator
) -> tuple[Image, Pose2]:
    """A picture from about `distance` [m] before the dock, and the true goal in the vehicle frame."""
    off = random.standard_normal(3) * (CAMERA.height_std, CAMERA.tilt_std, CAMERA.tilt_std)
    height, pitch, roll = (0.0 if exact else 1.0) * off
    pictures.camera = CAMERA.changed(z=CAMERA.z + height, pitch=pitch, roll=roll)
    blur, noise, exposure = random.uniform([0.5, 2.0, 0.6], [1.2, 6.0, 1.1]).tolist()
    pictures.optics = Optics(blur=blur, noise=noise, exposure=exposure)
    aside = min(0.5 + 0.15 * distance, 1.0)
    vehicle = Pose2(distance, *random.uniform([-aside, -0.25], [aside, 0.25]).tolist())
    dock = Pose2(0.0, 0.0, 0.0)
    return pictures.expose(vehicle, dock), dock.relative_to(vehicle)


def print_rows(distance: float, pictures: int, errors: Rows, nees: dict[str, list[float]]) -> None:
    for name, rows in errors.items():
        if len(rows) < 10:
            continue
        mean, std = np.mean(rows, axis=0), np.std(rows, axis=0)
        print(
            f"| {distance:g} | {100 * len(rows) // pictures} % | {name} "
            f"| {1e3 * mean[0]:.1f}, {1e3 * mean[1]:.1f}, {degrees(mean[2]):.2f} "
            f"| {1e3 * std[0]:.1f}, {1e3 * std[1]:.1f}, {degrees(std[2]):.2f} "
            f"| {f'{np.mean(nees[name]):.1f}' if name in nees else '-'} |"
        )


def main() -> None:
    parser = command_line(__doc__, "python -m benchmarks.measure_camera")
    parser.add_argument("--pictures", type=int, default=200, help="at each range")
    parser.add_argument("--exact", action="store_true", help="the mounting is as it is believed to be")
    options = parser.parse_args()
    random = np.random.default_rng(1)
    detectors = {name: CharucoGoalDetector(camera, BOARD) for name, camera in BELIEVED.items()}
    pictures = BoardCamera(CAMERA, BOARD, Optics(), random)
    print("| range [m] | found | way | bias x, y [mm], phi [deg] | spread x, y [mm], phi [deg] | mean NEES |")
    print("|---|---|---|---|---|---|")
    for distance in RANGES:
        errors: Rows = {name: [] for name in (*detectors, "solvePnP")}
        nees: dict[str, list[float]] = {name: [] for name in detectors}
        for _ in range(options.pictures):
            picture, true = take(pictures, distance, options.exact, random)
            for name, detector in detectors.items():
                found = detector.detect(picture, 0.0)
                if found is None:
                    continue
                m = found.measurement
                error = np.array([m.x - true.x, m.y - true.y, wrap(m.phi - true.phi)])
                errors[name].append(error)
                nees[name].append(float(error @ np.linalg.solve(np.asarray(m.covariance), error)))
                if name == "tied":
                    errors["solvePnP"].append(solve_pnp(found) - (true.x, true.y, true.phi))
        print_rows(distance, options.pictures, errors, nees)


if __name__ == "__main__":
    main()
