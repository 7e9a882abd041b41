"""The angle that the wheels come to at the end of an arrival, the last term of (C3)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from geometry import Corridor, Pose2, ReferencePath
from rti_mpcc.config import ControllerConfig, SolverSettings, Weights
from rti_mpcc.controller import RtiMpcc
from rti_mpcc.model.layout import CONTROLS, DELTA, STATES, THETA
from rti_mpcc.ocp.horizon import stage_lengths, stage_times
from rti_mpcc.ocp.objectives import ArrivalAtRest, StageWeights, arrival_weights
from rti_mpcc.ocp.stage_cost import QuadraticCost, quadratic_cost
from rti_mpcc.ocp.targets import Target, ended_at, path_end
from rti_mpcc.planning.guess import arrival_guess
from rti_mpcc.planning.pace import pace_of
from rti_mpcc.qp.solver import COLD
from rti_mpcc.types import Array, Trajectory
from tests.rti_mpcc.differences import slopes

N = 6
LENGTHS = np.full(N, 0.3)
PATH = ReferencePath.from_segments(Pose2(1.0, 2.0, 0.5), [(1, 0.0, 6.0), (1, 0.08, 4.0)])
BACK = ReferencePath.from_segments(Pose2(1.0, 2.0, 0.5), [(-1, 0.0, 6.0), (-1, 0.08, 4.0)])
WEIGHTS = Weights()
SECONDS = 16.0


def weights_for(target: Target, weights: Weights = WEIGHTS) -> StageWeights:
    return arrival_weights(weights, target, LENGTHS)


def target(wheels: float | None) -> Target:
    part = PATH.parts[0]
    return ended_at(part, part.last, wheels, 1.0)


def model(states: Array, weights: StageWeights, wheels: float) -> QuadraticCost:
    controls = np.zeros((N, CONTROLS))
    goal = Pose2(3.0, 1.0, 0.2)
    comfort = ControllerConfig().comfort
    return quadratic_cost(states, controls, weights, None, goal, 2.875, comfort, wheels=wheels)


# -- the term ------------------------------------------------------------------------------------------------


def test_the_weight_acts_where_the_target_has_an_angle_only() -> None:
    assert weights_for(target(0.3)).goal_wheels == WEIGHTS.arrival_wheels > 0.0
    assert weights_for(target(0.0)).goal_wheels == WEIGHTS.arrival_wheels
    assert weights_for(target(None)).goal_wheels == 0.0
    assert weights_for(path_end(PATH.parts[0])).goal_wheels == 0.0
    half = replace(target(0.3), wheels_share=0.5)
    assert weights_for(half).goal_wheels == 0.5 * WEIGHTS.arrival_wheels
    none = WEIGHTS.model_copy(update={"arrival_wheels": 0.0})
    assert weights_for(target(0.3), none).goal_wheels == 0.0


@pytest.mark.parametrize("wheels", [-0.45, 0.0, 0.3])
def test_its_gradient_is_the_slope_of_the_cost(wheels: float) -> None:
    states = np.random.default_rng(1).uniform(-0.5, 0.5, (N + 1, STATES))
    weight = weights_for(target(wheels)).goal_wheels
    with_ = model(states, weights_for(target(wheels)), wheels)
    without = model(states, weights_for(target(None)), wheels)

    def cost(z: Array) -> Array:
        return np.array(weight * (z.reshape(N + 1, STATES)[-1, DELTA] - wheels) ** 2)

    got = with_.state_gradient - without.state_gradient
    expected = slopes(cost, states.ravel()).reshape(N + 1, STATES)
    assert abs(expected[-1, DELTA]) > 1.0
    np.testing.assert_allclose(got, expected, rtol=1e-6, atol=1e-6)
    more = with_.state_hessian - without.state_hessian
    assert more[-1, DELTA, DELTA] == pytest.approx(2.0 * weight)
    more[-1, DELTA, DELTA] = 0.0
    np.testing.assert_allclose(more, 0.0, atol=1e-9)
    np.testing.assert_array_equal(with_.control_hessian, without.control_hessian)


# -- what comes of it ----------------------------------------------------------------------------------------


def arrived(path: ReferencePath, wheels: float | None, **changes: float) -> Trajectory:
    """A planned arrival at rest at the path's end, iterated until it hardly moves."""
    part = path.parts[0]
    config = ControllerConfig(
        stages=30,
        solver=SolverSettings(tolerance=1e-6, max_iterations=100_000),
        weights=WEIGHTS.model_copy(update=changes),
    )
    mpcc = RtiMpcc(part, Corridor.from_offsets(path, left=5.0, right=-5.0), config)
    mpcc.target = ended_at(part, part.last, wheels, 1.0)
    start = np.array([part.first.x, part.first.y, part.first.phi, 0.0, 0.0, 0.0])
    times = stage_times(0.0, stage_lengths(SECONDS, config.cycle, config.stages))
    pace = pace_of(part, config)
    guess = arrival_guess(part, mpcc.target, start, times, mpcc.target.theta - start[THETA], pace, config)
    objective = ArrivalAtRest(SECONDS)
    mpcc.prepare(0.0, plan=guess, objective=objective, damping=1e-4)
    solution = mpcc.feedback(start, 0.0)
    for _ in range(7):
        mpcc.prepare(0.0, last=solution, objective=objective, damping=1e-4, steps=COLD)
        solution = mpcc.feedback(start, 0.0)
        assert solution.solved
    return solution.trajectory


@pytest.mark.parametrize("path", [PATH, BACK], ids=["forward", "reverse"])
@pytest.mark.parametrize("wheels", [-0.5, 0.0, 0.5])
def test_an_arrival_ends_with_the_wheels_as_the_next_segment_begins(
    path: ReferencePath, wheels: float
) -> None:
    """With a weight that insists; the default one is a compromise with the pose, which in tight places is
    worth more: the wheels come at least half of the way, and what is left they are turned at rest."""
    end, free = path.parts[0].last, arrived(path, None).states[-1]
    last = arrived(path, wheels, arrival_wheels=10.0 * WEIGHTS.arrival_wheels).states[-1]
    assert last[DELTA] == pytest.approx(wheels, abs=0.05)
    compromise = arrived(path, wheels).states[-1]
    assert abs(compromise[DELTA] - wheels) <= 0.5 * abs(free[DELTA] - wheels)
    for each in (last, compromise):
        error = Pose2(*each[:3].tolist()).relative_to(end)
        assert error.within((0.02, 0.02, 0.02)), error


def test_without_an_angle_they_stand_as_the_path_has_left_them() -> None:
    free, none = arrived(PATH, None), arrived(PATH, -0.5, arrival_wheels=0.0)
    np.testing.assert_allclose(free.states[-1], none.states[-1], atol=1e-4)
    assert abs(free.states[-1, DELTA] + 0.5) > 0.5
