"""The loop itself: clocks, dead time, noise, the goal that moves, and when a run ends."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from geometry import Pose2
from rti_mpcc.errors import InputError
from rti_mpcc.simulation import GoalSource, Scenario, changed, simulate
from rti_mpcc.types import Status
from tests.rti_mpcc.simulation.conftest import Scripted, forward, still


def triangle(peak: float) -> Any:
    """Speed up and down at 1 m/s² and stand from 2 peak on; `peak` is a multiple of the cycle [s]."""
    return lambda now, state: (1.0 if now < peak - 1e-6 else -1.0 if now < 2.0 * peak - 1e-6 else 0.0, 0.0)


@pytest.mark.parametrize("cycle", [0.005, 0.05, 0.055, 0.2])
def test_controller_is_called_at_its_cycle_whatever_the_plant_step(straight: Scenario, cycle: float) -> None:
    scenario = changed(straight, {"simulation.cycle": cycle, "simulation.plant_step": 0.005})
    scenario = changed(scenario, {"simulation.duration": 2.0})
    controller = Scripted(script=still)
    result = simulate(scenario, controller=controller)
    assert np.array([given[0] for given in controller.given]) == pytest.approx(
        cycle * np.arange(int(2.0 / cycle + 1e-9) + 1), abs=1e-9
    )
    assert result.truth.times == pytest.approx(0.005 * np.arange(401), abs=1e-9)
    assert result.ended == "duration"


def test_run_ends_half_a_second_after_docking(straight: Scenario) -> None:
    scenario = changed(straight, {"goal.offset": [-6.0, 0.0, 0.0]})
    result = simulate(scenario, controller=Scripted(script=triangle(2.0)))
    truth = result.truth
    standing = truth.times[np.argmax((truth.times > 3.0) & (np.abs(truth.v) <= 0.02 + 1e-12))]
    assert result.ended == "docked"
    # 0.5 s of standing make it docked, and it goes on for 0.5 s more.
    assert truth.times[-1] == pytest.approx(standing + 1.0, abs=0.0101)


@pytest.mark.parametrize("status", [Status.STALLED, Status.FAILED])
def test_run_ends_five_seconds_after_a_latched_stop(straight: Scenario, status: Status) -> None:
    controller = Scripted(script=still, status=lambda now: status if now >= 2.0 else Status.FOLLOWING)
    result = simulate(straight, controller=controller)
    assert (result.ended, result.truth.times[-1]) == ("stopped", pytest.approx(7.0, abs=1e-9))


def test_goal_is_told_only_where_the_scenario_has_one(straight: Scenario) -> None:
    short = changed(straight, {"simulation.duration": 0.2})
    without, with_goal = Scripted(script=still), Scripted(script=still)
    assert simulate(short, controller=without).goal_source is GoalSource.KNOWN  # there is no detector
    simulate(changed(short, {"goal.pose": [11.0, 0.5, 0.1]}), controller=with_goal)
    assert {given[2] for given in without.given} == {None}
    assert {given[2] for given in with_goal.given} == {Pose2(11.0, 0.5, 0.1)}


def test_goal_shifts_in_its_own_frame_at_its_distance(straight: Scenario) -> None:
    shifts = [
        {"at_distance": 6.0, "offset": [0.1, 0.2, 0.3]},
        {"at_distance": 4.0, "offset": [0.5, 0.0, 0.0]},
    ]
    scenario = changed(straight, {"goal.shifts": shifts, "simulation.duration": 4.5})
    controller = Scripted(script=forward)
    truth = simulate(scenario, controller=controller).truth
    first = Pose2(10.0, 0.0, 0.0).compose(Pose2(0.1, 0.2, 0.3))
    second = first.compose(Pose2(0.5, 0.0, 0.0))
    for pose, goal in zip(truth.poses, truth.goals, strict=True):
        away = np.hypot(pose[0] - first.x, pose[1] - first.y)
        expected = Pose2(10.0, 0.0, 0.0) if pose[0] < 4.0 - 1e-9 else first if away > 4.0 else second
        assert tuple(goal) == pytest.approx((expected.x, expected.y, expected.phi), abs=1e-9)
    # Without a goal pose the controller is told one from the first shift on.
    assert {given[2] for given in controller.given} == {None, first, second}


def test_noise_has_its_size_and_follows_the_seed(straight: Scenario) -> None:
    noise = [0.1, 0.2, 0.03, 0.04, 0.005]
    scenario = changed(straight, {"simulation.state_noise": noise, "simulation.duration": 20.0})
    scenario = changed(scenario, {"simulation.cycle": 0.01})
    measured = []
    for seed in (0, 0, 1):
        controller = Scripted(script=still)
        truth = simulate(scenario, controller=controller, seed=seed).truth
        measured.append(np.array([[s.x, s.y, s.phi, s.v, s.delta] for _, s, _, _ in controller.given]))
        assert not truth.poses.any()
    assert measured[0].std(axis=0) == pytest.approx(np.array(noise), rel=0.1)
    assert (measured[0] == measured[1]).all()
    assert (measured[0] != measured[2]).all()


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"method": "best"}, r"method = 'best': must be one of dynamic, separated, switched, constant_1,"),
        ({"preset": "best"}, r"preset = 'best': must be one of default, paper, paper_printed"),
        ({"seed": -1}, r"seed = -1: must be >= 0"),
        ({"goal_source": GoalSource.RAW}, r"goal_source = 'raw': must be 'detected', the default, in a"),
        ({"goal_source": GoalSource.KNOWN}, r"without \[goal\.measurement\] such as straight"),
    ],
)
def test_unknown_options_are_refused(straight: Scenario, wrong: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        simulate(straight, **wrong)
