"""Dock by camera: a rear camera looks for a ChArUco board at the dock. Needs pip install '.[sim,vision]'.

The controller starts with a rough pose of the dock. The images of this example are rendered. With images of
your own, call `detector.detect(picture, stamp)` and `controller.step(..., measurements=[...])`.
"""

from __future__ import annotations

import argparse
from math import degrees
from pathlib import Path

import cv2
import numpy as np

from estimation import Camera, CharucoBoard, CharucoDetection, CharucoGoalDetector
from rti_mpcc import Pose2, prepare_process
from rti_mpcc.report.overview import overview_figure
from rti_mpcc.report.ride import ride_of_run
from rti_mpcc.simulation import CameraDetector, scenario_from_dict, simulate
from rti_mpcc.simulation.camera import BoardCamera, Image, Optics

BEND = [{"direction": -1, "curvature": k, "length": way} for k, way in ((0.08, 4.0), (-0.05, 6.0))]
SCENARIO = {
    "name": "charuco_docking",
    "path": {"start": [11.0, 1.0, 0.15], "segments": BEND},
    "corridor": {"left": 3.0, "right": -3.0},
    # The dock lies behind the path's end, with a lateral offset; the planned pose is off by 0.5 m and 6 deg.
    "goal": {"offset": [-1.0, -0.4, 0.05], "measurement": {"initial_offset": [0.4, -0.3, 0.1]}},
    "simulation": {"cycle": 0.05, "dead_time": 0.18, "duration": 60.0},
}


def main() -> None:
    parser = argparse.ArgumentParser(description="dock by the pictures of a rear camera")
    parser.add_argument("--seed", type=int, default=0, help="of background and pixel noise")
    parser.add_argument("--out", type=Path, default=Path("runs/charuco_docking"), help="for the pictures")
    options = parser.parse_args()
    detector = CharucoGoalDetector(Camera(), CharucoBoard())
    frames: list[tuple[float, Image, CharucoDetection | None]] = []
    drawn = BoardCamera(Camera(), CharucoBoard(), Optics(), np.random.default_rng(options.seed))
    eye = CameraDetector(pictures=drawn, detector=detector, seen=lambda *frame: frames.append(frame))
    prepare_process()  # no pause for garbage in the first cycles
    result = simulate(scenario_from_dict(SCENARIO), seed=options.seed, detector=eye)

    found = [frame for frame in frames if frame[2] is not None]
    error = Pose2(*result.truth.poses[-1]).relative_to(Pose2(*result.truth.goals[-1]))
    print(f"{result.ended} after {result.truth.times[-1]:.1f} s, board in {len(found)} of {len(frames)}")
    print(f"off the true dock: {error.x:.4f} m, {error.y:.4f} m, {degrees(error.phi):.2f} deg")
    options.out.mkdir(parents=True, exist_ok=True)
    for name, (_, picture, detection) in (("first", found[0]), ("last", found[-1])):
        cv2.imwrite(str(options.out / f"{name}.png"), detector.annotated(picture, detection))
    overview_figure(ride_of_run(result)).savefig(options.out / "overview.png")
    assert result.ended == "docked"
    assert max(abs(error.x), abs(error.y)) < 0.05
    assert abs(degrees(error.phi)) < 2.0


if __name__ == "__main__":
    main()
