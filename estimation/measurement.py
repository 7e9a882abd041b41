"""One detection of the goal, and what it says about the goal in the world.

Seen from the vehicle pose (x_v, y_v, phi_v), a detection z = (x, y, phi) of covariance R says

(E1)  goal = (x_v, y_v) + Rot(phi_v) (x, y),  phi_v + phi,
(E2)  covariance = Rot(phi_v) R Rot(phi_v)' + A P A',  A = [[1, 0, -dy], [0, 1, dx], [0, 0, 1]],

(dx, dy) from vehicle to goal in world axes, P the covariance of the vehicle pose.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from math import cos, hypot, isfinite, sin

import numpy as np
from numpy.typing import ArrayLike

from estimation.settings import GoalFilterConfig
from estimation.types import Array
from geometry import InputError, Pose2
from geometry.errors import shown
from geometry.validation import to_floats

FARTHEST = 1e6
"""Coordinates and standard deviations beyond this [m], [rad] are a mistake, not a detection."""
SMALLEST = 1e-9
"""Smallest standard deviation that is believed [m], [rad]."""
FLATTEST = 1e-9
"""Smallest eigenvalue of a correlation matrix that is believed; below it rounding decides over the sign."""
SKEWEST = 1e-6
"""So far a covariance may be from symmetric, in units of its standard deviations."""
LATEST = 1e10
"""Times beyond this [s] are a mistake: 300 years, or a clock that counts milliseconds."""


class Frame(Enum):
    """The frame that a detection is given in."""

    WORLD = "world"
    VEHICLE = "vehicle"
    """Origin in the middle of the rear axle, x along the heading, y to the left."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GoalMeasurement:
    """One detection of the goal pose. Any numbers may be given: the filter refuses what is not usable.

    Attributes:
        stamp: time of exposure [s], on the clock of `now`; not the time of arrival.
        x, y: [m]; phi: heading of the vehicle when docked [rad], any branch; all in `frame`.
        covariance: (3, 3) of x, y, phi in the axes of `frame` [m², m rad, rad²]; None: by range, see
            `DetectionNoise`.
        frame: see there.
        vehicle: pose of the vehicle in the world at `stamp`, for a detection in its frame, where the caller
            knows it better than the controller's own pose history.

    Raises:
        InputError: the covariance is not a (3, 3) array of numbers.
    """

    stamp: float
    x: float
    y: float
    phi: float
    covariance: ArrayLike | None = None
    frame: Frame = Frame.WORLD
    vehicle: Pose2 | None = None

    def __post_init__(self) -> None:
        if self.covariance is None:
            return
        try:
            covariance = to_floats(self.covariance).copy()
        except TypeError:
            raise InputError(f"covariance = {shown(self.covariance)}: must be (3, 3) numbers") from None
        if covariance.shape != (3, 3):
            raise InputError(f"covariance has shape {covariance.shape}: must be (3, 3), of x, y, phi")
        covariance.flags.writeable = False
        object.__setattr__(self, "covariance", covariance)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Detection:
    """A usable detection in the world: stamp [s], value (3,) x, y, heading, covariance (3, 3).

    `reported` are frame and numbers as they were given: the vehicle pose that they were put into the world
    with may be known better when they are given again.
    """

    stamp: float
    value: Array
    covariance: Array
    reported: tuple[Frame, float, float, float]

    @property
    def pose(self) -> Pose2:
        """The goal by this detection alone."""
        x, y, phi = self.value.tolist()
        return Pose2(x, y, phi)

    def same(self, other: Detection) -> bool:
        """Whether the other one is this one told again."""
        return self.stamp == other.stamp and self.reported == other.reported


def is_time(seconds: float) -> bool:
    """Whether this can be the time of a clock [s]."""
    return isfinite(seconds) and abs(seconds) <= LATEST


def in_world(measurement: GoalMeasurement, config: GoalFilterConfig) -> Detection | str:
    """What a measurement says about the goal in the world, Eq. (E1), (E2), or why it is not usable."""
    m, v = measurement, measurement.vehicle
    if not all(map(isfinite, (m.stamp, m.x, m.y, m.phi))):
        return f"not finite: stamp {m.stamp}, x {m.x}, y {m.y}, phi {m.phi}"
    if not is_time(m.stamp):
        return f"stamp {m.stamp:g} s is beyond {LATEST:g} s"
    if max(abs(m.x), abs(m.y), abs(m.phi)) > FARTHEST:
        return f"beyond {FARTHEST:g}: x {m.x}, y {m.y}, phi {m.phi}"
    if v is not None and not all(map(isfinite, (v.x, v.y, v.phi))):
        return f"not finite: {v}"
    if v is not None and max(abs(v.x), abs(v.y), abs(v.phi)) > FARTHEST:
        return f"beyond {FARTHEST:g}: {v}"
    covariance = _covariance(m, config)
    if isinstance(covariance, str):
        return covariance
    value, reported = np.array([m.x, m.y, m.phi]), (m.frame, m.x, m.y, m.phi)
    if m.frame is Frame.VEHICLE:
        if v is None:
            return f"where the vehicle was at stamp {m.stamp:.3f} s is not known"
        goal = v.compose(Pose2(m.x, m.y, m.phi))
        c, s = cos(v.phi), sin(v.phi)
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        lever = np.eye(3)
        lever[:2, 2] = v.y - goal.y, goal.x - v.x
        vehicle = np.square([config.vehicle_position_std] * 2 + [config.vehicle_heading_std])
        covariance = turn @ covariance @ turn.T + (lever * vehicle) @ lever.T
        covariance = 0.5 * (covariance + covariance.T)
        if not _definite(covariance):
            return "its covariance is not positive definite once turned into the world"
        value = np.array([goal.x, goal.y, goal.phi])
    return Detection(stamp=m.stamp, value=value, covariance=covariance, reported=reported)


def _covariance(measurement: GoalMeasurement, config: GoalFilterConfig) -> Array | str:
    """The measurement's own covariance if it is one, else the one by range."""
    m = measurement
    if m.covariance is None:
        vehicle = m.vehicle if m.frame is Frame.WORLD else Pose2(0.0, 0.0, 0.0)
        if vehicle is None:
            return config.noise.covariance(config.noise.reference_range)
        return config.noise.covariance(hypot(m.x - vehicle.x, m.y - vehicle.y))
    given = np.asarray(m.covariance, dtype=np.float64)
    if not np.isfinite(given).all() or np.abs(given).max() > FARTHEST**2:
        return "its covariance is not finite"
    # Variances that are not positive have no scale to measure a skew by.
    spread = np.sqrt(np.diagonal(given).clip(SMALLEST**2))
    if float(np.abs((given - given.T) / np.outer(spread, spread)).max()) > SKEWEST:
        return "its covariance is not symmetric"
    symmetric = 0.5 * (given + given.T)
    return symmetric if _definite(symmetric) else "its covariance is not positive definite"


def _definite(covariance: Array) -> bool:
    """Whether a symmetric matrix is a covariance that rounding leaves positive definite, in any units."""
    variances = np.diagonal(covariance)
    if float(variances.min()) < SMALLEST**2:
        return False
    spread = np.sqrt(variances)
    return float(np.linalg.eigvalsh(covariance / np.outer(spread, spread))[0]) >= FLATTEST
