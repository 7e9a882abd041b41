"""Settings of the filters. SI units and radians; a bad value raises `ConfigError`."""

from __future__ import annotations

from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from geometry.settings import CONSTANT, NonNegative, Positive, Settings
from geometry.validation import validated

Std = Annotated[float, Field(gt=0.0, le=1e3)]
Seconds = Annotated[float, Field(gt=0.0, le=1e4)]
LEAST, MOST = 1e-9, 1e6
"""Standard deviations beyond these [m], [rad] leave no matrix that can be inverted."""


class DetectionNoise(Settings):
    """How far a detection is off, by its range r (rear axle to goal): std(r) = max(floor, std r / r_ref).

    Attributes:
        position_std: of x and y each, at `reference_range` [m].
        heading_std: at `reference_range` [rad].
        position_floor, heading_floor: least standard deviations [m], [rad].
        reference_range: r_ref [m].
    """

    position_std: Std = 0.05
    heading_std: Std = 0.035
    position_floor: Std = 0.002
    heading_floor: Std = 0.001
    reference_range: Positive = 10.0

    @validated()
    def covariance(self, distance: float) -> NDArray[np.float64]:
        """(3, 3) of x, y, heading at `distance` [m]."""
        share = distance / self.reference_range
        position = min(max(self.position_floor, self.position_std * share, LEAST), MOST)
        heading = min(max(self.heading_floor, self.heading_std * share, LEAST), MOST)
        return np.diag([position**2, position**2, heading**2])


class GoalFilterConfig(Settings):
    """All settings of a `GoalPoseFilter`; every one has a default.

    The goal's true pose is taken to walk at random: its variance grows by drift² per second. A goal that is
    seen to move also has a velocity, which walks at random itself.

    Attributes:
        noise: of detections that bring no covariance of their own.
        vehicle_position_std, vehicle_heading_std: of the vehicle pose from which a detection in the
            vehicle's frame was made [m], [rad]; they add to its covariance.
        position_drift: of x and y each [m/sqrt(s)]; heading_drift: [rad/sqrt(s)].
        moving: a goal that moves is followed, its velocity and turn rate are estimated from the start.
            Otherwise the controller waits in front of a goal that is seen to move until it stands.
        gate: probability with which a true detection passes the gate.
        confirmations: detections that have to agree before the goal counts as seen.
        lost_after: time without an accepted detection until LOST [s].
        history: how late a detection may arrive [s]; a clock that runs back further was set anew.
    """

    former: ClassVar = {
        "velocity_drift turn_rate_drift velocity_std turn_rate_std reacquire_after moved coast_after "
        "clock_skew": CONSTANT,
    }

    noise: DetectionNoise = DetectionNoise()
    vehicle_position_std: NonNegative = 0.01
    vehicle_heading_std: NonNegative = 0.002
    position_drift: Std = 0.005
    heading_drift: Std = 0.002
    moving: bool = False
    gate: Annotated[float, Field(gt=0.5, lt=1.0)] = 0.999
    confirmations: Annotated[int, Field(ge=1, le=100)] = 2
    lost_after: Seconds = 2.0
    history: Seconds = 1.0

    @validated()
    def drift(self, seconds: float) -> NDArray[np.float64]:
        """Covariance (3, 3) of x, y, heading that a goal at rest gains in `seconds` without a detection."""
        position, heading = self.position_drift**2 * seconds, self.heading_drift**2 * seconds
        return np.diag([position, position, heading])


class DisturbanceFilterConfig(Settings):
    """Settings of the filter of what acts beside the commands (`estimation.disturbance`).

    Attributes:
        enabled: estimate it, and count on it.
        speed_std, heading_std: of a measured speed [m/s] and heading [rad]. Chosen as of wheel odometry and
            an inertial unit; with better ones the estimates are slower than they could be, not worse.
    """

    former: ClassVar = {
        "acceleration_walk steering_walk speed_walk heading_walk first_acceleration_std first_steering_std "
        "drive_share_std turn_share_std most_acceleration most_steering most_drive_share most_turn_share "
        "held_time gap": CONSTANT,
    }

    enabled: bool = True
    speed_std: Std = 0.015
    heading_std: Std = 0.002


class VehicleFilterConfig(Settings):
    """Settings of the filter of the vehicle's own state (`estimation.vehicle_filter`).

    Attributes:
        enabled: filter it; otherwise the state is the measurement.
    """

    former: ClassVar = {"memory position_walk heading_walk speed_walk steering_walk slip widest": CONSTANT}

    enabled: bool = True
