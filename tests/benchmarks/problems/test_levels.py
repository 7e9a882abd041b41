"""Levels: the same course or scene below all of them, repeatable disturbances within their range."""

from __future__ import annotations

from math import radians

import numpy as np
import pytest

from benchmarks.problems import levels
from benchmarks.problems.courses import CAMPAIGN, drawn_course
from benchmarks.problems.levels import Level, at_level
from benchmarks.problems.scenes import SLOT_CLEARANCE, drawn_scene, scenario_of
from rti_mpcc.model.footprint import body_of
from rti_mpcc.simulation import Scenario, changed
from rti_mpcc.simulation.sections.goal import MeasurementSection
from tests.rti_mpcc.docking_runs import straight


@pytest.fixture(scope="module")
def course() -> Scenario:
    return drawn_course(1, 3, CAMPAIGN)


@pytest.fixture(scope="module")
def scenes() -> list[Scenario]:
    return [scenario_of(drawn_scene(6, number)) for number in range(10)]


@pytest.fixture(scope="module")
def many(course: Scenario) -> list[Scenario]:
    return [at_level(course, Level.HARD, 5, index) for index in range(60)]


def seen(scenario: Scenario) -> MeasurementSection:
    assert scenario.goal.measurement is not None
    return scenario.goal.measurement


@pytest.mark.parametrize("level", Level)
def test_a_level_leaves_the_course_and_is_drawn_again_as_it_was(course: Scenario, level: Level) -> None:
    found = at_level(course, level, 1, 3)
    assert found == at_level(course, level, 1, 3)
    assert found.name == f"{course.name}_{level.value}"
    assert (found.path, found.corridor, found.goal.offset) == (
        course.path,
        course.corridor,
        course.goal.offset,
    )
    assert found.simulation.cycle == course.simulation.cycle
    assert (found.goal.measurement is not None) == level.noisy
    assert any(found.simulation.state_noise) == level.noisy
    assert (found.simulation.wheelbase_error != 0.0) == level.mismatched
    # What the controller assumes stays the same, whatever the plant has.
    assert found.controller_config().dead_time == 0.18


def test_hard_has_the_noise_of_noisy_and_the_plant_of_mismatched(course: Scenario) -> None:
    noisy, mismatched, hard = (
        at_level(course, level, 1, 3) for level in (Level.NOISY, Level.MISMATCHED, Level.HARD)
    )
    assert hard.goal == noisy.goal
    assert hard.simulation.state_noise == noisy.simulation.state_noise
    assert hard.plant_parameters() == mismatched.plant_parameters()


def test_disturbances_are_within_the_range_and_use_it(many: list[Scenario]) -> None:
    spans = {span: [getattr(seen(one), name) for one in many] for name, span in levels.DETECTION.items()}
    spans[levels.GAIN] = [one.simulation.acceleration_gain for one in many]
    spans[levels.DEAD_TIME] = [one.simulation.dead_time for one in many]
    noise = list(zip(*(one.simulation.state_noise for one in many), strict=True))
    spans |= {(0.0, most): list(noise[place + 1]) for place, most in enumerate(levels.STATE_NOISE)}
    for (low, high), values in spans.items():
        assert low <= min(values) < low + 0.2 * (high - low)
        assert high - 0.2 * (high - low) < max(values) <= high


def test_errors_are_to_either_side(many: list[Scenario]) -> None:
    for name, most in (("wheelbase_error", 0.05), ("steering_offset", radians(1.0))):
        values = [getattr(one.simulation, name) for one in many]
        assert -most <= min(values) < -0.8 * most
        assert 0.8 * most < max(values) <= most
    for axis, most in enumerate(levels.INITIAL_OFFSET):
        values = [seen(one).initial_offset[axis] for one in many]
        assert -most <= min(values) < -0.5 * most
        assert 0.5 * most < max(values) <= most


def test_a_planned_goal_without_room_comes_nearer_to_the_true_one() -> None:
    tight = straight(1, 20.0, corridor={"left": 1.1, "right": -1.1})
    wide = changed(tight, {"corridor.left": 5.0, "corridor.right": -5.0})
    shares = set()
    for index in range(10):
        near, far = (seen(at_level(one, Level.NOISY, 1, index)).initial_offset for one in (tight, wide))
        share = near[1] / far[1]
        assert near == pytest.approx([share * value for value in far], abs=2e-5)
        shares.add(round(share, 2))
    assert shares <= {1.0, 0.5, 0.25, 0.13, 0.12, 0.06, 0.03}
    assert len(shares) > 1


def test_something_fills_the_way_in_scenes_of_level_hard_only(
    scenes: list[Scenario], course: Scenario
) -> None:
    assert not at_level(course, Level.HARD, 1, 3).faults
    for index, scene in enumerate(scenes):
        others = [at_level(scene, level, 6, index) for level in Level if level is not Level.HARD]
        assert not any(one.faults for one in others)
        hard = at_level(scene, Level.HARD, 6, index)
        (fault,) = hard.faults
        assert fault.kind == "blocked"
        assert levels.APPEARS[0] <= fault.begin <= levels.APPEARS[1]
        assert levels.STAYS[0] <= fault.end - fault.begin <= levels.STAYS[1] + 1e-9
        # There is a way in which the vehicle can stop, its plant being what it is.
        speed, plant = scene.limits.speed, hard.simulation
        most = plant.acceleration_gain * scene.limits.acceleration
        assert fault.amount > plant.dead_time * speed + 0.5 * speed**2 / most + levels.AHEAD[0] - 1e-4


def test_the_body_has_room_at_the_planned_goal_of_a_scene(scenes: list[Scenario]) -> None:
    whole = 0
    for index, scene in enumerate(scenes):
        noisy = at_level(scene, Level.NOISY, 7, index)
        planned = noisy.planned_goal()
        assert planned is not None
        pose = np.array([[planned.x, planned.y, planned.phi]])
        room = noisy.build_area().signed_distances(body_of(noisy.vehicle), pose)
        assert room[0] >= SLOT_CLEARANCE
        assert any(seen(noisy).initial_offset)
        bare = changed(scene, {"area.obstacles": [], "area.boundary": None})
        far = seen(at_level(bare, Level.NOISY, 7, index)).initial_offset
        whole += far == seen(noisy).initial_offset
    assert 0 < whole < len(scenes)
