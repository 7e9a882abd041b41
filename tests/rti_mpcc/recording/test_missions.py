"""A mission is recorded and replayed as a controller is, with what told that its steps were over."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from fractions import Fraction
from functools import partial
from math import nan, pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from estimation import CharucoBoard
from geometry import Area, Corridor, InputError, Pose2, ReferencePath
from rti_mpcc import ControllerConfig, DockingController
from rti_mpcc.mission import DockingMission
from rti_mpcc.recording import Recorder, read_recording, replay
from rti_mpcc.recording.codec import structured
from rti_mpcc.recording.lines import from_line, to_line
from rti_mpcc.recording.steps import StepData, data_of, played_back, step_of
from rti_mpcc.simulation.plant import PlantParameters, PlantState, advance, issue
from rti_mpcc.steps import AnyStep, Approach, Dock, DockKind, DriveTo, Step, Straight, Undock, Wait
from rti_mpcc.types import MissionResult
from tests.rti_mpcc.mission_runs import CANCELLED, RUNNING, SUCCEEDED, TIMED_OUT, results
from tests.rti_mpcc.recording.recordings import change

CONFIG = ControllerConfig(dead_time=0.1)
START = PlantState(x=0.0, y=0.0, phi=0.0)
BODY = ((-4.0, -1.0), (-2.5, -1.0), (-2.5, 1.0))
COMMON: dict[str, Any] = {
    "timeout": 60.0, "patience": 9.0, "retries": 2, "retry_from": 0, "then": "continue"
}  # fmt: skip
STEPS: tuple[AnyStep, ...] = (
    Dock(
        Pose2(1.0, 2.0, 0.5 * pi), name="ä", kind=DockKind.CHARUCO,
        board=CharucoBoard(first_marker=7, x=-1 / 3), approach=Approach(2.0, -1),
        tolerance=(0.04, 0.02, 0.01), body=BODY, uncertainty=(0.8, 1 / 9),
        contact=Straight(
            -1.0, speed=0.1, steering=1 / 30, tolerance=(0.01, 0.02), until=lambda: True, **COMMON
        ),
        **COMMON,
    ),
    Wait(1 / 3, until=lambda: False, **COMMON),
    Straight(-1.5, speed=0.3, steering=0.04, tolerance=(0.03, 0.02), until=lambda: True, **COMMON),
    Undock(-4.0, **COMMON),
    DriveTo(Pose2(5.0, 6.0, 1 / 7), tolerance=(0.1, 0.2, 0.3), **COMMON),
)  # fmt: skip
"""One of each kind, with nothing left as it is where it is not said."""


def begun(steps: Sequence[AnyStep]) -> DockingMission:
    return DockingMission(DockingController.in_area(Area(), CONFIG), steps, home=Pose2(0.0, 0.0, 0.0))


def driven(recorder: Recorder, seconds: float, cancel_at: float | None = None) -> MissionResult:
    """The mission in closed loop for some seconds, or until it is over; what it came to."""
    plant, command, mission = START, None, recorder.controller
    assert isinstance(mission, DockingMission)
    parameters = PlantParameters.of(CONFIG.vehicle, CONFIG.limits, dead_time=CONFIG.dead_time)
    while plant.time < seconds and mission.result is MissionResult.RUNNING:
        if cancel_at is not None and plant.time >= cancel_at:
            recorder.cancel()
            cancel_at = None
        command = recorder.step(plant.measured, now=plant.time)
        plant = issue(
            plant, parameters, acceleration=command.acceleration, steering_rate=command.steering_rate
        )
        plant = advance(plant, parameters, round(plant.time + CONFIG.cycle, 9))
    assert command is not None
    assert command.mission is not None
    return mission.result


def after(count: int, asked: list[int]) -> bool:
    """Whether it was asked so often; keeps it in a list."""
    asked.append(0)
    return len(asked) >= count


def recorded(
    file: Path, steps: Sequence[AnyStep], seconds: float, cancel_at: float | None = None
) -> DockingMission:
    """A mission that was recorded."""
    mission = begun(steps)
    with Recorder(mission, file) as recorder:
        driven(recorder, seconds, cancel_at)
    return mission


DOCK, WAY_OUT = Pose2(3.0, 0.0, 0.0), -4.0
CANCEL_AT = 14.0
"""On the way out [s]."""
STANDS = ((5.0, -1.0), (7.0, -1.0), (7.0, 1.0), (5.0, 1.0))


@pytest.fixture(scope="module")
def eventful(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, DockingMission]:
    """All kinds of steps: a condition, one that is tried again, a contact, and the last one is cancelled."""
    file = tmp_path_factory.mktemp("missions") / "eventful.jsonl"
    steps: list[AnyStep] = [
        Wait(until=partial(after, 10, [])),
        DriveTo(Pose2(9.0, 3.0, 0.0), timeout=0.6, retries=1, then="continue"),
        Dock(DOCK, body=STANDS, approach=Approach(0.5, 1), timeout=60.0),
        Straight(0.6, speed=0.3, until=partial(after, 15, [])),
        Undock(WAY_OUT),
    ]
    return file, recorded(file, steps, 40.0, cancel_at=CANCEL_AT)


# -- the mission in the header --------------------------------------------------------------------------


def assert_same(step: Step, again: Step) -> None:
    """All of its fields are the same; in place of a user's function stands that of a replay."""
    assert type(again) is type(step)
    for field in fields(step):
        one, other = getattr(step, field.name), getattr(again, field.name)
        if isinstance(one, Step):
            assert_same(one, other)
        elif field.name == "until":
            assert other is (None if one is None else played_back)
        elif field.name == "body" and one is not None:
            np.testing.assert_array_equal(np.asarray(one, dtype=np.float64), other, strict=True)
        else:
            assert repr(other) == repr(one), field.name


def back(step: AnyStep) -> AnyStep:
    """Out of a line."""
    data, intact = from_line(to_line(data_of(step)).rstrip())
    assert intact
    return step_of(structured(data, StepData))


@pytest.mark.parametrize("step", STEPS, ids=lambda step: step.word)
def test_each_field_of_each_step_comes_back(step: AnyStep) -> None:
    for field in fields(step):  # what stands here must not be what comes of saying nothing
        assert getattr(step, field.name) is not field.default, field.name
    assert_same(step, back(step))


@pytest.mark.parametrize(
    "step",
    [
        Dock(),
        Wait(0.0),
        Wait(until=lambda: True),
        Straight(1),
        Undock(5e-324),
        DriveTo(DOCK),
        Wait(np.float32(0.1), retries=np.int64(3), timeout=Fraction(1, 3)),  # type: ignore[arg-type]
        Dock(DOCK, approach=Approach(2, -1.0), body=np.array(BODY, dtype=np.float32)),  # type: ignore[arg-type]
        Dock(DOCK, contact=Straight(1.0)),
    ],
    ids=lambda step: step.word,
)
def test_so_does_what_is_told_in_few_words_or_in_other_kinds_of_numbers(step: AnyStep) -> None:
    assert_same(step, back(step))


def test_the_whole_mission_comes_back_from_the_file(tmp_path: Path) -> None:
    home = DriveTo(Pose2(1.0, 2.0, 3.0), tolerance=(0.1, 0.2, 0.3), timeout=5.0)
    mission = DockingMission(DockingController.in_area(Area(), CONFIG), STEPS, home=home)
    Recorder(mission, tmp_path / "run.jsonl").close()
    again = read_recording(tmp_path / "run.jsonl").header.driver()
    assert isinstance(again, DockingMission)
    assert len(again.steps) == len(STEPS)
    for one, other in zip(STEPS, again.steps, strict=True):
        assert_same(one, other)
    assert again.home is not None
    assert_same(home, again.home)
    assert again.controller.config == CONFIG


def test_a_controller_alone_has_no_mission(tmp_path: Path) -> None:
    Recorder(DockingController.in_area(Area(), CONFIG), tmp_path / "run.jsonl").close()
    header = read_recording(tmp_path / "run.jsonl").header
    assert header.mission is None
    assert isinstance(header.driver(), DockingController)


# -- recorded and replayed ------------------------------------------------------------------------------


def test_all_kinds_of_steps_are_replayed_to_the_bit(eventful: tuple[Path, DockingMission]) -> None:
    file, mission = eventful
    assert results(mission.log) == [
        ("wait", 0, 0, SUCCEEDED),
        ("drive_to", 1, 0, TIMED_OUT),
        ("drive_to", 1, 1, TIMED_OUT),
        ("dock", 2, 0, SUCCEEDED),
        ("straight", 3, 0, SUCCEEDED),
        ("undock", 4, 0, CANCELLED),
    ]
    report = replay(file)
    assert (report.identical, report.tolerance, report.complete) == (True, 0.0, True)
    cycles = read_recording(file).cycles
    assert [cycle.number for cycle in cycles if cycle.inputs.cancelled] == [cycles[-1].number]
    assert sum(cycle.inputs.signal for cycle in cycles) == 2
    recorded_log = [cycle.command.mission for cycle in cycles if cycle.command is not None]
    assert [(each.step, each.result) for each in recorded_log if each and each.result is not RUNNING] == [
        (record.place, record.result) for record in mission.log
    ]


def turned(field: str) -> Callable[[dict[str, Any]], object]:
    """An edit of a recorded line that turns around what was told."""

    def edit(data: dict[str, Any]) -> None:
        data["inputs"][field] = not data["inputs"][field]

    return edit


@pytest.mark.parametrize("checked", [False, True], ids=["changed", "forged"])
@pytest.mark.parametrize("field", ["signal", "cancelled"])
def test_a_changed_line_is_found(eventful: tuple[Path, DockingMission], field: str, checked: bool) -> None:
    file, _ = eventful
    cycles = read_recording(file).cycles
    place = next(cycle.number for cycle in cycles if getattr(cycle.inputs, field))
    mismatch = replay(change(file, place, turned(field), checked=checked)).mismatch
    assert mismatch is not None
    assert (mismatch.cycle, bool(mismatch.changed)) == (place, not checked)
    assert "command.mission.result" in [difference.field for difference in mismatch.fields]


def test_what_the_mission_was_said_to_come_to_is_compared(eventful: tuple[Path, DockingMission]) -> None:
    said = MissionResult.BLOCKED.value

    def edit(data: dict[str, Any]) -> None:
        data["command"]["mission"]["result"] = said

    mismatch = replay(change(eventful[0], 3, edit, checked=True)).mismatch
    assert mismatch is not None
    assert [(each.field, each.recorded) for each in mismatch.fields] == [("command.mission.result", said)]


def test_a_mission_is_replayed_to_the_bit(tmp_path: Path) -> None:
    asked: list[int] = []

    def over() -> bool:
        asked.append(0)
        return len(asked) > 20

    steps: list[AnyStep] = [Wait(until=over), Straight(1.0), Wait(0.2), Undock(-2.0)]
    with Recorder(begun(steps), tmp_path / "run.jsonl") as recorder:
        assert driven(recorder, 25.0) is MissionResult.SUCCEEDED
    report = replay(tmp_path / "run.jsonl")
    assert report.identical
    signals = [cycle.inputs.signal for cycle in read_recording(tmp_path / "run.jsonl").cycles]
    assert sum(signals) == 1
    assert len(asked) == 21  # the replay does not ask


def test_a_cancelled_mission_is_replayed(tmp_path: Path) -> None:
    with Recorder(begun([DriveTo(Pose2(12.0, 1.0, 0.0))]), tmp_path / "run.jsonl") as recorder:
        assert driven(recorder, 8.0, cancel_at=4.0) is MissionResult.CANCELLED
    assert replay(tmp_path / "run.jsonl").identical
    cycles = read_recording(tmp_path / "run.jsonl").cycles
    assert [cycle.inputs.now for cycle in cycles if cycle.inputs.cancelled] == pytest.approx([4.0], abs=0.06)


def test_what_told_that_a_step_was_over_matters(tmp_path: Path) -> None:
    file = tmp_path / "run.jsonl"
    with Recorder(begun([Wait(until=lambda: True), Straight(1.0)]), file) as recorder:
        driven(recorder, 1.0)
    cycles = read_recording(file).cycles
    told = next(cycle for cycle in cycles if cycle.inputs.signal)
    mission = read_recording(file).header.driver()
    assert isinstance(mission, DockingMission)
    for cycle in cycles[: told.number + 1]:
        inputs = replace(cycle.inputs, signal=False)
        command = mission.step(inputs.state, now=inputs.now, signal=inputs.signal)
    assert command.mission is not None
    assert command.mission.result is MissionResult.RUNNING
    assert told.command is not None
    assert told.command.mission is not None
    assert told.command.mission.result is MissionResult.SUCCEEDED


def test_the_mission_itself_may_be_cancelled(tmp_path: Path) -> None:
    """Before the recording begins, or past the recorder: it is recorded all the same."""
    mission = begun([Wait(1.0)])
    mission.cancel()
    with Recorder(mission, tmp_path / "run.jsonl") as recorder:
        assert driven(recorder, 1.0) is CANCELLED
    assert [cycle.inputs.cancelled for cycle in read_recording(tmp_path / "run.jsonl").cycles] == [True]
    assert replay(tmp_path / "run.jsonl").identical


def test_a_controller_has_nothing_to_cancel(tmp_path: Path) -> None:
    with Recorder(DockingController.in_area(Area(), CONFIG), tmp_path / "run.jsonl") as recorder:
        recorder.cancel()
        recorder.step(START.measured, now=0.0, goal=DOCK)
    assert replay(tmp_path / "run.jsonl").identical


def raises() -> bool:
    raise KeyError("no such switch")


@pytest.mark.parametrize(
    ("until", "said"),
    [
        (raises, False),
        (lambda: np.array([1.0, 2.0]), False),  # NumPy does not say whether that is true
        (lambda: nan, True),
        (lambda: None, False),
        (lambda: "yes", True),
        (lambda: np.False_, False),
    ],
    ids=["raises", "array", "nan", "none", "text", "numpy"],
)
def test_whatever_a_condition_says_stops_nothing(
    until: Callable[[], Any], said: bool, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    mission = recorded(tmp_path / "run.jsonl", [Wait(until=until, timeout=0.3)], 2.0)
    assert mission.result is (SUCCEEDED if said else TIMED_OUT)
    assert ("`until` of a step raised" in caplog.text) == (until is raises or isinstance(until(), np.ndarray))
    caplog.clear()
    assert replay(tmp_path / "run.jsonl").identical
    assert not caplog.records
    first, second, *later = [cycle.inputs.signal for cycle in read_recording(tmp_path / "run.jsonl").cycles]
    assert (first, second, any(later)) == (False, said, False)


@pytest.mark.parametrize("signal", [True, 1, nan, "x"])
def test_a_signal_takes_the_place_of_the_condition(signal: Any, tmp_path: Path) -> None:
    with Recorder(begun([Wait(until=raises)]), tmp_path / "run.jsonl") as recorder:
        for cycle in range(3):
            command = recorder.step(
                START.measured, now=cycle * CONFIG.cycle, signal=signal if cycle else None
            )
    assert command.mission is not None
    assert command.mission.result is SUCCEEDED
    assert replay(tmp_path / "run.jsonl").identical


def test_silly_inputs_come_back_as_they_were_told(tmp_path: Path) -> None:
    steps: list[AnyStep] = [Wait(0.1), Dock(), DriveTo(DOCK)]
    with Recorder(begun(steps), tmp_path / "run.jsonl") as recorder:
        for cycle in range(12):
            told: dict[str, Any] = {"goal": None if cycle % 3 else bad_pose()}
            if cycle % 4 == 1:
                told["obstacles"] = [[[1.0, 2.0], [nan]]]
            if cycle == 5:
                told["measurements"] = "none at all"
            recorder.step(START.measured, now=nan if cycle == 7 else cycle * CONFIG.cycle, **told)
    assert replay(tmp_path / "run.jsonl").identical


def bad_pose() -> Pose2:
    pose = Pose2(0.0, 0.0, 0.0)
    object.__setattr__(pose, "x", nan)
    return pose


def test_a_mission_on_a_given_path_is_replayed(tmp_path: Path) -> None:
    path = ReferencePath.from_segments(start=Pose2(0.0, 0.0, 0.0), segments=[(1, 0.0, 4.0)])
    controller = DockingController(path, Corridor.from_offsets(path, left=3.0, right=-3.0), CONFIG)
    mission = DockingMission(controller, [Wait(0.2), Dock(), Wait(0.2)])
    with Recorder(mission, tmp_path / "run.jsonl") as recorder:
        assert driven(recorder, 30.0) is SUCCEEDED
    assert replay(tmp_path / "run.jsonl").identical


# -- what is refused ------------------------------------------------------------------------------------


def test_a_mission_that_has_stepped_is_not_recorded(tmp_path: Path) -> None:
    mission = begun([Wait(1.0)])
    mission.step(START.measured, now=0.0)
    again = DockingMission(mission.controller, [Wait(1.0)])
    for each in (mission, again):
        with pytest.raises(InputError, match="must begin with its first cycle"):
            Recorder(each, tmp_path / "run.jsonl")
    assert not (tmp_path / "run.jsonl").exists()


def test_of_a_mission_that_was_never_driven_nothing_is_left(tmp_path: Path) -> None:
    controller = DockingController.in_area(Area(), CONFIG)
    DockingMission(controller, [Dock(Pose2(9.0, 9.0, 0.0), body=STANDS)])
    mission = DockingMission(controller, [Dock(DOCK, body=STANDS)])
    assert len(mission.agenda.bodies) == 1
    with Recorder(mission, tmp_path / "run.jsonl") as recorder:
        driven(recorder, 0.5)
    assert replay(tmp_path / "run.jsonl").identical
