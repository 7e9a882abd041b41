"""The vehicle, its limits, and what it is to feel."""

from __future__ import annotations

import logging
from typing import Annotated, Any, Literal, NamedTuple, Self

from pydantic import Field, field_validator, model_validator

from geometry.errors import CorridorError
from geometry.outline import checked_polygon
from geometry.settings import NonNegative, Positive, Settings

_log = logging.getLogger(__name__)


class Comfort(NamedTuple):
    """What a passenger, or the load, is to feel at most: [m/s²], [m/s²], [rad/s], [m/s³].

    The jerk is that of the acceleration along the vehicle.
    """

    # Kernels take it: what geometry.compiled keeps is of these fields.
    acceleration: float
    lateral_acceleration: float
    steering_rate: float
    jerk: float


Ride = Literal["smooth", "brisk"]
"""What an arrival is to be like, within comfort.

smooth: of least acceleration energy; its acceleration falls evenly, and is that of comfort at either end.
brisk: of least time, with the comfort acceleration as far as its jerk allows; some 15 % shorter.
"""


class Vehicle(Settings):
    """A car-like vehicle; its reference point is the middle of the rear axle.

    Attributes:
        wheelbase: [m].
        width: of the body [m].
        front: body ahead of the rear axle [m].
        rear: body behind the rear axle [m]. What of `width`, `front` and `rear` is not given is scaled with
            the wheelbase, and logged.
        outline: corners (x, y) [m] of a body that is no rectangle, any simple polygon: x from the rear axle
            to the front, y to the left. `width`, twice the largest |y|, `front` and `rear` follow from it.
    """

    wheelbase: Positive = 2.875
    width: Positive = 2.069
    front: Positive = 3.6775
    rear: NonNegative = 0.8027
    outline: tuple[tuple[float, float], ...] | None = None

    @field_validator("outline")
    @classmethod
    def _simple(cls, outline: tuple[tuple[float, float], ...] | None) -> Any:
        if outline is None:
            return None
        try:
            return tuple(checked_polygon(outline, "it").exterior.coords)[:-1]
        except CorridorError as error:
            raise ValueError(str(error)) from None

    @model_validator(mode="after")
    def _follows(self) -> Self:
        """The body as far as it follows from an outline, or else from the wheelbase."""
        if self.outline is not None:
            x, y = zip(*self.outline, strict=True)
            body = {"width": 2.0 * max(map(abs, y)), "front": max(x), "rear": -min(x)}
            for name, value in body.items():
                given = getattr(self, name)
                if name in self.model_fields_set and abs(given - value) > 1e-9:
                    raise ValueError(f"{name} = {given} beside an outline, from which it follows: {value:g}")
        else:
            body = self._in_proportion()
        for name, value in body.items():
            object.__setattr__(self, name, value)
        return self

    def _in_proportion(self) -> dict[str, float]:
        """What of the body was not given, scaled with the wheelbase; says so."""
        fields = type(self).model_fields
        share = self.wheelbase / fields["wheelbase"].default
        missing = [name for name in ("width", "front", "rear") if name not in self.model_fields_set]
        if share == 1.0 or not missing:
            return {}
        body = {name: share * fields[name].default for name in missing}
        told = ", ".join(f"{name} = {value:.3g} m" for name, value in body.items())
        _log.warning(
            "Vehicle: wheelbase = %g m without %s: scaled from the default car, %s",
            self.wheelbase,
            ", ".join(missing),
            told,
        )
        return body

    @property
    def least_width(self) -> float:
        """What a corridor has to be wide everywhere [m]: nothing is known of a body that is no rectangle."""
        return self.width if self.outline is None else 0.0


class Limits(Settings):
    """Symmetric limits of the vehicle.

    Attributes:
        speed: [m/s].
        acceleration: [m/s²].
        steering: [rad], below pi/2.
        steering_rate: [rad/s].
    """

    speed: Annotated[float, Field(gt=0.0, le=100.0)] = 10.0
    acceleration: Annotated[float, Field(gt=0.0, le=100.0)] = 5.0
    steering: Annotated[float, Field(gt=0.0, le=1.4)] = 0.6
    steering_rate: Annotated[float, Field(gt=0.0, le=100.0)] = 1.0


Delay = Annotated[float, Field(ge=0.0, le=1.0)]  # dead time or lag of an actuator [s]


class ActuatorModel(Settings):
    """How drive and steering answer a command: dead time, then a lag of first order.

    It is the same for a vehicle that obeys acceleration and steering rate, and for one that obeys set-points
    of speed and steering: the set-points are the integrals of the rates.

    Attributes:
        dead_time: time from a command to the begin of its effect, on both actuators [s].
        drive_lag: time constant of the drive [s].
        steering_lag: time constant of the steering [s].
        steering_dead_time: dead time of the steering [s], where it differs from that of the drive.
    """

    dead_time: Delay = 0.0
    drive_lag: Delay = 0.0
    steering_lag: Delay = 0.0
    steering_dead_time: Delay | None = None


KINDS: dict[str, tuple[Vehicle, Limits]] = {
    "rc_car": (
        Vehicle(wheelbase=0.33, width=0.31, front=0.455, rear=0.125),
        Limits(speed=3.0, acceleration=5.0, steering=0.41, steering_rate=3.2),
    ),
    "delivery_robot": (
        Vehicle(wheelbase=0.65, width=0.745, front=0.815, rear=0.165),
        Limits(speed=1.5, acceleration=1.5, steering=0.46, steering_rate=1.0),
    ),
    "forklift": (
        Vehicle(wheelbase=1.4, width=1.1, front=1.65, rear=1.5),
        Limits(speed=2.0, acceleration=1.5, steering=1.2, steering_rate=1.0),
    ),
    "car": (Vehicle(), Limits()),
    "van": (
        Vehicle(wheelbase=3.665, width=2.02, front=4.67, rear=1.262),
        Limits(speed=10.0, acceleration=5.0, steering=0.62, steering_rate=0.8),
    ),
    "bus": (
        Vehicle(wheelbase=5.845, width=2.55, front=8.65, rear=3.485),
        Limits(speed=8.0, acceleration=3.0, steering=0.75, steering_rate=0.6),
    ),
}
"""Typical vehicles of six kinds, for a first try: replace the figures by those of your own.

From published dimensions of: an F1TENTH car (1:10), an AgileX Hunter 2.0, a counterbalanced forklift of 1.6 t
(fixed axle at the load: the forks point to the rear), the car of the paper, a Mercedes Sprinter L2, and a
Mercedes Citaro of 12 m. Steering follows from the turning circle.
"""
