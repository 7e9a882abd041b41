"""[controller]: its assumptions; [simulation]: the plant and the clock; [[mission]]: the steps."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal

from numpy.typing import ArrayLike
from pydantic import Field

from geometry import Pose2
from rti_mpcc.config import EXIT, Ride
from rti_mpcc.config.vehicle import Delay
from rti_mpcc.simulation.sections.base import (
    KeyProblem,
    NotNegative,
    Pair,
    Positive,
    Section,
    Triple,
    refusal,
)
from rti_mpcc.steps import AnyStep, Approach, Dock, DriveTo, Straight, Then, Undock, Wait

_Noise = Annotated[
    tuple[NotNegative, NotNegative, NotNegative, NotNegative, NotNegative], Field(strict=False)
]


class ControllerSection(Section):
    """What the controller assumes or is asked for; None is the preset's own value."""

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
    state_noise: _Noise = (0.0, 0.0, 0.0, 0.0, 0.0)
    start_offset: Triple = (0.0, 0.0, 0.0)

    def _problems(self) -> Iterator[KeyProblem]:
        if self.plant_step > self.cycle:
            allowed = f"must be <= simulation.cycle = {self.cycle}"
            yield KeyProblem("plant_step", self.plant_step, allowed)


class ApproachSection(Section):
    """The straight last piece of the route into the dock: length [m], direction 1 (forward) or -1."""

    length: Annotated[float, Field(gt=0.0, le=100.0)]
    direction: Literal[1, -1]

    def build(self) -> Approach:
        """The approach."""
        return Approach(self.length, self.direction)


class StepSection(Section):
    """The keys that all steps have, see `rti_mpcc.steps`; what is not given is as in Python."""

    timeout: float | None = None
    patience: float | None = None
    retries: int | None = None
    retry_from: int | None = None
    then: Then | None = None


class DockStep(StepSection):
    """Drive to the goal, known or detected."""

    kind: Literal["dock"]
    approach: ApproachSection | None = None
    tolerance: Triple | None = None
    uncertainty: Pair | None = None


class WaitStep(StepSection):
    """Stand for some seconds."""

    kind: Literal["wait"]
    seconds: float


class MoveSection(Section):
    """The keys of a straight move, see `Straight`."""

    distance: float
    speed: float | None = None
    steering: float | None = None
    tolerance: Pair | None = None

    def _problems(self) -> Iterator[KeyProblem]:
        yield from refusal("", None, self.build, MoveSection)

    def build(self) -> Straight:
        """The move. Raises InputError."""
        return Straight(**self.model_dump(include=set(MoveSection.model_fields), exclude_none=True))


class StraightStep(StepSection, MoveSection):
    """Drive straight on; with `contact` until the vehicle touches what it docks at."""

    kind: Literal["straight"]
    contact: bool | None = None


class UndockStep(StepSection):
    """Drive out of where the vehicle stands."""

    kind: Literal["undock"]
    distance: float


class DriveToStep(StepSection):
    """Drive to a pose: x, y [m], heading [rad]."""

    kind: Literal["drive_to"]
    pose: Triple
    tolerance: Triple | None = None


AnyStepSection = DockStep | WaitStep | StraightStep | UndockStep | DriveToStep
MissionSection = Annotated[AnyStepSection, Field(discriminator="kind")]


def built_step(section: AnyStepSection, goal: Pose2 | None, body: ArrayLike | None) -> AnyStep:
    """The step. Raises InputError.

    `goal`: of a dock with a planned route, else None; `body`: outline (k, 2) of the docked object in its
    frame [m].
    """
    given = {name: getattr(section, name) for name in section.model_fields_set if name != "kind"}
    match section:
        case DockStep():
            approach = {} if section.approach is None else {"approach": section.approach.build()}
            return Dock(goal, body=body, **{**given, **approach})
        case WaitStep():
            return Wait(**given)
        case StraightStep():
            if given.pop("contact", False):
                given["until"] = signalled_by_the_simulation
            return Straight(**given)
        case UndockStep():
            return Undock(**given)
        case DriveToStep():
            return DriveTo(**{**given, "pose": Pose2(*section.pose)})


def signalled_by_the_simulation() -> bool:
    """Stands for a contact switch: the closed loop gives the signal to `DockingMission.step` itself."""
    return False
