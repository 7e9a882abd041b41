"""Recorder: a controller that writes down each of its cycles. Replay: the recorded inputs and decisions once
more, without a clock, compared cycle by cycle. Both drive a cycle by `run_cycle`."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from math import isclose, nan
from os import PathLike
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike

from estimation import GoalMeasurement
from geometry import Area, Pose2
from geometry.pose import unchecked_pose
from rti_mpcc.clock import CycleClock, PlayedBack
from rti_mpcc.errors import InputError
from rti_mpcc.mission import DockingMission
from rti_mpcc.qp.problem import dump_problem
from rti_mpcc.recording.contents import (
    CHANGED,
    Cycle,
    Data,
    Driver,
    Header,
    Inputs,
    as_recorded,
    core_of,
    prepare_codec,
    read_recording,
    to_data,
    to_line,
)
from rti_mpcc.types import Array, Command, Obstacle, VehicleState
from rti_mpcc.version import Machine

_log = logging.getLogger(__name__)

ELSEWHERE = 1e-9  # tolerance on another machine or with other versions
TIMES = frozenset({"prepare_ms", "feedback_ms", "solve_ms", "step_ms"})
"""Diagnostics of how long something took: never the same twice."""
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
        header = Header(
            machine=Machine.here(),
            config=core.config,
            path=core.state.path,
            corridor=core.corridor,
            steps=None if mission is None else mission.steps,
            home=None if mission is None else mission.home,
        )
        self._write(header)

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
            orders |= {"cancelled": driver.cancelling, "signal": driver.signalled(signal)}
        detections = () if measurements is None else measurements
        inputs = Inputs(
            state=as_recorded(state, VehicleState, VehicleState(nan, nan, nan, nan, nan)),
            now=as_recorded(now, float, nan),
            goal=as_recorded(goal, Pose2 | None, unchecked_pose(nan, nan, nan)),
            measurements=as_recorded(detections, tuple[GoalMeasurement, ...], (_NO_MEASUREMENT,)),
            obstacles=as_recorded(obstacles, tuple[Array | Obstacle, ...] | None, (np.array([nan]),)),
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


class FieldDifference(NamedTuple):
    """A field such as command.trajectory.states[3][1], of a list the first that differs; None: not there."""

    field: str
    recorded: object
    replayed: object


class Mismatch(NamedTuple):
    """The first cycle that is not as it was recorded: its number, from 0, and its `now` [s].

    `changed` is "", or says that its line was changed after it was recorded; then there may be no `fields`.
    """

    cycle: int
    time: float
    changed: str
    fields: tuple[FieldDifference, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class ReplayReport:
    """The outcome of a replay."""

    cycles: int  # number of compared ones, with the one that differs
    tolerance: float  # of numbers; 0: bit for bit
    same_machine: bool  # the recording was made on such a machine, with the same versions
    complete: bool  # the recording has its end
    mismatch: Mismatch | None  # the first cycle that differs

    @property
    def identical(self) -> bool:
        """No cycle differs."""
        return self.mismatch is None


def replay(
    file: str | PathLike[str],
    *,
    tolerance: float | None = None,
    allow_truncated: bool = False,
    dump_failed: Path | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> ReplayReport:
    """Drive a new controller by a recording and compare commands, diagnostics (but times) and plans.

    Args:
        tolerance: of numbers, absolute up to 1 and relative above; 0: bit for bit. None: that on a machine
            like the recording's with the same versions, 1e-9 elsewhere.
        allow_truncated: replay the whole cycles of a recording that was cut off.
        dump_failed: folder for the QPs of failed cycles, see `dump_problem`.
        progress: called after each cycle with how many are done, and how many there are.

    Raises InputError for a negative tolerance, RecordingError as `read_recording`, but lines may be changed.
    """
    if tolerance is not None and not tolerance >= 0.0:
        raise InputError(f"tolerance = {tolerance}: must be >= 0")
    recording = read_recording(file, allow_truncated=allow_truncated, allow_changed=True)
    same = recording.header.machine == Machine.here()
    if tolerance is None:
        tolerance = 0.0 if same else ELSEWHERE
    if dump_failed is not None:
        dump_failed.mkdir(parents=True, exist_ok=True)
    driver, mismatch, done = recording.header.driver(), None, 0
    for done, cycle in enumerate(recording.cycles, start=1):
        again, _ = run_cycle(driver, cycle.number, cycle.inputs, PlayedBack(cycle.decisions), dump_failed)
        fields = differences(to_data(cycle), to_data(again), tolerance)
        changed = CHANGED if cycle.number in recording.changed else ""
        if progress is not None:
            progress(done, len(recording.cycles))
        if fields or changed:
            mismatch = Mismatch(done - 1, cycle.inputs.now, changed, fields)
            break
    return ReplayReport(
        cycles=done, tolerance=tolerance, same_machine=same, complete=recording.complete, mismatch=mismatch
    )


def differences(recorded: Data, replayed: Data, tolerance: float) -> tuple[FieldDifference, ...]:
    """The differences of JSON data, in the order of their fields, but times; `tolerance` as of `replay`."""
    before, after = dict(_values(recorded)), dict(_values(replayed))
    found: dict[str, FieldDifference] = {}
    for field in before | after:
        one, other = before.get(field), after.get(field)
        if not _near(one, other, tolerance):
            found.setdefault(field.partition("[")[0], FieldDifference(field, one, other))
    return tuple(found.values())


def _values(data: Data, place: str = "") -> Iterator[tuple[str, Data]]:
    """Names and values of all that is no list and no object with entries."""
    if isinstance(data, dict) and data:
        for name, value in data.items():
            if name not in TIMES:
                yield from _values(value, f"{place}.{name}" if place else name)
    elif isinstance(data, list) and data:
        for i, value in enumerate(data):
            yield from _values(value, f"{place}[{i}]")
    else:
        yield place, data


def _near(one: Data, other: Data, tolerance: float) -> bool:
    if repr(one) == repr(other):  # of numbers: the same bits, or both are NaN
        return True
    floats = isinstance(one, float) and isinstance(other, float)
    return tolerance > 0.0 and floats and isclose(one, other, rel_tol=tolerance, abs_tol=tolerance)
