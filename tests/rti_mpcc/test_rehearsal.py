"""The last part of a path is tried before the first one is driven."""

from __future__ import annotations

from rti_mpcc.rehearsal import OUT_OF_REACH
from rti_mpcc.simulation import Scenario, docking_controller, scenario_from_dict, simulate, summary


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
