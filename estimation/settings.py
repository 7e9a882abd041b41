"""Settings of the filters. SI units and radians; a bad value raises `ConfigError`."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from geometry.doors import door
from geometry.settings import NonNegative, Positive, Settings

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

    @door()
    def covariance(self, distance: float) -> NDArray[np.float64]:
        """(3, 3) of x, y, heading at `distance` [m]."""
        share = distance / self.reference_range
        position = min(max(self.position_floor, self.position_std * share, LEAST), MOST)
        heading = min(max(self.heading_floor, self.heading_std * share, LEAST), MOST)
        return np.diag([position**2, position**2, heading**2])


class GoalFilterConfig(Settings):
    """All settings of a `GoalPoseFilter`; every one has a default.

    The goal's true pose is taken to walk at random: its variance grows by drift² per second. With `moving`
    it also has a velocity, which walks at random itself.

    Attributes:
        noise: of detections that bring no covariance of their own.
        vehicle_position_std, vehicle_heading_std: of the vehicle pose from which a detection in the
            vehicle's frame was made [m], [rad]; they add to its covariance.
        position_drift: of x and y each [m/sqrt(s)]; heading_drift: [rad/sqrt(s)].
        moving: estimate the goal's velocity and turn rate too.
        velocity_drift: [m/s/sqrt(s)]; turn_rate_drift: [rad/s/sqrt(s)]; of a moving goal.
        velocity_std, turn_rate_std: of a moving goal when it is first seen [m/s], [rad/s].
        gate: probability with which a true detection passes the gate.
        confirmations: detections that have to agree before the goal counts as seen.
        reacquire_after: detections that agree with each other over so long, and contradict what was
            believed before them, are the goal's new place [s].
        moved: probability with which detections of a goal that has not moved don't count as contradicting.
        coast_after, lost_after: time without an accepted detection until COASTING, until LOST [s].
        history: how late a detection may arrive [s]; a clock that runs back further was set anew.
        clock_skew: how far a stamp may lie ahead of the clock [s].
    """

    noise: DetectionNoise = DetectionNoise()
    vehicle_position_std: NonNegative = 0.01
    vehicle_heading_std: NonNegative = 0.002
    position_drift: Std = 0.005
    heading_drift: Std = 0.002
    moving: bool = False
    velocity_drift: Std = 0.02
    turn_rate_drift: Std = 0.01
    velocity_std: Std = 0.2
    turn_rate_std: Std = 0.05
    gate: Annotated[float, Field(gt=0.5, lt=1.0)] = 0.999
    confirmations: Annotated[int, Field(ge=1, le=100)] = 2
    reacquire_after: Seconds = 0.65
    moved: Annotated[float, Field(gt=0.5, lt=1.0)] = 0.9999
    coast_after: Seconds = 0.5
    lost_after: Seconds = 2.0
    history: Seconds = 1.0
    clock_skew: Annotated[float, Field(ge=0.0, le=1.0)] = 0.05

    @door()
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
        acceleration_walk: of d [m/s²/sqrt(s)]. From rest d is found within a second, as nothing is known of
            it then; a slope that begins on the way takes some 3 s. Four times as much follows twice as
            fast, and then a gain that is 10 to 20 % off passes for a slope that changes with each braking:
            the last half second before the dock took up to a second longer.
        steering_walk: of o [rad/sqrt(s)]. At 1 m/s o follows within some 2 m, and knows 1 mrad.
        speed_walk, heading_walk: what nobody models [m/s/sqrt(s)], [rad/sqrt(s)]: lag of the drive, slip.
        first_acceleration_std, first_steering_std: before anything is known [m/s²], [rad]: 2 % of slope and
            1.7 deg; a larger slope is believed after some tenths of a second all the same. The more, the
            more the first cycles of a noisy speed make of it.
        drive_share_std: by which share the drive answers too strongly or weakly; turn_share_std: the same of
            the curvature, as a wheelbase that is off makes it.
        most_acceleration, most_steering: largest |d| [m/s²] (a slope of 30 %) and |o| [rad] (6 deg).
        most_drive_share, most_turn_share: largest |g| and |c|.
        held_time: so long a vehicle may stand although it is commanded to drive off before that is taken for
            a slope [s]: as a parking brake takes to open.
        gap: after so long without a measurement [s] nothing is learnt of what was in between.
    """

    enabled: bool = True
    speed_std: Std = 0.015
    heading_std: Std = 0.002
    acceleration_walk: Std = 0.005
    steering_walk: Std = 5e-4
    speed_walk: Std = 0.005
    heading_walk: Std = 5e-4
    first_acceleration_std: Std = 0.2
    first_steering_std: Std = 0.03
    drive_share_std: Std = 0.1
    turn_share_std: Std = 0.03
    most_acceleration: Std = 3.0
    most_steering: Annotated[float, Field(gt=0.0, le=0.5)] = 0.1
    most_drive_share: Annotated[float, Field(gt=0.0, le=0.9)] = 0.3
    most_turn_share: Annotated[float, Field(gt=0.0, le=0.9)] = 0.2
    held_time: Seconds = 1.0
    gap: Seconds = 1.0


class VehicleFilterConfig(Settings):
    """Settings of the filter of the vehicle's own state (`estimation.vehicle_filter`).

    What is noise in the measurements is learnt; what is set is how far the model may be off: the more, the
    more a measurement counts.

    Attributes:
        enabled: filter it; otherwise the state is what is measured.
        memory: over which the noise is learnt [s].
        position_walk, heading_walk, speed_walk, steering_walk: what nobody models [m/sqrt(s)],
            [rad/sqrt(s)], [m/s/sqrt(s)], [rad/sqrt(s)]: lag of drive and steering, slopes that begin.
        slip: share of the way driven, and of a change of speed, by which the model is off.
        widest: the state is no farther from a measurement than so many standard deviations of the noise.
    """

    enabled: bool = True
    memory: Seconds = 3.0
    position_walk: Std = 0.002
    heading_walk: Std = 5e-4
    speed_walk: Std = 0.02
    steering_walk: Std = 0.01
    slip: Annotated[float, Field(ge=0.0, le=1.0)] = 0.05
    widest: Positive = 3.0
