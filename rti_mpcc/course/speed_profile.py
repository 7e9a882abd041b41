"""How fast a part may be driven in comfort.

The steering that the path asks for, delta(theta) = atan(L kappa), is smoothed over a few metres: no vehicle
turns its wheels on the spot. From it, with the comfort values,

(P1)  v² |tan delta| / L <= a_lat,   v |d delta / d theta| <= delta_dot,   v <= the speed limit,

and what the clearance beside the body allows, (P2) of rti_mpcc.ocp.side_clearance.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geometry import PathPart
from rti_mpcc.config import ControllerConfig
from rti_mpcc.config.controller import PLANNED_SHARE
from rti_mpcc.ocp.side_clearance import SideClearance
from rti_mpcc.types import Array

PATH_SPACING = 0.25  # [m] of the samples along a part, and of the pieces ahead
LEAST_PIECES = 64  # in which the route ahead is looked at
MOST_PIECES = 400
STEERING_DISTANCE = 4.0  # [m] over which a step of the path's curvature is steered: wheels take time

FLAT = 1e-9  # [1/m], [1/m²]; curvatures and their slopes below this are none


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ComfortSpeeds:
    """Highest comfortable speeds on a part.

    Attributes:
        theta: (n,) [m], increasing. speed: (n,) [m/s]. Beyond both ends it is as at them.
        side_clearance: what bounds the speed in the QP by (P2); None: nothing does.
    """

    theta: Array
    speed: Array
    side_clearance: SideClearance | None = None

    def at(self, theta: Array) -> Array:
        """Highest speeds (m,) [m/s] at `theta` (m,) [m]."""
        return np.interp(theta, self.theta, self.speed)

    def ahead(self, theta: float, distance: float) -> Array:
        """Highest speeds (m,) [m/s] in the middles of m equal pieces of so far [m] from `theta` [m] on."""
        pieces = int(min(max(distance / PATH_SPACING, LEAST_PIECES), MOST_PIECES))
        return self.at(theta + distance * (np.arange(pieces) + 0.5) / pieces)


def speed_profile_of(
    part: PathPart, config: ControllerConfig, side_clearance: SideClearance | None = None
) -> ComfortSpeeds:
    """The pace of a part, Eq. (P1), and where its room is known (P2)."""
    comfort, wheelbase = config.comfort, config.vehicle.wheelbase
    theta = part.places(min(PATH_SPACING, 0.5 * (part.end - part.start)))
    count = theta.size - 1
    width = 2 * round(0.5 * STEERING_DISTANCE / PATH_SPACING) + 1
    asked = np.pad(np.arctan(wheelbase * part.curvature(theta)), width // 2, mode="edge")
    steering = np.convolve(asked, np.full(width, 1.0 / width), mode="valid")
    curvature = np.maximum(np.abs(np.tan(steering)) / wheelbase, FLAT)
    # In a part of two pieces the way over which it is smoothed would shrink with the part.
    way = theta if count > 2 else PATH_SPACING * np.arange(count + 1.0)
    turning = np.maximum(np.abs(np.gradient(steering, way)), FLAT)
    speed = np.minimum(np.sqrt(comfort.lateral_acceleration / curvature), comfort.steering_rate / turning)
    speed = np.minimum(speed, config.limits.speed)
    if side_clearance is not None:
        speed = np.minimum(speed, PLANNED_SHARE * side_clearance.speed_at(theta))
    return ComfortSpeeds(theta=theta, speed=speed, side_clearance=side_clearance)
