"""The mission of a scenario file: its steps, what is told to be over, and what is docked at."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any, Literal, Protocol, get_args, runtime_checkable

import numpy as np
import shapely
from pydantic import Field

from geometry import InputError, Pose2
from rti_mpcc.config import Vehicle
from rti_mpcc.model.footprint import body_polygons
from rti_mpcc.planning.agenda import StepRecord
from rti_mpcc.simulation.fields import Length, Pair, Triple
from rti_mpcc.simulation.section import Section
from rti_mpcc.steps import COMMON, AnyStep, Approach, Dock, DriveTo, Straight, Then, Undock, Wait
from rti_mpcc.types import Array, MissionResult

if TYPE_CHECKING:
    from rti_mpcc.docking import DockingController
    from rti_mpcc.mission import DockingMission
    from rti_mpcc.simulation.scenario import Scenario

SOME_BODY = np.array([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)])
"""For a look at a step by itself."""
TOUCHING = 1e-3
"""Bodies that are nearer to one another are in contact [m]."""

Kind = Literal["dock", "wait", "straight", "undock", "drive_to"]
Numbers = Annotated[tuple[float, ...], Field(strict=False, min_length=2, max_length=3)]


class ApproachSection(Section):
    """The straight last piece of the way into the dock: length [m], direction 1 (forward) or -1."""

    length: Length
    direction: Literal[1, -1]


class MissionSection(Section):
    """A step of the mission, see `rti_mpcc.steps`: what it is, and what its kind knows."""

    kind: Kind
    approach: ApproachSection | None = None
    seconds: float | None = None
    distance: float | None = None
    speed: float | None = None
    steering: float | None = None
    tolerance: Numbers | None = None
    contact: bool | None = None
    uncertainty: Pair | None = None
    pose: Triple | None = None
    timeout: float | None = None
    patience: float | None = None
    retries: int | None = None
    retry_from: int | None = None
    then: Then | None = None

    def given(self) -> dict[str, Any]:
        """What is said of it but its kind."""
        return {name: getattr(self, name) for name in self.model_fields_set if name != "kind"}


REQUIRED: Mapping[str, tuple[str, ...]] = {
    "dock": (),
    "wait": ("seconds",),
    "straight": ("distance",),
    "undock": ("distance",),
    "drive_to": ("pose",),
}
OPTIONAL: Mapping[str, tuple[str, ...]] = {
    "dock": ("approach", "tolerance", "uncertainty"),
    "wait": (),
    "straight": ("speed", "steering", "tolerance", "contact"),
    "undock": (),
    "drive_to": ("tolerance",),
}
"""Keys of each kind, besides those that all have."""


def problems_of(
    section: MissionSection, *, in_area: bool, has_body: bool
) -> Iterator[tuple[str, object, str]]:
    """What is wrong with a step by itself: key, value, and what is allowed."""
    kind, given = section.kind, section.given()
    known = (*REQUIRED[kind], *OPTIONAL[kind], *COMMON)
    for key in sorted(given):
        if key not in known:
            yield key, given[key], f"unknown key for kind = {kind!r}, allowed are {', '.join(sorted(known))}"
    missing = [key for key in REQUIRED[kind] if given.get(key) is None]
    for key in missing:
        yield key, None, f"required for kind = {kind!r}"
    if given.get("contact") and not has_body:
        yield "contact", True, "needs goal.body, what is to be touched"
    misplaced = [key for key in OPTIONAL[kind] if kind == "dock" and not in_area and key in given]
    for key in misplaced:
        yield key, None, "only in an area, where the way to the dock is planned"
    if missing or misplaced or any(key not in known for key in given):
        return
    try:
        step_of(section, Pose2(0.0, 0.0, 0.0) if in_area else None, SOME_BODY if has_body else None)
    except InputError as error:
        yield "", None, str(error)


def step_of(section: MissionSection, goal: Pose2 | None, body: Array | None) -> AnyStep:
    """The step. Raises InputError.

    Args:
        goal: that is docked at, where the way to it is planned; None: the end of the path, or its goal.
        body: outline (k, 2) of what is docked at, in the goal's frame [m], or None.
    """
    given = section.given()
    if (pose := given.pop("pose", None)) is not None:
        given["pose"] = Pose2(*pose)
    if section.kind == "dock":
        if (approach := given.pop("approach", None)) is not None:
            given["approach"] = Approach(approach.length, approach.direction)
        return Dock(goal, body=body, **given)
    if section.kind == "straight" and given.pop("contact", False):
        given["until"] = told_by_the_simulation
    kinds: Mapping[str, type[AnyStep]] = {
        "wait": Wait, "straight": Straight, "undock": Undock, "drive_to": DriveTo
    }  # fmt: skip
    return kinds[section.kind](**given)


def told_by_the_simulation() -> bool:
    """Stands for a contact switch: the closed loop tells `DockingMission.step` itself."""
    return False


def mission_of(scenario: Scenario, controller: DockingController) -> DockingMission | DockingController:
    """The controller with the scenario's mission, or itself where there is none."""
    if not scenario.mission:
        return controller
    from rti_mpcc.mission import DockingMission  # the harness serves other controllers without it

    goal = scenario.planned_goal() if scenario.in_area else None
    body = None if scenario.goal.body is None else np.array(scenario.goal.body)
    home = None if scenario.home is None else Pose2(*scenario.home.pose)
    return DockingMission(controller, [step_of(each, goal, body) for each in scenario.mission], home=home)


@runtime_checkable
class Mission(Protocol):
    """What a mission tells of itself.

    Attributes:
        result: RUNNING while a step is left; over: none is, and the vehicle stands.
        log: all steps that were begun.
        docks: the step under way makes for a dock.
    """

    @property
    def result(self) -> MissionResult: ...  # noqa: D102
    @property
    def over(self) -> bool: ...  # noqa: D102
    @property
    def log(self) -> tuple[StepRecord, ...]: ...  # noqa: D102
    @property
    def docks(self) -> bool: ...  # noqa: D102


def mission_in(controller: object) -> Mission | None:
    """The controller, or what it is wrapped around, if that is a mission."""
    while controller is not None:
        if isinstance(controller, Mission):
            return controller
        controller = getattr(controller, "controller", None)
    return None


def all_succeeded(result: MissionResult | None, log: Sequence[StepRecord]) -> bool:
    """Whether a mission came to its end with all of its steps; True where there was none.

    A step that was tried again counts by its last try. A mission that goes on after a failed step
    (`then="continue"`) succeeds, but not with all of its steps.
    """
    last_tries = {record.place: record.result for record in log}
    succeeded = MissionResult.SUCCEEDED
    return result in (None, succeeded) and all(each is succeeded for each in last_tries.values())


def touches(pose: Pose2, vehicle: Vehicle, body: Array) -> bool:
    """Whether the vehicle is in contact with what is docked at, an outline (k, 2) in the world [m]."""
    own = shapely.Polygon(body_polygons(np.array([[pose.x, pose.y, pose.phi]]), vehicle)[0])
    return bool(own.distance(shapely.Polygon(body)) <= TOUCHING)


assert set(REQUIRED) == set(OPTIONAL) == set(get_args(Kind))
