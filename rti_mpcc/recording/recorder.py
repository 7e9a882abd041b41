"""Recorder: a controller that writes down each of its cycles; and one cycle as it and `replay` drive it."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from contextlib import suppress
from math import nan
from os import PathLike
from pathlib import Path
from typing import Any, BinaryIO, Self

import numpy as np
from numpy.typing import ArrayLike

from estimation import GoalMeasurement
from geometry import Area, Pose2
from geometry.pose import unchecked_pose
from rti_mpcc.errors import InputError
from rti_mpcc.mission import DockingMission
from rti_mpcc.planning.clock import CycleClock
from rti_mpcc.qp.problem import dump_problem
from rti_mpcc.recording.codec import as_recorded, prepare_codec, to_line
from rti_mpcc.recording.contents import Cycle, Driver, Header, Inputs, core_of
from rti_mpcc.types import Array, Command, VehicleState
from rti_mpcc.version import Machine

_log = logging.getLogger(__name__)

_NO_MEASUREMENT = GoalMeasurement(stamp=nan, x=nan, y=nan, phi=nan)


class Recorder:
    """Steps a controller, or a mission, and writes each cycle to a file, which `replay` drives again.

    The controller is given what the recording holds: numbers of other types reach it as float64, and NaN for
    whatever is none. Orders that it is given by others than its mission are not recorded. The command is
    returned after its line was written: a slow disk makes it late, which no deadline counts. Writing never
    stops the controller: if it fails, `problem` says why, and the vehicle is driven on without it. The QPs of
    failed cycles go to the folder `dump_failed`, see `dump_problem`.

    Raises InputError for a controller that has stepped before, OSError if file or folder cannot be made.
    """

    def __init__(
        self, controller: Driver, file: str | PathLike[str], *, dump_failed: Path | None = None
    ) -> None:
        core = core_of(controller)
        if core.segments is not None:
            raise InputError("controller: a recording does not know segments that were given to it")
        if core.has_stepped:
            raise InputError("controller: has stepped before, a recording must begin with its first cycle")
        if dump_failed is not None:
            dump_failed.mkdir(parents=True, exist_ok=True)
        self.controller, self.problem = controller, ""
        self._dumps, self._number = dump_failed, 0
        self._orders: dict[str, Any] = {}  # what is called between two steps
        prepare_codec(
            Cycle, VehicleState, Pose2 | None, tuple[GoalMeasurement, ...], tuple[Array, ...] | None, Area
        )
        self._file: BinaryIO | None = open(file, "wb")  # noqa: SIM115
        mission = controller if isinstance(controller, DockingMission) else None
        self._write(
            Header(
                machine=Machine.here(),
                config=core.config,
                path=core.state.path,
                corridor=core.corridor,
                steps=None if mission is None else mission.steps,
                home=None if mission is None else mission.home,
            )
        )

    def step(
        self,
        state: VehicleState,
        *,
        now: float,
        goal: Pose2 | None = None,
        measurements: Sequence[GoalMeasurement] | None = (),
        obstacles: Sequence[ArrayLike] | None = None,
        clock: CycleClock | None = None,
        signal: bool | None = None,
    ) -> Command:
        """One cycle, recorded. Arguments, result and errors are those of the recorded controller."""
        driver = self.controller
        orders, self._orders = self._orders, {}
        if isinstance(driver, DockingMission):
            orders |= {"cancelled": driver.cancelling, "signal": driver.told(signal)}
        detections = () if measurements is None else measurements
        inputs = Inputs(
            state=as_recorded(state, VehicleState, VehicleState(nan, nan, nan, nan, nan)),
            now=as_recorded(now, float, nan),
            goal=as_recorded(goal, Pose2 | None, unchecked_pose(nan, nan, nan)),
            measurements=as_recorded(detections, tuple[GoalMeasurement, ...], (_NO_MEASUREMENT,)),
            obstacles=as_recorded(obstacles, tuple[Array, ...] | None, (np.array([nan]),)),
            **orders,
        )
        clock = clock or CycleClock(core_of(driver).config.deadline)
        cycle, error = run_cycle(driver, self._number, inputs, clock, self._dumps)
        self._number += 1
        self._write(cycle)
        if error is not None:
            raise error
        assert cycle.command is not None
        return cycle.command

    def clear_goal(self) -> None:
        """As `DockingController.clear_goal`; takes effect, and is recorded, with the next step."""
        self._orders["goal_cleared"] = True

    def set_area(self, area: Area) -> None:
        """As `DockingController.set_area`; takes effect, and is recorded, with the next step."""
        core_of(self.controller).check_area(area)
        self._orders["area"] = as_recorded(area, Area, area)

    def cancel(self) -> None:
        """As `DockingMission.cancel`, of a controller without effect; it is recorded with the next step."""
        if isinstance(self.controller, DockingMission):
            self.controller.cancel()

    def close(self) -> None:
        """Write the end mark. Cycles after that are not recorded."""
        self._write({"end": self._number}, last=True)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _write(self, content: object, *, last: bool = False) -> None:
        """Write a line through to the system, so that a crash of this process loses none before it."""
        file = self._file
        if file is None:
            return
        try:
            file.write(to_line(content))
            file.flush()
            if last:  # some systems say only now that nothing was kept
                file.close()
        except Exception as error:
            last, self.problem = True, str(error)
            _log.error("recording has ended, its file cannot be written: %s", error)
            with suppress(OSError):  # what was left to write cannot be
                file.close()
        self._file = None if last else file


def run_cycle(
    driver: Driver, number: int, inputs: Inputs, clock: CycleClock, dumps: Path | None = None
) -> tuple[Cycle, Exception | None]:
    """Let the controller or mission make one cycle; returns the cycle, and the error that it raised.

    The QP of a cycle that fails goes to the folder `dumps`, if there is one.
    """
    command, error, core = None, None, core_of(driver)
    given = {name: getattr(inputs, name) for name in ("now", "goal", "measurements", "obstacles")}
    try:
        if inputs.goal_cleared:
            core.clear_goal()
        if inputs.area is not None:
            core.set_area(inputs.area)
        if isinstance(driver, DockingMission):
            given["signal"] = inputs.signal
            if inputs.cancelled:
                driver.cancel()
        command = driver.step(inputs.state, clock=clock, **given)
    except Exception as raised:  # whatever it is, it belongs to the recording
        error = raised
    said = "" if error is None else f"{type(error).__name__}: {error}"
    cycle = Cycle(number=number, inputs=inputs, decisions=clock.decisions, command=command, raised=said)
    status = command.diagnostics.solver_status if command is not None and command.diagnostics.failed else ""
    if dumps is not None and status:
        settings = core.config.solver.model_dump_json()
        about = {"settings": settings, "cycle": number, "time": inputs.now, "status": status}
        try:
            dump_problem(dumps / f"qp_{number:06d}.npz", core.problem(), **about)
        except OSError as problem:
            _log.error("the QP of cycle %d was not written: %s", number, problem)
    return cycle, error
