"""[goal] with its [goal.measurement] and shifts."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated

from pydantic import Field

from estimation import DetectionNoise
from rti_mpcc.simulation.sections.base import (
    KeyProblem,
    ListOf,
    NotNegative,
    Polygon,
    Positive,
    Section,
    Tolerance,
    Triple,
    polygon_problems,
)
from rti_mpcc.simulation.sections.camera import CameraSection

_NOISE = DetectionNoise()
Std = Annotated[float, Field(gt=0.0, le=100.0)]
Share = Annotated[float, Field(ge=0.0, le=1.0)]


class ShiftSection(Section):
    """The true goal moves by `offset` (its own frame) once the rear axle is within `at_distance` [m]."""

    at_distance: Positive
    offset: Triple


class MeasurementSection(Section):
    """How the goal is detected: std(r) = max(floor, std r / reference_range), r from rear axle to goal.

    `initial_offset` is the goal that the plan starts from, in the true goal's frame.
    """

    rate: float = Field(default=10.0, gt=0.0, le=1000.0)
    position_std: Std = _NOISE.position_std
    heading_std: Std = _NOISE.heading_std
    position_floor: Std = _NOISE.position_floor
    heading_floor: Std = _NOISE.heading_floor
    reference_range: Positive = _NOISE.reference_range
    visible_range: Positive = 15.0
    blind_range: NotNegative = 0.0
    visible_after_cusp: bool = False
    delay: float = Field(default=0.0, ge=0.0, le=10.0)
    dropout: Share = 0.1
    outlier: Share = 0.02
    outlier_size: NotNegative = 1.0
    initial_offset: Triple = (0.4, -0.3, 0.1)

    def _problems(self) -> Iterator[KeyProblem]:
        if self.blind_range >= self.visible_range:
            allowed = f"must be < goal.measurement.visible_range = {self.visible_range}"
            yield KeyProblem("blind_range", self.blind_range, allowed)

    @property
    def noise(self) -> DetectionNoise:
        """The law of the noise, for detector and filter alike."""
        return DetectionNoise(**{name: getattr(self, name) for name in DetectionNoise.model_fields})

    def sees(self, distance: float) -> bool:
        """Whether a goal at this distance [m] is in its range."""
        return self.blind_range <= distance <= self.visible_range


class GoalSection(Section):
    """The goal by `offset` from the path's last pose or by its `pose`; neither: the path's last pose.

    In an area it is its `pose`. `body` is the outline of what is docked at, in the goal's frame [m]: the
    vehicle keeps clear of it until it drives on straight to touch it.
    """

    offset: Triple | None = None
    pose: Triple | None = None
    tolerance: Tolerance = (0.05, 0.05, 0.03490658503988659)
    body: Polygon | None = None
    measurement: MeasurementSection | None = None
    camera: CameraSection | None = None
    shifts: ListOf[ShiftSection] = ()

    @property
    def is_path_end(self) -> bool:
        """No goal is given: the controller stops at the path's last pose."""
        return self.offset is None and self.pose is None

    def _problems(self) -> Iterator[KeyProblem]:
        if self.offset is not None and self.pose is not None:
            yield KeyProblem("pose", self.pose, "either offset or pose, not both")
        if self.body is not None:
            yield from polygon_problems("body", self.body)
        if self.camera is not None and self.measurement is None:
            allowed = "needs [goal.measurement], which says when and how far it sees"
            yield KeyProblem("camera", None, allowed)
