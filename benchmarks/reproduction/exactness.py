"""How exactly a run comes to the cusp and to the end of a route, and how smoothly it gets there."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks.reproduction.published import Track
from geometry import Pose2, ReferencePath, wrap
from rti_mpcc.simulation import RunResult
from rti_mpcc.types import Array


class PoseError(NamedTuple):
    """Error in the frame of the pose that was to be reached [m], [m], [rad]."""

    longitudinal: float
    lateral: float
    heading: float


class Smoothness(NamedTuple):
    """Root mean squares in time [rad/s], [m/s²]."""

    steering_rate: float
    lateral_acceleration: float


def error_at(pose: Array, wanted: Pose2) -> PoseError:
    """Of a pose (3,) to the wanted one."""
    error = Pose2(*pose.tolist()).relative_to(wanted)
    return PoseError(error.x, error.y, wrap(error.phi))


def nearest_error(poses: Array, wanted: Pose2) -> PoseError:
    """Of the pose (n, 3) that comes nearest to the wanted one."""
    far = np.hypot(poses[:, 0] - wanted.x, poses[:, 1] - wanted.y)
    return error_at(poses[int(np.argmin(far))], wanted)


def end_error(result: RunResult) -> PoseError | None:
    """At the end of the run; None where it did not come to the last part."""
    if result.truth.part[-1] < len(result.path.parts) - 1:
        return None
    return error_at(result.truth.poses[-1], result.path.end)


def smoothness(result: RunResult, part: int, apart: float) -> Smoothness | None:
    """On a part, up to `apart` [m] before its end along the route; None if the run did not drive it."""
    truth = result.truth
    rows: NDArray[np.bool_] = (truth.part == part) & (truth.theta < result.path.parts[part].end - apart)
    return _smoothness(truth.steering_rate[rows], truth.lateral_acceleration[rows])


def track_smoothness(
    track: Track, path: ReferencePath, part: int, apart: float, wheelbase: float
) -> Smoothness | None:
    """The same of a published trajectory; it comes to its next part where it is nearest to the cusp.

    Args:
        apart: left out before the end of the part [m]; wheelbase: [m].
    """
    nearest = [
        int(np.argmin(np.hypot(track.poses[:, 0] - one.last.x, track.poses[:, 1] - one.last.y)))
        for one in path.parts[:-1]
    ]
    bounds = [0, *nearest, len(track.times)]
    rows, theta = [], path.parts[part].start
    for row in range(bounds[part], bounds[part + 1]):
        theta = path.parts[part].project(*track.poses[row, :2].tolist(), near=theta)
        if theta < path.parts[part].end - apart:
            rows.append(row)
    lateral = track.v[rows] ** 2 * np.tan(track.delta[rows]) / wheelbase
    return _smoothness(track.steering_rate[rows], lateral)


def _smoothness(rates: Array, lateral: Array) -> Smoothness | None:
    if not len(rates):
        return None
    return Smoothness(float(np.sqrt(np.mean(rates**2))), float(np.sqrt(np.mean(lateral**2))))
