"""[[mission]]: its steps, a section for each kind."""

from __future__ import annotations

from typing import Annotated, Literal

from numpy.typing import ArrayLike
from pydantic import Field

from geometry import Pose2
from rti_mpcc.simulation.sections.base import Pair, Section, Triple
from rti_mpcc.steps import AnyStep, Approach, Dock, DriveTo, Straight, Then, Undock, Wait


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


class StraightStep(StepSection):
    """Drive straight on; with `contact` until the vehicle touches what it docks at."""

    kind: Literal["straight"]
    distance: float
    speed: float | None = None
    steering: float | None = None
    tolerance: Pair | None = None
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
