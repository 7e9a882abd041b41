"""How exactly a run comes to the cusp and to the end of a route, and how smoothly it gets there."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

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


def cusp_error(result: RunResult) -> PoseError:
    """Where the run comes nearest to the first cusp."""
    return nearest_error(result.truth.poses, result.path.parts[0].last)


def end_error(result: RunResult) -> PoseError | None:
    """At the end of the run; None where it did not come to the last part."""
    if result.truth.part[-1] < len(result.path.parts) - 1:
        return None
    return error_at(result.truth.poses[-1], result.path.end)


def split_errors(poses: Array, path: ReferencePath) -> tuple[PoseError, PoseError]:
    """The same two of a trajectory (n, 3) that is not from a run and gets to the end."""
    return nearest_error(poses, path.parts[0].last), error_at(poses[-1], path.end)


def smoothness(result: RunResult, part: int, apart: float) -> Smoothness | None:
    """On a part, up to `apart` [m] before its end along the route; None if the run did not drive it."""
    truth = result.truth
    rows: NDArray[np.bool_] = (truth.part == part) & (truth.theta < result.path.parts[part].end - apart)
    if not rows.any():
        return None
    rates, lateral = truth.steering_rate[rows], truth.lateral_acceleration[rows]
    return Smoothness(float(np.sqrt(np.mean(rates**2))), float(np.sqrt(np.mean(lateral**2))))
