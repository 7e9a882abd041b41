"""First cycles of vehicles that move close to the goal with their steering turned away: none is a mistake."""

from __future__ import annotations

import numpy as np
import pytest

from geometry import Pose2
from rti_mpcc import ControllerConfig, DockingController, Reason, SolverSettings, VehicleState
from rti_mpcc.simulation import load_scenario

DRAWS = 100
SCENARIO = load_scenario("docking_inside")
PATH = SCENARIO.build_path()
GOAL = SCENARIO.goal_pose(PATH)
CORRIDOR = SCENARIO.build_corridor(PATH)
CONFIG = ControllerConfig(dead_time=0.18, stages=10, solver=SolverSettings(max_iterations=5))
"""Whether a search can be begun does not depend on how well QPs are solved: few stages, few iterations."""


def drawn(seed: int) -> VehicleState:
    """Reversing within 4 m of the goal, steered far to either side."""
    rng = np.random.default_rng(seed)
    pose = GOAL.compose(Pose2(rng.uniform(-4.0, 4.0), rng.uniform(-1.0, 1.0), rng.uniform(-0.5, 0.5)))
    speed, steering = rng.uniform(-1.5, -0.3), rng.choice([-1.0, 1.0]) * rng.uniform(0.4, 0.6)
    return VehicleState(x=pose.x, y=pose.y, phi=pose.phi, v=speed, delta=steering)


def cause(state: VehicleState, config: ControllerConfig) -> Reason:
    command = DockingController(PATH, CORRIDOR, config).step(state, now=0.0, goal=GOAL)
    return command.diagnostics.cause


@pytest.mark.parametrize(
    "seeds", [range(DRAWS), pytest.param(range(DRAWS, 3 * DRAWS), marks=pytest.mark.acceptance)], ids=str
)
def test_no_first_cycle_is_a_mistake(seeds: range) -> None:
    causes = {seed: cause(drawn(seed), CONFIG) for seed in seeds}
    assert not [seed for seed, each in causes.items() if each is Reason.MISTAKE]


@pytest.mark.parametrize("steering", [-0.6, 0.6])
def test_a_vehicle_that_is_to_stand_before_its_steering_is_turned_searches(steering: float) -> None:
    state = VehicleState(x=10.75, y=-15.81, phi=0.783, v=-0.93, delta=steering)
    assert cause(state, SCENARIO.controller_config()) is not Reason.MISTAKE
