"""A case follows from seed, level and index and nothing else; its figures tell how difficult it is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.problems.case import (
    CampaignCase,
    Problems,
    course_figures,
    disturbance_figures,
    scene_figures,
)
from benchmarks.problems.courses import CAMPAIGN, drawn_course
from benchmarks.problems.levels import Level
from benchmarks.problems.scenes import drawn_scene, scenario_of
from rti_mpcc.errors import InputError
from rti_mpcc.simulation import changed, load_scenario
from rti_mpcc.simulation.campaign import MOST
from tests.rti_mpcc.docking_runs import on_segments

COURSE = on_segments(
    [(1, 0.05, 10.0), (-1, -0.1, 8.0), (-1, 0.0, 4.5)],
    corridor={
        "left": 4,
        "right": -3,
        "narrowings": [{"from": 2.0, "to": 4.0, "right": -1.5}, {"from": 6.0, "to": 7.0, "left": 1.8}],
        "obstacles": [[[5, -2], [6, -2], [6, -3]]],
    },
    goal={"offset": [-2.0, 0.5, 0.1]},
)
CASE = CampaignCase(seed=11, level=Level.HARD, index=3)


def test_a_case_is_named_like_its_scenario() -> None:
    assert CASE.name == CASE.scenario().name == "campaign_11_03_hard"
    assert CASE.scenario().path == drawn_course(11, 3, CAMPAIGN).path
    asked = replace(CASE, deadline=0.02, ride="brisk").scenario()
    assert asked == changed(CASE.scenario(), {"controller.deadline": 0.02, "controller.ride": "brisk"})


@pytest.mark.parametrize(("index", "level"), [(1, Level.HARD), (12, Level.NOMINAL)])
def test_a_case_may_be_a_scene(index: int, level: Level) -> None:
    one = CampaignCase(seed=11, level=level, index=index, problems=Problems.SCENES)
    scenario, scene = one.scenario(), drawn_scene(11, index)
    assert one.name == scenario.name == f"{scene.name}_{level.value}"
    assert (scenario.start_pose(), scenario.goal_pose()) == (scene.start, scene.goal)
    assert one.drawn(scenario)["course"]["kind"] == scene.kind


def test_each_case_has_noise_of_its_own() -> None:
    cases = [replace(CASE, index=index, seed=seed) for seed in (0, 1, 2) for index in (0, 1, MOST - 1)]
    assert len({one.run["seed"] for one in cases}) == 9
    assert replace(CASE, seed=1, index=7, preset="paper").run == {
        "method": "dynamic",
        "preset": "paper",
        "seed": 1000007,
    }


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"seed": -1}, "seed = -1: must be >= 0"),
        ({"index": -1}, "index = -1: must be >= 0 and < 1000000"),
        ({"index": MOST}, f"index = {MOST}"),
    ],
)
def test_what_is_no_case_is_refused(changes: dict[str, int], message: str) -> None:
    with pytest.raises(InputError, match=message):
        replace(CASE, **changes)  # type: ignore[arg-type]


def test_a_course_is_told_in_figures() -> None:
    assert course_figures(COURSE) == {
        "direction": -1,
        "pieces": 3,
        "cusps": 1,
        "length_m": 22.5,
        "curvature": 0.1,
        "room_m": 0.4655,
        "narrowings": 2,
        "obstacles": 1,
        "goal_behind_m": 2.0,
        "goal_beside_m": 0.5,
        "goal_turned_rad": 0.1,
    }
    with pytest.raises(InputError, match=r"path_following: needs path\.segments"):
        course_figures(load_scenario("path_following"))


def test_a_scene_is_told_in_figures() -> None:
    scene = drawn_scene(1, 2)
    found = scene_figures(scenario_of(scene))
    assert (found["kind"], found["obstacles"], found["bounded"]) == ("yard", len(scene.obstacles), 1)
    assert found["radius_m"] == pytest.approx(0.9 / scene.curvature, abs=1e-5)
    apart = np.hypot(scene.goal.x - scene.start.x, scene.goal.y - scene.start.y)
    assert found["apart_m"] == pytest.approx(apart, abs=1e-5)
    assert min(found["room_at_start_m"], found["room_at_goal_m"]) >= scene.clearance


def test_disturbances_are_told_in_figures() -> None:
    measurement = {"position_std": 0.04, "heading_std": 0.03, "delay": 0.07, "dropout": 0.3, "outlier": 0.01}
    plant = {"wheelbase_error": 0.02, "steering_offset": -0.01, "acceleration_gain": 0.9, "dead_time": 0.2}
    noise = [0.01, 0.02, 0.03, 0.04, 0.05]
    assert list(disturbance_figures(COURSE).values()) == [
        *(0.0,) * 5, (0.0,) * 3, (0.0,) * 5, 0.0, 0.0, 1.0, 0.18
    ]  # fmt: skip
    changes = {
        "goal.measurement": measurement | {"initial_offset": [0.1, 0.2, 0.05]},
        "simulation.state_noise": noise,
        **{f"simulation.{name}": value for name, value in plant.items()},
    }
    assert list(disturbance_figures(changed(COURSE, changes)).values()) == [
        *(0.04, 0.03, 0.3, 0.01, 0.07, (0.1, 0.2, 0.05), tuple(noise)),
        *plant.values(),
    ]
