"""What a recording holds, and one cycle as recorder and replay both drive it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from numpy.typing import ArrayLike

from estimation import GoalMeasurement
from geometry import Corridor, CorridorLines, Pose2, ReferencePath
from rti_mpcc.config import ControllerConfig
from rti_mpcc.docking import DockingController
from rti_mpcc.planning.clock import CycleClock, Decisions
from rti_mpcc.recording import given
from rti_mpcc.recording.lines import FORMAT, VERSION
from rti_mpcc.recording.machine import Machine
from rti_mpcc.types import Array, Command, VehicleState


@dataclass(frozen=True, slots=True, kw_only=True)
class Inputs:
    """All that the controller was told for one cycle.

    Attributes:
        goal_cleared: `clear_goal` was called since the last step.
        state, now, goal, measurements, obstacles: as in `DockingController.step`; any of their numbers may
            be not finite.
    """

    goal_cleared: bool
    state: VehicleState
    now: float
    goal: Pose2 | None
    measurements: tuple[GoalMeasurement, ...]
    obstacles: tuple[Array, ...] | None


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
    """

    format: str
    version: int
    machine: Machine
    config: ControllerConfig
    path: ReferencePath
    corridor: CorridorLines

    @classmethod
    def of(cls, controller: DockingController) -> Header:
        """That of a recording of this controller, which has not stepped yet, made here and now."""
        return cls(
            format=FORMAT,
            version=VERSION,
            machine=Machine.here(),
            config=controller.config,
            path=controller.state.path,
            corridor=controller.corridor.to_lines(),
        )

    def controller(self) -> DockingController:
        """A new controller like the one that was recorded."""
        corridor = Corridor.from_lines(self.corridor)
        if corridor.area is not None:
            return DockingController.in_area(corridor.area, self.config)
        return DockingController(self.path, corridor, self.config)


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
    now: float,
    goal: Pose2 | None,
    measurements: Sequence[GoalMeasurement],
    obstacles: Sequence[ArrayLike] | None,
) -> Inputs:
    """The inputs as they come back from a file: numbers, all of them float64; see `given`. Never raises."""
    return Inputs(
        goal_cleared=goal_cleared,
        state=given.numbers(state, VehicleState),
        now=given.number(now),
        goal=None if goal is None else given.numbers(goal, Pose2),
        measurements=given.measurements(measurements),
        obstacles=given.outlines(obstacles),
    )


def run_cycle(
    controller: DockingController, number: int, inputs: Inputs, clock: CycleClock
) -> tuple[Cycle, Exception | None]:
    """Let the controller make one cycle; returns what came of it, and what it raised."""
    command, error = None, None
    try:
        if inputs.goal_cleared:
            controller.clear_goal()
        command = controller.step(
            inputs.state,
            now=inputs.now,
            goal=inputs.goal,
            measurements=inputs.measurements,
            obstacles=inputs.obstacles,
            clock=clock,
        )
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
