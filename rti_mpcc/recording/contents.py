"""What a recording holds, and one cycle as recorder and replay both drive it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from numpy.typing import ArrayLike

from estimation import GoalMeasurement
from geometry import Area, AreaLines, Corridor, CorridorLines, Pose2, ReferencePath
from rti_mpcc.config import ControllerConfig
from rti_mpcc.docking import DockingController
from rti_mpcc.mission import DockingMission
from rti_mpcc.planning.clock import CycleClock, Decisions
from rti_mpcc.recording import given
from rti_mpcc.recording.lines import FORMAT, VERSION
from rti_mpcc.recording.machine import Machine
from rti_mpcc.recording.steps import MissionData, data_of, step_of
from rti_mpcc.steps import DriveTo
from rti_mpcc.types import Array, Command, VehicleState

Driver = DockingController | DockingMission
"""What can be recorded."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Inputs:
    """All that the controller was told for one cycle.

    Attributes:
        goal_cleared: `clear_goal` was called since the last step; cancelled: so was `cancel` of the mission.
        area: so was `set_area`, with this one; None: it was not.
        signal: what told that the mission's step under way was over said so.
        state, now, goal, measurements, obstacles: as in `DockingController.step`; any of their numbers may
            be not finite.
    """

    goal_cleared: bool
    cancelled: bool
    signal: bool
    state: VehicleState
    now: float
    goal: Pose2 | None
    measurements: tuple[GoalMeasurement, ...]
    obstacles: tuple[Array, ...] | None
    area: AreaLines | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Cycle:
    """One cycle: what came in, what the clock decided, what came out.

    Attributes:
        number: from 0.
        inputs, decisions: see there.
        command: or None if the step raised.
        raised: type and text of what it raised, or "".
    """

    number: int
    inputs: Inputs
    decisions: Decisions
    command: Command | None
    raised: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Header:
    """What a recording begins with: where it was made, and all that its controller was made from.

    Attributes:
        format, version: of the file, see `lines`.
        machine, config, path, corridor: see there; obstacles are those that the corridor began with. In an
            area the path is that of a vehicle that has no way yet.
        mission: that the controller drives; None: it has none.
    """

    format: str
    version: int
    machine: Machine
    config: ControllerConfig
    path: ReferencePath
    corridor: CorridorLines
    mission: MissionData | None = None

    @classmethod
    def of(cls, driver: Driver) -> Header:
        """That of a recording of this controller or mission, which has not stepped yet, made here and now."""
        controller = core_of(driver)
        return cls(
            format=FORMAT,
            version=VERSION,
            machine=Machine.here(),
            config=controller.config,
            path=controller.state.path,
            corridor=controller.corridor.to_lines(),
            mission=_mission_data(driver),
        )

    def driver(self) -> Driver:
        """A new controller like the one that was recorded, with its mission, if it had one."""
        controller = self.controller()
        if self.mission is None:
            return controller
        home = None if self.mission.home is None else step_of(self.mission.home)
        assert home is None or isinstance(home, DriveTo)
        return DockingMission(controller, [step_of(each) for each in self.mission.steps], home=home)

    def controller(self) -> DockingController:
        """A new controller like the one that was recorded, without its mission."""
        corridor = Corridor.from_lines(self.corridor)
        if corridor.area is not None:
            return DockingController.in_area(corridor.area, self.config)
        return DockingController(self.path, corridor, self.config)


def core_of(driver: Driver) -> DockingController:
    """The controller, of a mission the one that drives it."""
    return driver.controller if isinstance(driver, DockingMission) else driver


def _mission_data(driver: Driver) -> MissionData | None:
    if not isinstance(driver, DockingMission):
        return None
    home = None if driver.home is None else data_of(driver.home)
    return MissionData(steps=tuple(map(data_of, driver.steps)), home=home)


@dataclass(frozen=True, slots=True, kw_only=True)
class Recording:
    """A recording that was read: its header, its cycles, and whether its end is there."""

    header: Header
    cycles: tuple[Cycle, ...]
    complete: bool


def inputs_of(
    state: VehicleState,
    *,
    goal_cleared: bool,
    cancelled: bool = False,
    signal: bool = False,
    now: float,
    goal: Pose2 | None,
    measurements: Sequence[GoalMeasurement],
    obstacles: Sequence[ArrayLike] | None,
    area: Area | None = None,
) -> Inputs:
    """The inputs as they come back from a file: numbers, all of them float64; see `given`. Never raises."""
    return Inputs(
        goal_cleared=goal_cleared,
        cancelled=cancelled,
        signal=signal,
        state=given.numbers(state, VehicleState),
        now=given.number(now),
        goal=None if goal is None else given.numbers(goal, Pose2),
        measurements=given.measurements(measurements),
        obstacles=given.outlines(obstacles),
        area=None if area is None else AreaLines(boundary=area.boundary, obstacles=area.obstacles),
    )


def run_cycle(
    driver: Driver, number: int, inputs: Inputs, clock: CycleClock
) -> tuple[Cycle, Exception | None]:
    """Let the controller or mission make one cycle; returns what came of it, and what it raised."""
    command, error = None, None
    told: dict[str, Any] = {
        name: getattr(inputs, name) for name in ("now", "goal", "measurements", "obstacles")
    }
    try:
        if inputs.goal_cleared:
            core_of(driver).clear_goal()
        if inputs.area is not None:
            core_of(driver).set_area(Area(boundary=inputs.area.boundary, obstacles=inputs.area.obstacles))
        if isinstance(driver, DockingMission):
            if inputs.cancelled:
                driver.cancel()
            command = driver.step(inputs.state, **told, clock=clock, signal=inputs.signal)
        else:
            command = driver.step(inputs.state, **told, clock=clock)
    except Exception as raised:  # whatever it is, it is what this cycle came to
        error = raised
    cycle = Cycle(
        number=number,
        inputs=inputs,
        decisions=clock.decisions,
        command=command,
        raised="" if error is None else f"{type(error).__name__}: {error}",
    )
    return cycle, error
