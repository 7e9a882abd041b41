"""What a step has come to by the end of a cycle."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from rti_mpcc import DockingController
from rti_mpcc.config import MissionSettings
from rti_mpcc.mission.outcome import TROUBLE, UNDECIDED, outcome
from rti_mpcc.planning.agenda import Agenda
from rti_mpcc.steps import AnyStep, Dock, DriveTo, Straight, Undock, Wait
from rti_mpcc.types import Command, MissionResult, Reason, Status, VehicleState
from tests.rti_mpcc.mission.agendas import HERE, under_way
from tests.rti_mpcc.yards import BRISK, YARD

SETTINGS = MissionSettings()
RUNNING, SUCCEEDED = MissionResult.RUNNING, MissionResult.SUCCEEDED
DRIVES: list[AnyStep] = [DriveTo(HERE), Dock(HERE), Undock(1.0), Straight(1.0)]


@pytest.fixture(scope="module")
def some() -> Command:
    controller = DockingController.in_area(YARD, BRISK)
    return controller.step(VehicleState(x=0.0, y=0.0, phi=0.0, v=0.0, delta=0.0), now=0.0)


def command(some: Command, status: Status, cause: Reason = Reason.DRIVES, *, docked: bool = False) -> Command:
    told = replace(some.diagnostics, cause=cause, reason="why")
    return replace(some, status=status, docked=docked, diagnostics=told)


def lasting(
    some: Command, step: AnyStep, seconds: float, *statuses: Status, **values: Any
) -> tuple[MissionResult, float]:
    """What a step comes to with these statuses in turn, and when, [s] after it was begun."""
    agenda: Agenda = under_way(step)
    for k in range(round(seconds / 0.5)):
        status = statuses[k % len(statuses)]
        found = outcome(agenda, command(some, status, **values), False, 10.0 + 0.5 * k, SETTINGS)
        if found.result is not RUNNING:
            assert found.reason in ("why", "", f"it took {step.timeout:g} s")
            return found.result, 0.5 * k
        agenda = found.agenda
    return RUNNING, seconds


@pytest.mark.parametrize("step", DRIVES, ids=lambda step: step.word)
@pytest.mark.parametrize(("status", "result"), TROUBLE.items(), ids=str)
def test_what_does_not_get_on_fails_after_its_patience(
    some: Command, step: AnyStep, status: Status, result: MissionResult
) -> None:
    patient = replace(step, patience=4.0)
    assert lasting(some, patient, 20.0, status) == (result, 4.0)
    assert lasting(some, patient, 20.0, status, *[Status.PLANNING] * 3) == (result, 4.0)
    assert lasting(some, patient, 20.0, *[status] * 4, Status.FOLLOWING) == (RUNNING, 20.0)


@pytest.mark.parametrize("step", DRIVES, ids=lambda step: step.word)
@pytest.mark.parametrize("status", [each for each in Status if each not in TROUBLE], ids=str)
def test_no_other_status_is_trouble_and_each_has_its_time(
    some: Command, step: AnyStep, status: Status
) -> None:
    assert lasting(some, replace(step, patience=4.0), 30.0, status) == (RUNNING, 30.0)
    late = replace(step, timeout=3.0)
    assert lasting(some, late, 30.0, status) == (MissionResult.TIMED_OUT, 3.0)


def test_while_wheels_are_turned_there_is_no_trouble(some: Command) -> None:
    agenda = replace(under_way(DriveTo(HERE)), trouble=MissionResult.BLOCKED, trouble_since=9.0)
    for status in UNDECIDED:
        kept = outcome(agenda, command(some, status), False, 11.0, SETTINGS).agenda
        assert kept.trouble is MissionResult.BLOCKED
        turns = command(some, status, Reason.TURNS_WHEELS)
        assert outcome(agenda, turns, False, 11.0, SETTINGS).agenda.trouble is None


@pytest.mark.parametrize("step", DRIVES, ids=lambda step: step.word)
def test_it_succeeds_once_the_vehicle_has_stood_there_for_a_moment(some: Command, step: AnyStep) -> None:
    assert lasting(some, step, 5.0, Status.DOCKED, docked=True) == (SUCCEEDED, SETTINGS.settled)
    agenda = replace(under_way(step), docked_since=9.9)
    away = outcome(agenda, command(some, Status.STARTING), False, 11.0, SETTINGS)
    assert (away.result, away.agenda.docked_since) == (RUNNING, None)


@pytest.mark.parametrize(
    "step",
    [Wait(2.0), Wait(until=lambda: True), Wait(9.0, until=lambda: True)],
    ids=("seconds", "until", "both"),
)
def test_a_wait_is_over_after_its_time_or_when_it_is_told(some: Command, step: Wait) -> None:
    waiting, agenda = command(some, Status.WAITING), under_way(step)
    told = outcome(agenda, waiting, True, 10.5, SETTINGS)
    assert (told.result, told.reason) == (SUCCEEDED, "")
    for now in (10.5, 12.0, 19.0):
        over = step.seconds is not None and now - 10.0 >= step.seconds
        found = outcome(agenda, waiting, False, now, SETTINGS)
        assert found.result is (SUCCEEDED if over else RUNNING)
    late = outcome(under_way(replace(step, timeout=1.0)), waiting, False, 11.0, SETTINGS)
    assert (late.result, late.reason) == (MissionResult.TIMED_OUT, "it took 1 s")


def test_a_straight_move_is_over_when_it_is_told_and_no_other_drive_is(some: Command) -> None:
    for step in DRIVES:
        found = outcome(under_way(step), command(some, Status.FOLLOWING), True, 11.0, SETTINGS)
        if isinstance(step, Straight):
            assert (found.result, found.reason) == (SUCCEEDED, "it was told to stop")
        else:
            assert found.result is RUNNING
