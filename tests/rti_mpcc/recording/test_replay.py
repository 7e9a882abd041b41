"""A replay comes to the same bit for bit, and whatever was changed is found at its cycle."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import nan
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest

from geometry import Pose2
from rti_mpcc.config import SolverSettings
from rti_mpcc.docking import DockingController
from rti_mpcc.errors import InputError, RecordingError
from rti_mpcc.recording import Machine, Recorder, ReplayReport, read_recording, replay
from rti_mpcc.recording.reader import CHANGED
from rti_mpcc.simulation import changed, docking_controller, load_scenario, simulate
from rti_mpcc.simulation.sections.faults import Kind
from rti_mpcc.types import Command, Status, VehicleState
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
    record,
)

Edit = Callable[[dict[str, Any]], object]


def assert_identical(report: ReplayReport, cycles: int) -> None:
    assert report.mismatch is None
    assert (report.cycles, report.tolerance, report.same_machine, report.complete) == (
        cycles,
        0.0,
        True,
        True,
    )


def test_a_recording_with_everything_that_may_happen_replays_bit_for_bit(recording: Path) -> None:
    assert_identical(replay(recording), EVENTFUL)


def test_everything_did_happen(recording: Path) -> None:
    cycles = read_recording(recording).cycles
    given = [cycle.inputs for cycle in cycles]
    assert [i for i, inputs in enumerate(given) if inputs.goal_cleared] == [AWAY]
    assert [i for i, inputs in enumerate(given) if inputs.obstacles] == [
        BEFORE,
        AWAY,
        UNREADABLE,
        UNREADABLE + 1,
    ]
    assert given[BLIND].state.x != given[BLIND].state.x
    assert given[BACK].now < given[BACK - 1].now
    assert given[LATE].measurements[0].covariance is None
    accepted = [
        i
        for i, cycle in enumerate(cycles)
        if cycle.command and any(judgement.accepted for judgement in cycle.command.diagnostics.detections)
    ]
    assert DETECTED in accepted
    failed = [cycles[i].command for i in FAILED]
    assert all(command and command.diagnostics.failed for command in failed)
    assert cycles[FAILED[0]].decisions.stops[0] == ("forced to fail", 0)


def test_a_docking_with_detections_replays_bit_for_bit(tmp_path: Path) -> None:
    """By way of the closed loop."""
    scenario = changed(load_scenario("docking_noisy"), {"simulation.duration": 2.0})
    with Recorder(docking_controller(scenario), tmp_path / "noisy.jsonl") as recorder:
        simulate(scenario, controller=recorder)
    assert_identical(replay(tmp_path / "noisy.jsonl"), 41)


@pytest.mark.parametrize("deadline", [0.006, pytest.param(None, marks=pytest.mark.acceptance)])
def test_a_run_with_every_fault_replays_bit_for_bit(tmp_path: Path, deadline: float | None) -> None:
    kinds = get_args(Kind)
    begins = 1.0 + 0.3 * np.arange(len(kinds))
    faults = [
        {"kind": kind, "from": float(begin), "to": float(begin) + 0.2}
        for kind, begin in zip(kinds, begins, strict=True)
    ]
    tables = {"faults": faults, "goal.measurement": {}, "simulation.duration": float(begins[-1]) + 1.0}
    if deadline is not None:
        tables["controller"] = {"deadline": deadline}
    scenario = changed(SCENARIO, tables)
    with Recorder(docking_controller(scenario), tmp_path / "faults.jsonl") as recorder:
        simulate(scenario, controller=recorder)
    recorded = read_recording(tmp_path / "faults.jsonl")
    assert recorded.header.config.deadline == deadline
    assert len({cycle.command.status for cycle in recorded.cycles if cycle.command}) > 1
    assert_identical(replay(tmp_path / "faults.jsonl"), len(recorded.cycles))


@pytest.mark.acceptance
def test_a_whole_docking_replays_bit_for_bit(tmp_path: Path) -> None:
    with Recorder(docking_controller(SCENARIO), tmp_path / "whole.jsonl") as recorder:
        simulate(SCENARIO, controller=recorder)
    cycles = read_recording(tmp_path / "whole.jsonl").cycles
    assert cycles[-1].command is not None
    assert cycles[-1].command.status is Status.DOCKED
    assert_identical(replay(tmp_path / "whole.jsonl"), len(cycles))


@pytest.mark.parametrize("deadline", [0.003, 0.006, 0.012])
def test_with_a_deadline_whatever_happens_replays_bit_for_bit(tmp_path: Path, deadline: float) -> None:
    with Recorder(controller(deadline=deadline), tmp_path / "late.jsonl") as recorder:
        drive(recorder, range(60), eventful)
    assert_identical(replay(tmp_path / "late.jsonl"), 60)


@pytest.mark.parametrize("seed", range(3))
def test_a_clock_of_any_mood_replays_bit_for_bit(tmp_path: Path, seed: int) -> None:
    random = np.random.default_rng(seed)

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


def test_a_goal_that_is_not_finite_replays_bit_for_bit(tmp_path: Path) -> None:
    def given(cycle: int, state: VehicleState) -> dict[str, Any]:
        goal = object.__new__(Pose2)
        for name, value in (("x", nan), ("y", 1.0), ("phi", float("nan"))):
            object.__setattr__(goal, name, value)
        return {"goal": goal}

    assert_identical(replay(record(tmp_path / "nan.jsonl", 4, given)), 4)


# -- one input changed ----------------------------------------------------------------------------------


def put(value: Any, *place: str | int) -> Edit:
    """Put a value at a place in a line."""

    def edit(data: dict[str, Any]) -> None:
        at(data, place[:-1])[place[-1]] = value

    return edit


def add(amount: float, *place: str | int) -> Edit:
    """Add to the number at a place in a line."""

    def edit(data: dict[str, Any]) -> None:
        at(data, place[:-1])[place[-1]] += amount

    return edit


def flip(*place: str | int) -> Edit:
    """Flip the last bit of the number at a place in a line."""

    def edit(data: dict[str, Any]) -> None:
        holder = at(data, place[:-1])
        holder[place[-1]] = float(np.nextafter(holder[place[-1]], np.inf))

    return edit


def at(data: Any, place: tuple[str | int, ...]) -> Any:
    for name in place:
        data = data[name]
    return data


COVARIANCE = ("inputs", "measurements", 0, "covariance", 0, 0)


@pytest.mark.parametrize(
    ("cycle", "edit"),
    [
        (5, flip("inputs", "state", "x")),
        (5, flip("inputs", "state", "phi")),
        (6, flip("inputs", "now")),
        (7, flip("inputs", "goal", "y")),
        (DETECTED, flip("inputs", "measurements", 0, "x")),
        (DETECTED, flip("inputs", "measurements", 0, "stamp")),
        (DETECTED, flip("inputs", "measurements", 0, "vehicle", "y")),
        (DETECTED, flip(*COVARIANCE)),
        (BEFORE, flip("inputs", "obstacles", 1, 2, 0)),
        (AWAY, put(False, "inputs", "goal_cleared")),
        (9, put([False], "decisions", "granted")),
        (9, put("braking", "command", "source")),
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
        (5, add(1e-3, "inputs", "state", "delta"), "command.acceleration"),
        (5, flip("inputs", "state", "x"), "command.trajectory.states[0][0]"),
        (6, add(1e-3, "inputs", "now"), "command.acceleration"),
        (7, add(0.5, "inputs", "goal", "y"), "command.acceleration"),
        (DETECTED, add(1e-3, "inputs", "measurements", 0, "x"), "command.diagnostics.goal.pose.x"),
        (
            DETECTED,
            add(1e-3, "inputs", "measurements", 0, "stamp"),
            "command.diagnostics.detections[0].stamp",
        ),
        (DETECTED, add(1e-3, "inputs", "measurements", 0, "vehicle", "y"), "command.diagnostics.goal.pose.y"),
        (DETECTED, add(1e-3, *COVARIANCE), "command.diagnostics.goal.covariance[0][0]"),
        (AWAY, put(False, "inputs", "goal_cleared"), "command.diagnostics.aim.x"),
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


def test_the_size_of_a_difference_is_told(recording: Path) -> None:
    recorded = read_recording(recording).cycles[9].command
    assert recorded is not None
    mismatch = replay(change(recording, 9, add(0.25, "command", "speed"), checked=True)).mismatch
    assert mismatch is not None
    (difference,) = mismatch.fields
    assert difference.field == "command.speed"
    assert (difference.recorded, difference.replayed) == (recorded.speed + 0.25, recorded.speed)
    assert difference.size == pytest.approx(0.25)
    assert mismatch.time == pytest.approx(9 * 0.05)


def test_a_change_that_comes_to_the_same_is_found_by_its_checksum(recording: Path) -> None:
    mismatch = replay(
        change(recording, 9, put(1.0, "command", "diagnostics", "step_ms"), checked=False)
    ).mismatch
    assert mismatch is not None
    assert (mismatch.cycle, mismatch.changed, mismatch.fields) == (9, CHANGED, ())


def test_a_line_that_cannot_be_replayed_any_more_is_found(recording: Path) -> None:
    mismatch = replay(change(recording, 9, put("a", "inputs", "state", "x"), checked=False)).mismatch
    assert mismatch is not None
    assert (mismatch.cycle, mismatch.time, mismatch.fields) == (9, None, ())
    assert mismatch.changed == f"{CHANGED} (inputs.state.x: must be a float, is 'a')"
    with pytest.raises(RecordingError, match=r"cycle 9: inputs\.state\.x: must be a float, is 'a'; was it"):
        replay(change(recording, 9, put("a", "inputs", "state", "x"), checked=True))


def test_a_line_that_is_no_json_any_more_is_found(recording: Path, tmp_path: Path) -> None:
    lines = recording.read_bytes().splitlines(keepends=True)
    lines[10] = lines[10].replace(b'"inputs":{', b'"inputs":[', 1)
    (tmp_path / "broken.jsonl").write_bytes(b"".join(lines))
    mismatch = replay(tmp_path / "broken.jsonl").mismatch
    assert mismatch is not None
    assert (mismatch.cycle, mismatch.changed) == (9, f"{CHANGED} (no JSON any more)")


# -- how it is compared ---------------------------------------------------------------------------------


def test_elsewhere_a_tolerance_holds(recording: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    nearly = change(recording, 9, add(1e-12, "command", "speed"), checked=True)
    assert not replay(nearly).identical
    assert replay(nearly, tolerance=1e-11).identical
    assert not replay(nearly, tolerance=0.0).identical
    here = Machine.here()
    monkeypatch.setattr(Machine, "here", lambda: replace(here, processor="another"))
    report = replay(nearly)
    assert (report.identical, report.tolerance, report.same_machine) == (True, 1e-9, False)
    assert not replay(change(recording, 9, add(1e-8, "command", "speed"), checked=True)).identical


@pytest.mark.parametrize("tolerance", [-1e-9, nan])
def test_a_tolerance_that_is_none_is_refused(recording: Path, tolerance: float) -> None:
    with pytest.raises(InputError, match="tolerance = "):
        replay(recording, tolerance=tolerance)


def test_progress_is_told(recording: Path) -> None:
    reported: list[tuple[int, int]] = []
    replay(recording, progress=lambda done, total: reported.append((done, total)))
    assert reported == [(i + 1, EVENTFUL) for i in range(EVENTFUL)]


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
