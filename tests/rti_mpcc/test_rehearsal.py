"""The last part of a path is tried before the first one is driven."""

from __future__ import annotations

import pytest

from rti_mpcc.docking import DockingController
from rti_mpcc.scouting import OUT_OF_REACH
from rti_mpcc.simulation import RunResult, Scenario, docking_controller, scenario_from_dict, simulate, summary
from rti_mpcc.types import Status


def with_cusp(offset: tuple[float, float, float]) -> Scenario:
    """Forward, then 8 m in reverse to a goal `offset` from the path's end."""
    return scenario_from_dict(
        {
            "name": "with_cusp",
            "path": {
                "start": [3.0, -2.0, 2.9],
                "segments": [
                    {"direction": 1, "curvature": 0.05, "length": 12.0},
                    {"direction": -1, "curvature": 0.1, "length": 8.0},
                ],
            },
            "corridor": {"left": 4.0, "right": -4.0},
            "goal": {"offset": list(offset)},
            "simulation": {"dead_time": 0.18, "cycle": 0.05, "duration": 60.0},
        }
    )


NEAR, ASIDE = (0.3, 0.2, 0.05), (0.5, 2.5, 0.3)


def planned(result: RunResult) -> bool:
    """Whether it stood and planned before it drove."""
    return result.cycles.status[0] is Status.PLANNING


def test_a_goal_within_reach_changes_nothing() -> None:
    result = simulate(with_cusp(NEAR))
    assert not planned(result)
    assert summary(result)["direction_changes"] == 1
    assert summary(result)["docked"]


def test_a_goal_out_of_reach_is_come_to_by_another_way_from_the_start() -> None:
    scenario = with_cusp(ASIDE)
    controller = docking_controller(scenario)
    result = simulate(scenario, controller=controller)
    figures = summary(result)
    assert result.cycles.reason[0] == f"planning a way: {OUT_OF_REACH}"
    assert figures["docked"]
    assert figures["direction_changes"] <= 1
    assert figures["time_to_dock_s"] <= 1.15 * figures["expected_time_s"]
    assert controller.state.route is not None
    assert controller.state.route.ways == 2
    assert figures["min_clearance_m"] > 0.0


def test_one_that_takes_too_long_is_not_driven() -> None:
    """Then it is as it was without: one more change of direction at the end of the path."""
    scenario = with_cusp(ASIDE)
    config = scenario.controller_config()
    config = config.model_copy(update={"route": config.route.model_copy(update={"instead": 0.1})})
    path = scenario.build_path()
    controller = DockingController(path, scenario.build_corridor(path), config)
    result = simulate(scenario, controller=controller)
    figures = summary(result)
    assert planned(result)
    assert figures["docked"]
    assert figures["time_to_dock_s"] > 1.15 * figures["expected_time_s"]


@pytest.mark.parametrize(("preset", "method"), [("paper", "dynamic"), ("default", "separated")])
def test_where_no_other_way_is_planned_nothing_is_tried(preset: str, method: str) -> None:
    scenario = with_cusp(NEAR)
    run = docking_controller(scenario, preset=preset, method=method)
    simulate(scenario, controller=run)
    assert run.state.route is None or run.state.route.rehearsed is None


def test_without_a_change_of_direction_there_is_nothing_to_try() -> None:
    scenario = scenario_from_dict(
        {
            "name": "straight",
            "path": {
                "start": [0.0, 0.0, 0.0],
                "segments": [{"direction": 1, "curvature": 0.0, "length": 6.0}],
            },
            "corridor": {"left": 4.0, "right": -4.0},
        }
    )
    run = docking_controller(scenario)
    simulate(scenario, controller=run)
    assert run.state.route is not None
    assert run.state.route.rehearsed is None
