"""The vehicle, its limits, and what it is to feel."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

from pydantic import Field, field_validator, model_validator

from geometry.errors import CorridorError
from geometry.outline import checked_polygon
from geometry.settings import NonNegative, Positive, Settings


class Comfort(NamedTuple):
    """What a passenger, or the load, is to feel at most: [m/s²], [m/s²], [rad/s], [m/s³].

    The jerk is that of the acceleration along the vehicle.
    """

    acceleration: float
    lateral_acceleration: float
    steering_rate: float
    jerk: float


class Vehicle(Settings):
    """A car-like vehicle; its reference point is the middle of the rear axle.

    Attributes:
        wheelbase: [m].
        width: of the body [m].
        front: body ahead of the rear axle [m].
        rear: body behind the rear axle [m].
        outline: corners (x, y) [m] of a body that is no rectangle, any simple polygon: x from the rear axle
            to the front, y to the left. `width`, twice the largest |y|, `front` and `rear` follow from it.
    """

    wheelbase: Positive = 2.875
    width: Positive = 2.069
    front: Positive = 3.6775
    rear: NonNegative = 0.8027
    outline: tuple[tuple[float, float], ...] | None = None

    @model_validator(mode="before")
    @classmethod
    def _span(cls, values: Any) -> Any:
        """With what follows from an outline; one that is none is told by its own check."""
        if not isinstance(values, dict) or values.get("outline") is None:
            return values
        try:
            points = tuple(checked_polygon(values["outline"], "outline").exterior.coords)[:-1]
        except CorridorError:
            return values
        x, y = ([point[axis] for point in points] for axis in (0, 1))
        span = {"width": 2.0 * max(map(abs, y)), "front": max(x), "rear": -min(x)}
        for name, value in span.items():
            if abs(float(values.get(name, value)) - value) > 1e-9:
                raise ValueError(
                    f"{name} = {values[name]} beside an outline, from which it follows: {value:g}"
                )
        return {**values, **span, "outline": points}

    @field_validator("outline")
    @classmethod
    def _simple(cls, outline: tuple[tuple[float, float], ...] | None) -> Any:
        if outline is not None:
            try:
                checked_polygon(outline, "it")
            except CorridorError as error:
                raise ValueError(str(error)) from None
        return outline

    @property
    def least_width(self) -> float:
        """What a corridor has to be wide everywhere [m]: nothing is known of a body that is no rectangle."""
        return self.width if self.outline is None else 0.0


class Limits(Settings):
    """Symmetric limits of the vehicle.

    Attributes:
        speed: [m/s]; acceleration: [m/s²]; steering: [rad], below pi/2; steering_rate: [rad/s].
    """

    speed: Annotated[float, Field(gt=0.0, le=100.0)] = 10.0
    acceleration: Annotated[float, Field(gt=0.0, le=100.0)] = 5.0
    steering: Annotated[float, Field(gt=0.0, le=1.4)] = 0.6
    steering_rate: Annotated[float, Field(gt=0.0, le=100.0)] = 1.0
