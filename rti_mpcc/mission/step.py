"""What all steps of a mission have: their common fields, how they start, and how their outcome is judged.

A step is one file: a frozen dataclass that extends `DrivingStep`, or `Step` where it does not drive. Its
`word` names it in scenario files, recordings and reports. Its fields are its keys in a `[[mission]]` table; a
file can give numbers, texts, truth values, poses and approaches, and `contact = true` for a signal.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from math import inf
from typing import ClassVar, Literal, NamedTuple

from geometry import Area, InputError, Pose2
from geometry.validation import Validated, validate
from rti_mpcc.config import ControllerConfig
from rti_mpcc.course import route_start
from rti_mpcc.mission.state import MissionState, PendingStep
from rti_mpcc.orders import Order
from rti_mpcc.state import ControllerState
from rti_mpcc.types import Array, Command, MissionResult, Reason, Status

Then = Literal["stop", "continue", "home"]
"""Continuation after a step that failed for good: none, the next step, or the route home."""
Signal = Callable[[], bool]
"""Asked once a cycle."""

LONGEST = 100.0
"""Largest distance of a straight move or an undocking [m]: one cycle checks all of it."""
THREE = "must be three numbers > 0: [m], [m], [rad]"
TROUBLE = {
    Status.STALLED: MissionResult.NOT_REACHED,
    Status.GOAL_BEHIND: MissionResult.NOT_REACHED,
    Status.FAILED: MissionResult.NOT_REACHED,
    Status.GOAL_REJECTED: MissionResult.NOT_REACHED,
    Status.BLOCKED: MissionResult.BLOCKED,
    Status.SEARCHING: MissionResult.NOT_DETECTED,
    Status.GOAL_LOST: MissionResult.NOT_DETECTED,
}
"""Result of a step whose status stays like this."""
UNDECIDED = (Status.PLANNING, Status.STARTING)
"""They follow on trouble, and on none: what was known before holds."""


class Started(NamedTuple):
    """The start of a step.

    Attributes:
        mission_state: afterwards; order: for the controller, None: it continues.
        goal: pose that the step is to end in, or None; dock: that this is known by, or None.
        problem: why it cannot be started, or "".
    """

    mission_state: MissionState
    order: Order | None = None
    goal: Pose2 | None = None
    dock: Pose2 | None = None
    problem: str = ""


class StepStart(NamedTuple):
    """What a step is started with.

    Attributes:
        mission_state: with it as the first of its steps; s: of the controller; config: its settings.
        area: all that is solid, as far as it is known; None: the controller plans no routes.
    """

    mission_state: MissionState
    s: ControllerState
    config: ControllerConfig
    area: Area | None

    @property
    def here(self) -> Pose2:
        """Pose of the vehicle, averaged at rest."""
        return route_start.here(self.s, self.config)


class MissionCycle(NamedTuple):
    """A cycle by which a step is judged.

    Attributes:
        command: of the cycle; signal: whether `until` of the step says that it is over.
        now: on the controller's own clock [s]; settled: time at its end after which it has succeeded [s].
    """

    command: Command
    signal: bool
    now: float
    settled: float


class StepOutcome(NamedTuple):
    """Result of a step, and why, or ""; the mission with what was noted of it."""

    mission_state: MissionState
    result: MissionResult
    reason: str = ""


class Next(NamedTuple):
    """The mission after a step has ended, and the order that ends it, or None."""

    mission_state: MissionState
    order: Order | None = None


STEPS: dict[str, type[Step]] = {}
"""Kinds of steps by their words, in the order in which they were defined."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Step(Validated):
    """A step of a mission. A value out of its range is refused with an `InputError`.

    Attributes:
        timeout: time after which the step has failed [s].
        patience: and the time without progress [s]: blocked, without a plan or route, or the goal not seen.
        retries: number of times that it is tried again.
        retry_from: place in the mission of the step from which it is tried again, an earlier one or its own;
            None: its own.
        then: continuation after it has failed for good.
        word: its name in files and reports; from_rest: it starts only when the vehicle stands.
        keys: names of the fields that a scenario file may give; None: all that a file can hold.
        at_goal: a scenario gives it its goal as `pose`, and what stands there as `body`.
    """

    word: ClassVar[str] = ""
    from_rest: ClassVar[bool] = False
    keys: ClassVar[tuple[str, ...] | None] = None
    at_goal: ClassVar[bool] = False
    timeout: float = inf
    patience: float = 15.0
    retries: int = 0
    retry_from: int | None = None
    then: Then = "stop"

    def __init_subclass__(cls) -> None:
        # Not super(): a dataclass with slots is made twice.
        Validated.__init_subclass__.__func__(cls)  # type: ignore[attr-defined]
        word = vars(cls).get("word", "")
        known = STEPS.get(word)
        if known is not None and (known.__module__, known.__qualname__) != (cls.__module__, cls.__qualname__):
            raise InputError(f"{cls.__qualname__}.word = {word!r}: is the word of {known.__qualname__}")
        if word:
            STEPS[word] = cls

    def __post_init__(self) -> None:
        validate(self)
        for name in ("timeout", "patience"):
            refuse_unless(getattr(self, name) > 0.0, self, name, "must be > 0")
        for name in ("retries", "retry_from"):
            refuse_unless((getattr(self, name) or 0) >= 0, self, name, "must be a whole number >= 0")
        self._check()

    def _check(self) -> None:
        """Refuse values of its own fields."""

    # -- what the mission has to know before -----------------------------------------------------------

    @property
    def detects(self) -> bool:
        """Whether the controller needs detections of the goal."""
        return False

    @property
    def takes_goal(self) -> bool:
        """Whether the goal that `DockingMission.step` is given is its end."""
        return False

    @property
    def needs_routes(self) -> bool:
        """Whether it needs a controller that plans routes."""
        return not self.takes_goal

    @property
    def body_at_pose(self) -> Array | None:
        """Outline (k, 2) of the object at its end [m], from the start of the mission on; None: not known."""
        return None

    # -- what it does ------------------------------------------------------------------------------------

    def start(self, at: StepStart) -> Started:
        """Start it: give the controller its order, or say why not."""
        raise NotImplementedError

    def observed(self, mission_state: MissionState, s: ControllerState) -> MissionState:
        """The mission after a cycle of the controller, before it is judged."""
        return mission_state

    def judged(self, mission_state: MissionState, cycle: MissionCycle) -> StepOutcome:
        """Its outcome after a cycle."""
        raise NotImplementedError

    def timed_out(self, mission_state: MissionState, now: float) -> StepOutcome:
        """RUNNING, or TIMED_OUT after its timeout."""
        assert mission_state.started is not None
        if now - mission_state.started >= self.timeout:
            return StepOutcome(mission_state, MissionResult.TIMED_OUT, f"not over after {self.timeout:g} s")
        return StepOutcome(mission_state, MissionResult.RUNNING)

    def succeeded(self, mission_state: MissionState, direction: int) -> Next:
        """After it has succeeded; `direction`: +1 or -1, in which the vehicle drove last."""
        return Next(mission_state)

    def another_try(self, outcome: StepOutcome) -> Next | None:
        """Where it goes on by itself after a failure, or None."""
        return None

    def before_retry(
        self, pending: PendingStep, mission_state: MissionState, back_off: float
    ) -> tuple[PendingStep, ...]:
        """The steps that repeat this one, itself the last. `back_off`: least way out of a dock before [m]."""
        return (pending,)


COMMON = tuple(each.name for each in fields(Step))
"""Names of the fields of all steps."""


class DrivingStep(Step):
    """A step that ends where the vehicle stands in the tolerance of its goal."""

    __slots__ = ()

    def judged(self, mission_state: MissionState, cycle: MissionCycle) -> StepOutcome:
        """SUCCEEDED once the vehicle has stood at its end; failed where its trouble lasts."""
        command, now = cycle.command, cycle.now
        mission_state = _noted(mission_state, command, now)
        if cycle.signal:
            return StepOutcome(mission_state, MissionResult.SUCCEEDED, "ended by its signal")
        if mission_state.docked_since is not None and now - mission_state.docked_since >= cycle.settled:
            return StepOutcome(mission_state, MissionResult.SUCCEEDED)
        if mission_state.trouble is not None and now - mission_state.trouble_since >= self.patience:
            return StepOutcome(mission_state, mission_state.trouble, command.diagnostics.reason)
        return self.timed_out(mission_state, now)


def _noted(mission_state: MissionState, command: Command, now: float) -> MissionState:
    """With the time since which the vehicle stands at the end of the step, or makes no progress."""
    since = mission_state.docked_since if mission_state.docked_since is not None else now
    mission_state = replace(mission_state, docked_since=since if command.docked else None)
    trouble = TROUBLE.get(command.status)
    if trouble is not None:
        since = now if mission_state.trouble is None else mission_state.trouble_since
        return replace(mission_state, trouble=trouble, trouble_since=since)
    if command.status in UNDECIDED and command.diagnostics.cause is not Reason.TURNS_WHEELS:
        return mission_state
    return replace(mission_state, trouble=None)


def check_distance(distance: float, where: object) -> None:
    """Refuse a distance along the route."""
    allowed = f"must not be 0, and at most {LONGEST:g} m either way"
    refuse_unless(0.0 < abs(distance) <= LONGEST, where, "distance", allowed)


def all_positive(values: tuple[float, ...] | None) -> bool:
    """Whether numbers are positive and finite, or None."""
    return values is None or all(0.0 < value < inf for value in values)


def refuse_unless(good: bool, where: object, name: str, allowed: str) -> None:
    """Raise InputError for the value of a field that is not allowed."""
    if not good:
        raise InputError(f"{type(where).__name__}.{name} = {getattr(where, name)!r}: {allowed}")
