"""A replay comes to the same bit for bit, and whatever was changed is found at its cycle."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from math import inf, nan
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest

from rti_mpcc.config import SolverSettings
from rti_mpcc.docking import DockingController
from rti_mpcc.errors import InputError, RecordingError
from rti_mpcc.recording import Recorder, ReplayReport, read_recording, replay
from rti_mpcc.recording.contents import CHANGED
from rti_mpcc.recording.recorder import TIMES, differences
from rti_mpcc.simulation import changed, docking_controller, simulate
from rti_mpcc.simulation.faults import Kind
from rti_mpcc.types import Command, Diagnostics, VehicleState
from tests.rti_mpcc.recording.recordings import (
    AWAY,
    BACK,
    BEFORE,
    BLIND,
    DETECTED,
    EVENTFUL,
    FAILED,
    LATE,
    SCENARIO,
    UNREADABLE,
    Moody,
    change,
    controller,
    drive,
    eventful,
)

Edit = Callable[[dict[str, Any]], object]


def assert_identical(report: ReplayReport, cycles: int) -> None:
    assert report.mismatch is None
    assert (report.cycles, report.tolerance) == (cycles, 0.0)
    assert report.same_machine
    assert report.complete


def test_a_recording_with_everything_that_may_happen_replays_bit_for_bit(recording: Path) -> None:
    assert_identical(replay(recording), EVENTFUL)


def test_everything_did_happen(recording: Path) -> None:
    cycles = read_recording(recording).cycles
    given = [cycle.inputs for cycle in cycles]
    assert [i for i, inputs in enumerate(given) if inputs.goal_cleared] == [AWAY]
    assert [i for i, inputs in enumerate(given) if inputs.obstacles] == [BEFORE, AWAY, UNREADABLE, LATE - 1]
    assert given[BLIND].state.x != given[BLIND].state.x
    assert given[BACK].now < given[BACK - 1].now
    assert cycles[FAILED[0]].decisions.stops[0] == ("forced to fail", 0)


def test_a_run_with_every_fault_and_a_deadline_replays_bit_for_bit(tmp_path: Path) -> None:
    kinds = get_args(Kind)
    begins = 1.0 + 0.3 * np.arange(len(kinds))
    faults = [
        {"kind": kind, "from": float(begin), "to": float(begin) + 0.2}
        for kind, begin in zip(kinds, begins, strict=True)
    ]
    seconds = float(begins[-1]) + 1.0
    tables = {"faults": faults, "goal.measurement": {}, "simulation.duration": seconds}
    scenario = changed(SCENARIO, tables | {"controller.deadline": 0.006})
    with Recorder(docking_controller(scenario), tmp_path / "faults.jsonl") as recorder:
        simulate(scenario, controller=recorder)
    recorded = read_recording(tmp_path / "faults.jsonl")
    assert len({cycle.command.status for cycle in recorded.cycles if cycle.command}) > 1
    assert_identical(replay(tmp_path / "faults.jsonl"), len(recorded.cycles))


def test_a_clock_of_any_mood_replays_bit_for_bit(tmp_path: Path) -> None:
    random = np.random.default_rng(0)

    def given(cycle: int, state: VehicleState) -> dict[str, Any]:
        return eventful(cycle, state) | {"clock": Moody(random)}

    file = tmp_path / "moody.jsonl"
    precise = SolverSettings(tolerance=1e-8)  # so that QPs take several slices
    with Recorder(controller(solver=precise), file) as recorder:
        drive(recorder, range(60), given)
    decisions = [cycle.decisions for cycle in read_recording(file).cycles]
    assert any(each.late for each in decisions)
    assert any(not all(each.granted) for each in decisions)
    assert any(stop is not None and stop.iterations > 0 for each in decisions for stop in each.stops)
    assert_identical(replay(file), 60)


def edited(change: Callable[[Any], Any], *place: str | int) -> Edit:
    """Replace the value at a place in a line."""

    def edit(data: Any) -> None:
        for name in place[:-1]:
            data = data[name]
        data[place[-1]] = change(data[place[-1]])

    return edit


def put(value: Any, *place: str | int) -> Edit:
    return edited(lambda _: value, *place)


def add(amount: float, *place: str | int) -> Edit:
    return edited(lambda value: value + amount, *place)


def flip(*place: str | int) -> Edit:
    """Flip the last bit of a number."""
    return edited(lambda value: float(np.nextafter(value, np.inf)), *place)


COVARIANCE = ("inputs", "measurements", 0, "covariance", 0, 0)


@pytest.mark.parametrize(
    ("cycle", "edit"),
    [
        (5, flip("inputs", "state", "x")),
        (AWAY, put(False, "inputs", "goal_cleared")),
        (9, put([False], "decisions", "granted")),
    ],
)
def test_one_changed_bit_is_found_at_its_cycle(recording: Path, cycle: int, edit: Edit) -> None:
    report = replay(change(recording, cycle, edit, checked=False))
    assert report.mismatch is not None
    assert report.mismatch.cycle == cycle
    assert report.mismatch.changed == CHANGED
    assert report.cycles == cycle + 1
    with pytest.raises(RecordingError, match=rf"changed\.jsonl: cycle {cycle}: its line was changed"):
        read_recording(recording.with_name("changed.jsonl"))


@pytest.mark.parametrize(
    ("cycle", "edit", "field"),
    [
        (5, add(1e-3, "inputs", "state", "x"), "command.acceleration"),
        (5, flip("inputs", "state", "x"), "command.trajectory.states[0][0]"),
        (6, add(1e-3, "inputs", "now"), "command.acceleration"),
        (7, add(0.5, "inputs", "goal", "y"), "command.acceleration"),
        (DETECTED, add(1e-3, "inputs", "measurements", 0, "x"), "command.diagnostics.goal.pose.x"),
        (DETECTED, add(1e-3, *COVARIANCE), "command.diagnostics.goal.covariance[0][0]"),
        (AWAY, put(False, "inputs", "goal_cleared"), "command.diagnostics.target.x"),
        (9, put([False], "decisions", "granted"), "decisions.stops"),
        (9, put([["forced to fail", 0]], "decisions", "stops"), "command.source"),
        (9, put("braking", "command", "source"), "command.source"),
        (9, flip("command", "speed"), "command.speed"),
        (9, flip("command", "diagnostics", "slack"), "command.diagnostics.slack"),
    ],
)
def test_a_change_with_its_checksum_corrected_is_found_by_what_comes_out(
    recording: Path, cycle: int, edit: Edit, field: str
) -> None:
    mismatch = replay(change(recording, cycle, edit, checked=True)).mismatch
    assert mismatch is not None
    assert (mismatch.cycle, mismatch.changed) == (cycle, "")
    assert field in [difference.field for difference in mismatch.fields]


def test_a_difference_has_its_values_and_its_time(recording: Path) -> None:
    recorded = read_recording(recording).cycles[9].command
    assert recorded is not None
    mismatch = replay(change(recording, 9, add(0.25, "command", "speed"), checked=True)).mismatch
    assert mismatch is not None
    assert mismatch.fields == (("command.speed", recorded.speed + 0.25, recorded.speed),)
    assert mismatch.time == pytest.approx(9 * 0.05)


def test_a_change_that_comes_to_the_same_is_found_by_its_checksum(recording: Path) -> None:
    mismatch = replay(
        change(recording, 9, put(1.0, "command", "diagnostics", "step_ms"), checked=False)
    ).mismatch
    assert mismatch is not None
    assert (mismatch.cycle, mismatch.changed, mismatch.fields) == (9, CHANGED, ())


def test_a_line_that_cannot_be_read_any_more_is_refused(recording: Path) -> None:
    edit = put("a", "inputs", "state")
    with pytest.raises(RecordingError, match=f"cycle 9: {CHANGED}"):
        replay(change(recording, 9, edit, checked=False))
    with pytest.raises(RecordingError, match=r"cycle 9: was it written by another version .* @ \$\.inputs"):
        replay(change(recording, 9, edit, checked=True))


# -- how it is compared ---------------------------------------------------------------------------------


def test_elsewhere_a_tolerance_holds(recording: Path) -> None:
    nearly = change(recording, 9, add(1e-12, "command", "speed"), checked=True)
    assert not replay(nearly).identical
    assert replay(nearly, tolerance=1e-11).identical
    assert not replay(nearly, tolerance=0.0).identical
    for amount, identical in ((1e-12, True), (1e-8, False)):
        differs = change(recording, 9, add(amount, "command", "speed"), checked=True)
        report = replay(change(differs, -1, put("another", "machine", "processor"), checked=True))
        assert (report.identical, report.tolerance, report.same_machine) == (identical, 1e-9, False)


@pytest.mark.parametrize("tolerance", [-1e-9, nan])
def test_a_tolerance_that_is_none_is_refused(recording: Path, tolerance: float) -> None:
    with pytest.raises(InputError, match="tolerance = "):
        replay(recording, tolerance=tolerance)


def test_progress_is_reported(recording: Path) -> None:
    reported: list[tuple[int, int]] = []
    replay(recording, progress=lambda done, total: reported.append((done, total)))
    assert reported == [(i + 1, EVENTFUL) for i in range(EVENTFUL)]


NEXT = float(np.nextafter(1.0, 2.0))


@pytest.mark.parametrize(
    ("one", "other", "bits", "near"),
    [
        (nan, nan, [], []),
        ([1.0, {"b": nan}], [1.0, {"b": nan}], [], []),
        (1.0, NEXT, ["a"], []),
        (0.0, -0.0, ["a"], []),
        (1.0, 1.0 + 1e-8, ["a"], ["a"]),
        (1.0, nan, ["a"], ["a"]),
        (inf, 1e308, ["a"], ["a"]),
        (3.0, 3, ["a"], ["a"]),
        ("x", "y", ["a"], ["a"]),
        (None, 0.0, ["a"], ["a"]),
        ([1.0], [1.0, 2.0], ["a[1]"], ["a[1]"]),
        ([1.0, 2.0, 3.0], [1.0, 3.0, 4.0], ["a[1]"], ["a[1]"]),
        ([1.0, 2.0], [NEXT, 3.0], ["a[0]"], ["a[1]"]),
        ({"b": 1, "c": 2}, {"b": 1, "d": 2}, ["a.c", "a.d"], ["a.c", "a.d"]),
        ({"step_ms": 1.0, "slack": 1.0}, {"step_ms": 2.0, "slack": 2.0}, ["a.slack"], ["a.slack"]),
    ],
)
def test_differences_bit_for_bit_and_nearly(one: Any, other: Any, bits: list[str], near: list[str]) -> None:
    for tolerance, expected in ((0.0, bits), (1e-9, near)):
        assert [each.field for each in differences({"a": one}, {"a": other}, tolerance)] == expected


def test_times_are_all_that_is_left_out() -> None:
    assert {field.name for field in fields(Diagnostics) if field.name.endswith("_ms")} == TIMES


class Broken(DockingController):
    """Raises when the time has come."""

    def step(self, *arguments: Any, **named: Any) -> Command:
        if named["now"] > 0.12:
            raise RuntimeError("out of order")
        return super().step(*arguments, **named)


def test_what_a_step_raised_is_recorded_and_compared(tmp_path: Path) -> None:
    broken = controller(Broken)
    with (
        pytest.raises(RuntimeError, match="out of order"),
        Recorder(broken, tmp_path / "broken.jsonl") as recorder,
    ):
        drive(recorder, range(10))
    cycles = read_recording(tmp_path / "broken.jsonl").cycles
    assert [cycle.raised for cycle in cycles] == ["", "", "", "RuntimeError: out of order"]
    assert cycles[-1].command is None
    mismatch = replay(tmp_path / "broken.jsonl").mismatch
    assert mismatch is not None
    assert mismatch.cycle == 3
    assert "raised" in [field.field for field in mismatch.fields]
