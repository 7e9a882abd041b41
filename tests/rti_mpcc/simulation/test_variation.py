"""Variations of a scenario: within their sizes, the same each time, each part by itself, with room."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from rti_mpcc.simulation import Scenario, changed, load_scenario, simulate
from rti_mpcc.simulation import variation as sizes
from rti_mpcc.simulation.variation import PARTS, VariedCase, varied
from tests.lists import some_of

BASE = load_scenario("docking_behind")


def case(index: int = 3, vary: tuple[str, ...] = PARTS, base: Scenario = BASE) -> VariedCase:
    return VariedCase(base=base, vary=vary, seed=7, index=index)


def drawn(one: VariedCase) -> dict[str, Any]:
    return {name: dict(values) for name, values in one.drawn(one.scenario()).items()}


def test_a_case_is_the_same_each_time_and_each_is_another_one() -> None:
    assert case().scenario() == case().scenario()
    assert case().name == case().scenario().name == "docking_behind_7_03"
    assert case().run == {"seed": 7_000_003}
    assert len({str(drawn(case(index))) for index in range(5)}) == 5


@pytest.mark.parametrize("draws", some_of([20, 40]))
def test_values_are_within_their_sizes_and_use_them(draws: int) -> None:
    found = [drawn(case(index)) for index in range(draws)]
    for name, most in (("start", sizes.START), ("goal", sizes.GOAL)):
        shifts = np.abs([one["course"][name] for one in found])
        assert (shifts <= np.array(most) + 1e-5).all()
        assert (shifts.max(axis=0) > 0.7 * np.array(most)).all()
    noise = np.array([one["disturbances"]["state_noise"] for one in found])[:, 1:]
    assert (noise.min(axis=0) >= 0.0).all()
    assert (noise <= sizes.STATE_NOISE).all()
    errors = np.array([one["disturbances"]["wheelbase_error"] for one in found])
    assert -sizes.WHEELBASE_ERROR <= errors.min() < 0.0 < errors.max() <= sizes.WHEELBASE_ERROR
    # What the controller assumes stays the same.
    assert {case(index).scenario().controller_config().dead_time for index in range(5)} == {0.18}


@pytest.mark.parametrize("name", ["bay_perpendicular", "docking_mission", "aisle_dock", "path_following"])
def test_all_kinds_of_scenarios_are_varied_with_room(name: str) -> None:
    base = load_scenario(name)
    for index in range(3):
        one = case(index, base=base).scenario()
        assert one.start_pose() != base.start_pose()
        short = simulate(changed(one, {"simulation.duration": 0.1}))
        assert short.truth.poses[0] == pytest.approx(list(_numbers(one)))


def _numbers(scenario: Scenario) -> tuple[float, float, float]:
    pose = scenario.start_pose()
    return pose.x, pose.y, pose.phi


def test_without_room_a_shift_is_halved_until_there_is() -> None:
    narrow = changed(BASE, {"corridor.left": 1.2, "corridor.right": -1.2, "corridor.narrowings": []})
    narrow = changed(narrow, {"goal.offset": None})
    wide = case(vary=("start",))
    shares = set()
    for index in range(8):
        far = np.array(replace(wide, index=index).scenario().simulation.start_offset)
        near = np.array(varied(narrow, ("start",), np.random.default_rng([7, index])).simulation.start_offset)
        shares.add(round(float(near[1] / far[1]), 2))
    assert shares <= {1.0, 0.5, 0.25, 0.12, 0.13, 0.06, 0.03, 0.0}
    assert len(shares) > 1
