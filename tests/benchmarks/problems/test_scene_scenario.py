"""A drawn scene as a scenario: nothing is lost, and it is one that can be written to a file."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.problems.scenes import DEAD_TIME, DURATION, drawn_scene, kind_of, scenario_of


@pytest.mark.parametrize("number", range(5))
def test_a_scene_is_a_scenario_to_the_last_bit(number: int) -> None:
    scene = drawn_scene(3, number)
    scenario = scenario_of(scene)
    assert scenario.in_area
    assert (scenario.name, kind_of(scenario)) == (scene.name, scene.kind)
    assert (scenario.start_pose(), scenario.goal_pose()) == (scene.start, scene.goal)
    area = scenario.build_area()
    assert all(map(np.array_equal, area.obstacles, scene.obstacles))
    assert area.boundary is not None
    assert scene.boundary is None or np.array_equal(area.boundary, scene.boundary)
    config = scenario.controller_config()
    assert config.vehicle == scene.vehicle
    assert config.limits == scene.limits
    assert config.comfort_acceleration == scene.comfort_acceleration
    assert (config.dead_time, scenario.simulation.dead_time) == (DEAD_TIME, DEAD_TIME)
    assert scenario.simulation.duration == DURATION
    assert f"{len(scene.obstacles)} obstacles" in scenario.description
