"""Recorder: a controller that writes down each of its cycles."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from contextlib import suppress
from os import PathLike
from pathlib import Path
from types import TracebackType
from typing import BinaryIO, Self

from numpy.typing import ArrayLike

from estimation import GoalMeasurement
from geometry import Area, Pose2
from rti_mpcc.errors import InputError
from rti_mpcc.mission import DockingMission
from rti_mpcc.planning.clock import CycleClock
from rti_mpcc.recording.contents import Driver, Header, core_of, inputs_of, run_cycle
from rti_mpcc.recording.lines import END, to_line
from rti_mpcc.recording.problem_file import dump_if_failed
from rti_mpcc.types import Command, VehicleState

_log = logging.getLogger(__name__)


class Recorder:
    """Steps a controller and writes each cycle to a file, which `replay` drives again.

    The controller is told what the recording says: numbers of other types reach it as float64, and what is
    no number as NaN. Orders that it is given by others than its mission are not recorded. The command is
    handed back after its line was written, and its QP if that is dumped: a slow disk makes it late, which no
    deadline counts. Writing never stops the controller: if the file cannot be written any more, that is
    logged and the vehicle is driven on without it. So is it after `close`.

    Args:
        controller: or a mission, which has not stepped yet.
        file: to write; what it holds is replaced.
        dump_failed: folder for the QPs of failed cycles, see `dump_problem`; None: they are not kept.

    Attributes:
        problem: why the file does not hold all cycles, or "".

    Raises:
        InputError: the controller has stepped before.
        OSError: the file or the folder cannot be made.
    """

    def __init__(
        self, controller: Driver, file: str | PathLike[str], *, dump_failed: Path | None = None
    ) -> None:
        core = core_of(controller)
        if core.segments is not None:
            raise InputError("controller: a recording does not know segments that were given to it")
        if core.has_stepped:
            raise InputError("controller: has stepped before, a recording must begin with its first cycle")
        header = Header.of(controller)
        if dump_failed is not None:
            dump_failed.mkdir(parents=True, exist_ok=True)
        self.controller = controller
        self._dumps = dump_failed
        self._number = 0
        self._goal_cleared = False
        self.problem = ""
        self._area: Area | None = None
        self._file: BinaryIO | None = open(file, "wb")  # noqa: SIM115
        self._write(header)

    def step(
        self,
        state: VehicleState,
        *,
        now: float,
        goal: Pose2 | None = None,
        measurements: Sequence[GoalMeasurement] = (),
        obstacles: Sequence[ArrayLike] | None = None,
        clock: CycleClock | None = None,
        signal: bool | None = None,
    ) -> Command:
        """One cycle, recorded. Arguments, result and errors are those of what is recorded."""
        driver = self.controller
        mission = driver if isinstance(driver, DockingMission) else None
        clock = clock or CycleClock(core_of(driver).config.deadline)
        inputs = inputs_of(
            state,
            now=now,
            goal=goal,
            goal_cleared=self._goal_cleared,
            cancelled=mission is not None and mission.cancelling,
            signal=mission is not None and mission.told(signal),
            measurements=measurements,
            obstacles=obstacles,
            area=self._area,
        )
        self._goal_cleared, self._area = False, None
        cycle, error = run_cycle(driver, self._number, inputs, clock)
        self._number += 1
        self._write(cycle)
        if self._dumps is not None:
            try:
                dump_if_failed(core_of(driver), cycle, self._dumps)
            except OSError as problem:
                _log.error("the QP of cycle %d was not written: %s", cycle.number, problem)
        if cycle.command is None:
            assert error is not None
            raise error
        return cycle.command

    def clear_goal(self) -> None:
        """Forget the goal and its detections; takes effect, and is recorded, with the next step."""
        self._goal_cleared = True

    def set_area(self, area: Area) -> None:
        """Replace the area; takes effect, and is recorded, with the next step.

        Raises:
            InputError: as `DockingController.set_area`.
        """
        core_of(self.controller).check_area(area)
        self._area = area

    def cancel(self) -> None:
        """Cancel the mission, if it has one; takes effect, and is recorded, with the next step."""
        if isinstance(self.controller, DockingMission):
            self.controller.cancel()

    def close(self) -> None:
        """Write the end mark. Cycles after that are not recorded."""
        self._write({END: self._number})
        file, self._file = self._file, None
        if file is not None:
            try:
                file.close()
            except OSError as error:  # some systems say it only now
                self._ended(error)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _write(self, content: object) -> None:
        """Write a line through to the system, so that a crash of this process loses none before it."""
        if self._file is None:
            return
        try:
            self._file.write(to_line(content))
            self._file.flush()
        except (OSError, ValueError) as error:  # the latter of text that UTF-8 cannot write
            self._ended(error)
            file, self._file = self._file, None
            with suppress(OSError):  # what was left to write cannot be
                file.close()

    def _ended(self, error: Exception) -> None:
        self.problem = str(error)
        _log.error("recording has ended, its file cannot be written: %s", error)
