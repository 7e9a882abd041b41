"""Each fault of a scenario at its time: what the controller is told, and what becomes of its commands."""

from __future__ import annotations

from math import isinf, isnan
from typing import Any

import numpy as np
import pytest

from geometry import Pose2
from rti_mpcc.simulation import Scenario, changed, simulate
from rti_mpcc.types import Status
from tests.rti_mpcc.docking_runs import short
from tests.rti_mpcc.simulation.conftest import Scripted, forward, still

DETECTED = {"rate": 20.0, "dropout": 0.0, "outlier": 0.0, "initial_offset": [0.0, 0.0, 0.0]}


def faulty(
    scenario: Scenario, kind: str, size: float | None = None, changes: dict[str, Any] | None = None
) -> Scenario:
    """With one fault from 0.5 to 1 s; 2 s long."""
    fault = {"kind": kind, "from": 0.5, "to": 1.0, "size": size}
    return changed(scenario, {"simulation.duration": 2.0, "faults": [fault], **(changes or {})})


def acting(controller: Any) -> list[bool]:
    """For each cycle of a run of `faulty` whether the fault acted in it."""
    return [bool(0.5 - 1e-6 < 0.05 * cycle < 1.0 - 1e-6) for cycle in range(len(controller.given))]


@pytest.mark.parametrize(("kind", "broken"), [("nan_state", isnan), ("infinite_state", isinf)])
def test_no_measured_number_is_finite(straight: Scenario, kind: str, broken: Any) -> None:
    controller = Scripted(script=still)
    simulate(faulty(straight, kind), controller=controller)
    for (_, state, _, _), acts in zip(controller.given, acting(controller), strict=True):
        assert {broken(v) for v in (state.x, state.y, state.phi, state.v, state.delta)} == {acts}


def test_a_frozen_state_is_that_of_the_first_cycle(straight: Scenario) -> None:
    controller = Scripted(script=forward)
    simulate(faulty(straight, "frozen_state"), controller=controller)
    for (now, state, _, _), acts in zip(controller.given, acting(controller), strict=True):
        measured_at = 0.5 if acts else now
        assert (state.x, state.v) == pytest.approx((0.5 * measured_at**2, measured_at), abs=1e-9)


@pytest.mark.parametrize("size", [0.5, -0.3])
def test_a_jump_moves_the_measured_position_to_the_left(straight: Scenario, size: float) -> None:
    controller = Scripted(script=still)
    start = [1.0, 0.5, np.pi / 6.0]
    scenario = changed(faulty(straight, "state_jump", size), {"simulation.start_offset": start})
    truth = simulate(scenario, controller=controller).truth
    assert (truth.poses == truth.poses[0]).all()
    for (_, state, _, _), acts in zip(controller.given, acting(controller), strict=True):
        left = size if acts else 0.0
        assert (state.x, state.y) == pytest.approx((1.0 - 0.5 * left, 0.5 + np.sqrt(0.75) * left), abs=1e-12)
        assert (state.phi, state.v, state.delta) == (start[2], 0.0, 0.0)


def test_lost_cycles_leave_the_vehicle_with_its_last_command(straight: Scenario) -> None:
    controller = Scripted(script=lambda now, state: (1.0 if now < 0.475 else -1.0, 0.0))
    result = simulate(faulty(straight, "lost_cycles"), controller=controller)
    # The last command before the loss is that of 0.45 s: it acts until the one of 1 s.
    times = np.concatenate([0.05 * np.arange(10), 1.0 + 0.05 * np.arange(21)])
    assert result.cycles.times == pytest.approx(times, abs=1e-9)
    assert [given[0] for given in controller.given] == pytest.approx(times, abs=1e-9)
    truth = result.truth
    assert truth.v == pytest.approx(np.minimum(truth.times, 2.0 - truth.times), abs=1e-9)


def test_the_clock_goes_back_and_forth_again(straight: Scenario) -> None:
    controller = Scripted(script=still)
    result = simulate(faulty(straight, "clock_back"), controller=controller)
    given = np.array([given[0] for given in controller.given])
    assert result.cycles.times == pytest.approx(0.05 * np.arange(41), abs=1e-9)
    assert given == pytest.approx(result.cycles.times - 3.0 * np.array(acting(controller)), abs=1e-9)


@pytest.mark.parametrize(
    ("kind", "word", "late"),
    [("solver_fail", "forced to fail", False), ("solver_timeout", "run time limit reached", True)],
)
def test_every_qp_of_the_cycle_goes_wrong(kind: str, word: str, late: bool) -> None:
    result = simulate(faulty(short(), kind))
    during = (result.cycles.times > 0.475) & (result.cycles.times < 0.975)
    assert result.cycles.failed[during].all()
    assert not result.cycles.failed[~during].any()
    assert (result.cycles.deadline_missed == (during & late)).all()
    assert {r for r, acts in zip(result.cycles.reason, during, strict=True) if acts} == {
        f"the QP was not solved: {word}"
    }


def test_a_goal_jumps_to_its_left_and_back(straight: Scenario) -> None:
    controller = Scripted(script=still)
    scenario = faulty(straight, "goal_jump", 0.6, {"goal.pose": [9.0, 0.5, np.pi / 6.0]})
    result = simulate(scenario, controller=controller)
    goal = Pose2(9.0, 0.5, np.pi / 6.0)
    for (_, _, given, _), acts in zip(controller.given, acting(controller), strict=True):
        assert given == (goal.compose(Pose2(0.0, 0.6, 0.0)) if acts else goal)
    assert np.ptp(result.truth.goals, axis=0) == pytest.approx(0.0)


@pytest.mark.parametrize("kind", ["goal_jump", "goal_nan"])
def test_detections_go_wrong_in_place_of_the_goal(straight: Scenario, kind: str) -> None:
    detected = {"goal": {"offset": [0.0, 0.0, 0.0], "measurement": DETECTED}}
    usual, wrong = Scripted(script=still), Scripted(script=still)
    simulate(changed(straight, {"simulation.duration": 2.0, **detected}), controller=usual)
    simulate(faulty(straight, kind, changes=detected), controller=wrong)
    assert {given[2] for given in wrong.given} == {Pose2(10.0, 0.0, 0.0)}
    for (good,), (bad,), acts in zip(usual.detections, wrong.detections, acting(wrong), strict=True):
        place = Pose2(good.x, good.y, good.phi).compose(Pose2(0.0, 0.5 if acts else 0.0, 0.0))
        if kind == "goal_nan" and acts:
            assert isnan(bad.x)
            assert isnan(bad.phi)
        else:
            assert (bad.stamp, bad.x, bad.y) == pytest.approx((good.stamp, place.x, place.y))


def test_a_stop_counts_from_the_end_of_the_last_fault_on(straight: Scenario) -> None:
    controller = Scripted(script=still, status=lambda now: Status.FAILED)
    faults = [{"kind": "nan_state", "from": 0.5, "to": 3.0}, {"kind": "nan_state", "from": 1.0, "to": 2.0}]
    result = simulate(changed(straight, {"faults": faults}), controller=controller)
    assert (result.ended, result.truth.times[-1]) == ("stopped", pytest.approx(8.0))


@pytest.mark.parametrize(("begin", "end", "over"), [(0.5, 3.0, 3.0), (1.5, 3.0, 1.0), (0.1, 0.5, 1.0)])
def test_a_docked_vehicle_is_watched_to_the_end_of_a_fault_that_acts(
    straight: Scenario, begin: float, end: float, over: float
) -> None:
    faults = [{"kind": "nan_state", "from": begin, "to": end}]
    scenario = changed(straight, {"faults": faults, "goal.pose": [0.0, 0.0, 0.0]})
    result = simulate(scenario, controller=Scripted(script=still))
    assert (result.ended, result.truth.times[-1]) == ("docked", pytest.approx(over))
