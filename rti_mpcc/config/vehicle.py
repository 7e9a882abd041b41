"""The vehicle, its limits, and what it is to feel."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from pydantic import Field

from geometry.settings import NonNegative, Positive, Settings


class Comfort(NamedTuple):
    """What a passenger, or the load, is to feel at most: [m/s²], [m/s²], [rad/s]."""

    acceleration: float
    lateral_acceleration: float
    steering_rate: float


class Vehicle(Settings):
    """A car-like vehicle; its reference point is the middle of the rear axle.

    Attributes:
        wheelbase: [m].
        width: of the body [m].
        front: body ahead of the rear axle [m].
        rear: body behind the rear axle [m].
    """

    wheelbase: Positive = 2.875
    width: Positive = 2.069
    front: Positive = 3.6775
    rear: NonNegative = 0.8027


class Limits(Settings):
    """Symmetric limits of the vehicle.

    Attributes:
        speed: [m/s]; acceleration: [m/s²]; steering: [rad], below pi/2; steering_rate: [rad/s].
    """

    speed: Annotated[float, Field(gt=0.0, le=100.0)] = 10.0
    acceleration: Annotated[float, Field(gt=0.0, le=100.0)] = 5.0
    steering: Annotated[float, Field(gt=0.0, le=1.4)] = 0.6
    steering_rate: Annotated[float, Field(gt=0.0, le=100.0)] = 1.0
