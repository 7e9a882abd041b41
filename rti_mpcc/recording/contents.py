"""A recording: what it holds, how that becomes text, and reading it from a file.

A recording is a JSON Lines file: a header, a line a cycle, an end mark. Values become JSON, and values of the
same kind again, by the type hints of their dataclasses; numbers keep every bit. The last entry "crc" of a
line is the CRC-32, in hexadecimal, of the text before. One sentence says what is wrong with a file.
"""

from __future__ import annotations

from codecs import BOM_UTF8
from dataclasses import dataclass
from os import PathLike
from typing import Any, TypeVar
from zlib import crc32

import numpy as np
from cattrs import BaseValidationError, transform_error
from cattrs.preconf.json import make_converter
from cattrs.v import format_exception
from numpy.typing import ArrayLike

from estimation import GoalMeasurement
from geometry import Area, Corridor, Pose2, ReferencePath
from geometry.arrays import is_array, locked
from geometry.files import RECORDING, content, from_json
from geometry.pose import unchecked_pose
from geometry.settings import Settings
from rti_mpcc.clock import Decisions
from rti_mpcc.config import ControllerConfig
from rti_mpcc.docking import DockingController
from rti_mpcc.errors import InputError, RecordingError
from rti_mpcc.mission import DockingMission, DriveTo
from rti_mpcc.mission.step import STEPS, Signal, Step
from rti_mpcc.qp.solver import Stop
from rti_mpcc.types import Array, Command, Obstacle, VehicleState
from rti_mpcc.version import Machine

T = TypeVar("T")
Data = Any  # what `json` reads: dicts, lists, strings, numbers, booleans, None

FORMAT = "rti-mpcc recording"
VERSION = 9  # of the format; grows with every change that older or newer programs could not read
CHANGED = "its line was changed after it was recorded"

Driver = DockingController | DockingMission  # whatever can be recorded


def core_of(driver: Driver) -> DockingController:
    """The controller; of a mission the one that drives it."""
    return driver.controller if isinstance(driver, DockingMission) else driver


@dataclass(frozen=True, slots=True, kw_only=True)
class Inputs:
    """All that the controller was given for one cycle, see `DockingController.step`; perhaps not finite."""

    state: VehicleState
    now: float
    goal: Pose2 | None
    measurements: tuple[GoalMeasurement, ...]
    obstacles: tuple[Array | Obstacle, ...] | None
    goal_cleared: bool = False  # `clear_goal` was called since the last step
    area: Area | None = None  # given to `set_area` since the last step
    cancelled: bool = False  # the mission was, since the last step
    signal: bool = False  # the signal that the mission's step waits for


@dataclass(frozen=True, slots=True, kw_only=True)
class Cycle:
    """One cycle, its number from 0: the inputs, the clock's decisions, the command.

    Of a step that raised there is no command, and `raised` is type and text of its error; else it is "".
    """

    number: int
    inputs: Inputs
    decisions: Decisions
    command: Command | None
    raised: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Header:
    """The first line of a recording: where it was made, and all that its controller was made from."""

    format: str = FORMAT
    version: int = VERSION
    machine: Machine
    config: ControllerConfig
    path: ReferencePath  # in an area that of a vehicle that has no route yet
    corridor: Corridor  # with its first obstacles
    steps: tuple[Step, ...] | None = None  # of the mission, None without one
    home: DriveTo | None = None  # of the mission

    def driver(self) -> Driver:
        """A new controller like the recorded one, with its mission, if it had one."""
        if self.corridor.area is None:
            core = DockingController(self.path, self.corridor, self.config)
        else:
            core = DockingController.in_area(self.corridor.area, self.config)
        return core if self.steps is None else DockingMission(core, self.steps, home=self.home)


@dataclass(frozen=True, slots=True, kw_only=True)
class Recording:
    """A recording that was read."""

    header: Header
    cycles: tuple[Cycle, ...]
    complete: bool  # its end is there
    changed: tuple[int, ...] = ()  # numbers of the cycles whose lines were changed afterwards


def read_recording(
    file: str | PathLike[str], *, allow_truncated: bool = False, allow_changed: bool = False
) -> Recording:
    """The recording in a file: its header, and the inputs and commands of its cycles in their order.

    `allow_truncated`: of a file that ends in the middle its whole cycles are returned; `allow_changed`: lines
    that were changed after they were written are read and named in `Recording.changed`.

    Raises RecordingError for a file that cannot be read, is no recording or one of another format, is
    truncated, or has a changed line, unless that is allowed.
    """
    try:
        recording = _recording(content(file, RECORDING), allow_truncated)
        if recording.changed and not allow_changed:
            raise RecordingError(f"cycle {recording.changed[0]}: {CHANGED}")
        return recording
    except OSError as error:
        raise RecordingError(f"{file}: cannot be read, {error.strerror or error}") from error
    except (RecordingError, RecursionError) as error:
        raise RecordingError(f"{file}: {error}") from None


def _recording(whole: bytes, allow_truncated: bool) -> Recording:
    # Cut at line feeds only: one bit makes a minus a carriage return, and that line is still one.
    first, *lines = [line.removesuffix(b"\r") for line in whole.removeprefix(BOM_UTF8).rstrip().split(b"\n")]
    header = _header(first)
    last, intact = from_line(lines[-1]) if lines else ({}, False)
    end = last.get("end") if intact else None
    if not last or "end" in last:  # nothing, half a line, or the end mark
        lines = lines[:-1]
    if end is None and not allow_truncated:
        raise RecordingError(
            f"is truncated: it holds {len(lines)} whole cycles and no end "
            "(replay those with --partial, allow_truncated=True in Python)"
        )
    cycles, changed = [], []
    for number, line in enumerate(lines):
        data, intact = from_line(line)
        if not intact:
            changed.append(number)
        elif data.get("number") != number:
            raise RecordingError(f"cycle {number} is missing, line {number + 2} holds {data.get('number')}")
        cycles.append(_of_line(data, Cycle, f"cycle {number}", intact))
    if end not in (None, len(lines)):
        raise RecordingError(f"holds {len(lines)} cycles, but its end mark says {end}")
    return Recording(header=header, cycles=tuple(cycles), complete=end is not None, changed=tuple(changed))


def _header(line: bytes) -> Header:
    data, intact = from_line(line)
    version = data.get("version")
    if data.get("format") != FORMAT or not isinstance(version, int):
        raise RecordingError("is not a recording of rti-mpcc, its first line is no header")
    if version != VERSION:
        age = "a newer" if version > VERSION else "an older"
        raise RecordingError(f"was written by {age} rti-mpcc (format {version}, this one reads {VERSION})")
    if not intact:
        raise RecordingError("its first line was changed after it was recorded")
    return _of_line(data, Header, "header", intact)


def _of_line(data: dict[str, Any], kind: type[T], name: str, intact: bool) -> T:
    try:
        return structured(data, kind)
    except InputError as error:
        cause = f"was it written by another version of rti-mpcc? {error}" if intact else CHANGED
        raise RecordingError(f"{name}: {cause}") from None


def to_data(value: object) -> Data:
    """The JSON data of a value."""
    return _converter.unstructure(value)


def to_line(value: object) -> bytes:
    """The text of a line, with its checksum and its end."""
    return _sealed(_converter.dumps(value, separators=(",", ":")).encode()[:-1]) + b"\n"


def from_line(line: bytes) -> tuple[dict[str, Data], bool]:
    """The data of a line, and whether its checksum fits; no data if it is no JSON object."""
    try:
        data = from_json(line.decode())
    except ValueError:
        data = None
    if not isinstance(data, dict):
        return {}, False
    data.pop("crc", None)
    return data, line == _sealed(line[: -len(_sealed(b""))])


def structured(data: Data, kind: type[T]) -> T:
    """The value of a kind that JSON data describe. Raises InputError, which names the place of each fault."""
    try:
        value: T = _converter.structure(data, kind)
    except BaseValidationError as error:
        raise InputError("; ".join(transform_error(error, format_exception=_explained))) from None
    return value


def _explained(error: BaseException, kind: type | None) -> str:
    """What is wrong with a value, in the words of this project where it has said so."""
    return str(error) if isinstance(error, InputError) else format_exception(error, kind)


def prepare_codec(*kinds: Any) -> None:
    """Generate the code that writes and reads these kinds: the first value would do it in a cycle."""
    for kind in kinds:
        _converter.get_unstructure_hook(kind)
        _converter.get_structure_hook(kind)


def as_recorded(value: object, kind: Any, instead: T) -> T:
    """Any value as a recording gives it back, or `instead` if a recording cannot hold it. Never raises."""
    try:
        found: T = _converter.structure(_converter.unstructure(value, unstructure_as=kind), kind)
    except Exception:  # whatever comes of looking at an odd value: the cycle has to go on
        return instead
    return found


def _sealed(text: bytes) -> bytes:
    return text + b',"crc":"%08x"}' % crc32(text)


def _to_list(array: ArrayLike | None) -> Data:
    """Nested lists; the shape of an array without entries, which lists would lose."""
    if array is None:
        return None
    array = np.asarray(array, dtype=np.float64)
    return array.tolist() if array.size else {"shape": array.shape}


def _to_array(data: Data, _: object) -> Array | None:
    if data is None:  # of a covariance or a body
        return None
    return locked(np.zeros(data["shape"]) if isinstance(data, dict) else np.array(data, dtype=np.float64))


def _from_obstacle(given: ArrayLike | Obstacle) -> Data:
    return to_data(given) if isinstance(given, Obstacle) else _to_list(given)


def _to_obstacle(data: Data, kind: object) -> Array | Obstacle | None:
    bare = not (isinstance(data, dict) and "polygon" in data)
    return _to_array(data, kind) if bare else structured(data, Obstacle)


def _to_step(data: Data, _: object) -> Step:
    if data["step"] not in STEPS:
        raise InputError(f"step {data['step']!r} is not known: import the module that defines it")
    return structured({name: each for name, each in data.items() if name != "step"}, STEPS[data["step"]])


def _is_array(kind: Any) -> bool:
    return is_array(kind) or kind == ArrayLike or kind == ArrayLike | None


_converter = make_converter(forbid_extra_keys=True)
for _kind in (bool, int, float):
    _converter.register_unstructure_hook(_kind, _kind)  # NumPy's are no JSON
_converter.register_structure_hook(Pose2, lambda data, _: unchecked_pose(**data))
# The library doesn't read the hints of named tuples.
_converter.register_structure_hook(Stop, lambda data, _: Stop(*_converter.structure(data, tuple[str, int])))
for _fits, _to, _back in (
    (_is_array, _to_list, _to_array),
    (lambda kind: kind == Array | Obstacle, _from_obstacle, _to_obstacle),
    (
        lambda kind: isinstance(kind, type) and issubclass(kind, Settings),
        lambda group: group.model_dump(mode="json"),
        lambda data, kind: kind(**data),
    ),
    (lambda kind: kind is Step, lambda step: {"step": step.word, **to_data(step)}, _to_step),
    (  # `until` of a step: a recording holds that there is one, and each cycle its answer
        lambda kind: kind == Signal | None,
        lambda until: until is not None,
        lambda given, _: (lambda: False) if given else None,
    ),
    (
        lambda kind: kind is Area,
        lambda area: to_data({"boundary": area.boundary, "obstacles": area.obstacles}),
        lambda data, _: Area(**data),
    ),
):
    _converter.register_unstructure_hook_func(_fits, _to)
    _converter.register_structure_hook_func(_fits, _back)
