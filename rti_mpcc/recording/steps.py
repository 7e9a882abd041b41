"""The steps of a mission as plain data, as a recording holds them.

What tells that a step is over cannot be recorded: that there is something is, and each cycle what it said.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from estimation import CharucoBoard
from geometry import Pose2
from rti_mpcc.steps import COMMON, AnyStep, Approach, Dock, DockKind, DriveTo, Straight, Then, Undock, Wait
from rti_mpcc.types import Array


@dataclass(frozen=True, slots=True, kw_only=True)
class StepData:
    """A step: `kind` as in scenario files, `told` whether it has an `until`, and what its kind has.

    Attributes: see `rti_mpcc.steps`; `contact` is a straight step.
    """

    kind: str
    timeout: float
    patience: float
    retries: int
    retry_from: int | None
    then: Then
    told: bool = False
    seconds: float | None = None
    distance: float | None = None
    speed: float | None = None
    steering: float | None = None
    across: tuple[float, float] | None = None
    pose: Pose2 | None = None
    tolerance: tuple[float, float, float] | None = None
    name: str = ""
    dock_kind: DockKind | None = None
    board: CharucoBoard | None = None
    approach: Approach | None = None
    body: Array | None = None
    contact: StepData | None = None
    uncertainty: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionData:
    """A mission: its steps, and its home, or None."""

    steps: tuple[StepData, ...]
    home: StepData | None = None


DOCK = ("pose", "name", "board", "approach", "tolerance", "uncertainty")


def data_of(step: AnyStep) -> StepData:
    """The data of a step."""
    own: dict[str, Any] = {name: getattr(step, name) for name in COMMON}
    if isinstance(step, Wait):
        own |= {"seconds": step.seconds, "told": step.until is not None}
    elif isinstance(step, Straight):
        own |= {name: getattr(step, name) for name in ("distance", "speed", "steering")}
        own |= {"across": step.tolerance, "told": step.until is not None}
    elif isinstance(step, Undock):
        own |= {"distance": step.distance}
    elif isinstance(step, DriveTo):
        own |= {"pose": step.pose, "tolerance": step.tolerance}
    else:
        own |= {name: getattr(step, name) for name in DOCK}
        own["dock_kind"] = step.kind
        own["body"] = None if step.body is None else np.asarray(step.body, dtype=np.float64)
        own["contact"] = None if step.contact is None else data_of(step.contact)
    return StepData(kind=step.word, **own)


def step_of(data: StepData) -> AnyStep:
    """The step. Raises InputError where the data are those of none."""
    own: dict[str, Any] = {name: getattr(data, name) for name in COMMON}
    if data.told:
        own["until"] = played_back
    if data.kind == Wait.word:
        return Wait(data.seconds, **own)
    if data.kind == Straight.word:
        own |= {name: getattr(data, name) for name in ("distance", "speed", "steering")}
        return Straight(tolerance=data.across, **own)
    if data.kind == Dock.word:
        own |= {name: getattr(data, name) for name in DOCK}
        own["contact"] = None if data.contact is None else step_of(data.contact)
        return Dock(kind=data.dock_kind, body=data.body, **own)
    if data.kind == Undock.word:
        return Undock(distance=data.distance, **own)  # type: ignore[arg-type]  # it says what is missing
    return DriveTo(pose=data.pose, tolerance=data.tolerance, **own)  # type: ignore[arg-type]


def played_back() -> bool:
    """Stands for what told that a step was over: a replay says itself what it said."""
    return False
