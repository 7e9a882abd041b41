"""[controller]: its assumptions; [simulation]: the plant and the clock."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated

from pydantic import Field

from rti_mpcc.config import EXIT, Ride, Weights
from rti_mpcc.config.vehicle import Delay
from rti_mpcc.paper import METHODS
from rti_mpcc.simulation.sections.base import KeyProblem, NotNegative, Positive, Section, Triple

Noise = Annotated[tuple[NotNegative, NotNegative, NotNegative, NotNegative, NotNegative], Field(strict=False)]


class ControllerSection(Section):
    """What the controller assumes or is asked for; None, and a weight that is not given, is the preset's.

    `method`: of the objective, where the command line asks for none.
    """

    dead_time: Delay | None = None
    drive_lag: Delay | None = None
    steering_lag: Delay | None = None
    steering_dead_time: Delay | None = None
    comfort_acceleration: Positive | None = None
    comfort_lateral_acceleration: Positive | None = None
    comfort_steering_rate: Positive | None = None
    comfort_jerk: Positive | None = None
    ride: Ride | None = None
    docking_time: Positive | None = None
    recovery: bool | None = None
    deadline: Annotated[float, Field(gt=EXIT, le=10.0)] | None = None
    weights: Weights | None = None
    method: str = "dynamic"

    def _problems(self) -> Iterator[KeyProblem]:
        if self.method not in METHODS:
            yield KeyProblem("method", self.method, f"must be one of {', '.join(METHODS)}")


class SimulationSection(Section):
    """The plant and the clock. Times [s]; wheelbase_error relative; steering_offset [rad].

    `acceleration_offset` is added to the command [m/s²], positive to the front. `state_noise`: standard
    deviations of the measured x, y [m], phi [rad], v [m/s], delta [rad]. `start_offset`: of the start pose,
    in its own frame [m], [m], [rad].
    """

    plant_step: float = Field(default=0.01, ge=0.0005, le=0.05)
    cycle: float = Field(default=0.05, ge=0.005, le=0.2)
    dead_time: float = Field(default=0.0, ge=0.0, le=1.0)
    drive_lag: float = Field(default=0.0, ge=0.0, le=1.0)
    steering_lag: float = Field(default=0.0, ge=0.0, le=1.0)
    duration: float = Field(default=120.0, gt=0.0, le=3600.0)
    wheelbase_error: float = Field(default=0.0, ge=-0.5, le=0.5)
    steering_offset: float = Field(default=0.0, ge=-0.3, le=0.3)
    acceleration_gain: float = Field(default=1.0, ge=0.1, le=3.0)
    acceleration_offset: float = Field(default=0.0, ge=-10.0, le=10.0)
    state_noise: Noise = (0.0, 0.0, 0.0, 0.0, 0.0)
    start_offset: Triple = (0.0, 0.0, 0.0)

    def _problems(self) -> Iterator[KeyProblem]:
        if self.plant_step > self.cycle:
            allowed = f"must be <= simulation.cycle = {self.cycle}"
            yield KeyProblem("plant_step", self.plant_step, allowed)
