from __future__ import annotations

from dataclasses import replace
from math import exp, log, tan

import numpy as np
import pytest

from geometry import Corridor, PathPart, Pose2, ReferencePath
from geometry.contacts import ACROSS, ALONG
from geometry.shape_grid import POINT
from rti_mpcc.config import Comfort
from rti_mpcc.model.layout import CONTROLS, DELTA, DELTA_DOT, PHI, STATES, THETA, THETA_DOT, A, V, X, Y
from rti_mpcc.ocp.frenet import frenet_errors
from rti_mpcc.ocp.objectives import GOAL_CLIP, ComfortWeights
from rti_mpcc.ocp.stage_cost import COMFORT_CLIP, COMFORT_EASE, QuadraticCost, add_goal, quadratic_cost
from rti_mpcc.paper.terms import PaperWeights, SoftWalls, WeightSlopes, add_paper_terms, add_weight_slopes
from rti_mpcc.types import Array
from tests.geometry.sides import contacts_of
from tests.rti_mpcc.differences import slopes

N, WHEELBASE, WHEELS = 8, 2.875, 0.3
COMFORT = Comfort(acceleration=0.4, lateral_acceleration=0.9, steering_rate=0.3, jerk=1.0)
"""Some stages of the plan are within it, others beyond it on either side."""
BLENDED = WeightSlopes._fields
NOTHING = PaperWeights(
    lag=np.zeros(N + 1),
    contouring=np.zeros(N + 1),
    heading=np.zeros(N + 1),
    lateral_acceleration=np.zeros(N + 1),
    bound_distance=np.zeros(N + 1),
    bound_speed=np.zeros(N + 1),
    acceleration=np.zeros(N),
    steering_rate=np.zeros(N),
    virtual_speed=np.zeros(N),
    progress_reward=np.zeros(N),
    comfort=ComfortWeights(np.zeros(N), np.zeros(N + 1), np.zeros(N)),
    goal=np.zeros(3),
    goal_speed=0.0,
    goal_clipped=False,
    slack=0.0,
    scale=1.0,
)

RANDOM = np.random.default_rng(11)
W, U = RANDOM.uniform(0.5, 3.0, N + 1), RANDOM.uniform(0.5, 3.0, N)
TERMS = {
    "lag": replace(NOTHING, lag=W),
    "contouring": replace(NOTHING, contouring=W),
    "heading": replace(NOTHING, heading=W),
    "lateral acceleration": replace(NOTHING, lateral_acceleration=W),
    "distance to walls": replace(NOTHING, bound_distance=W),
    "speed near walls": replace(NOTHING, bound_speed=W),
    "controls": replace(
        NOTHING, acceleration=U, steering_rate=2.0 * U, virtual_speed=3.0 * U, progress_reward=U
    ),
    "comfort": replace(NOTHING, comfort=ComfortWeights(U, 2.0 * W, 3.0 * U)),
    "goal": replace(NOTHING, goal=np.array([2.0, 3.0, 4.0]), goal_speed=5.0, goal_wheels=6.0),
    "clipped goal": replace(NOTHING, goal=np.array([2.0, 2.0, 4.0]), goal_speed=5.0, goal_clipped=True),
}
TERMS["all"] = replace(
    TERMS["clipped goal"],
    lag=W,
    contouring=2.0 * W,
    heading=W[::-1].copy(),
    lateral_acceleration=W,
    bound_distance=W,
    bound_speed=W,
    comfort=ComfortWeights(3.0 * U, W, 2.0 * U),
    acceleration=U,
    steering_rate=U,
    virtual_speed=U,
    progress_reward=U,
)


CHANGING = replace(
    TERMS["all"],
    by_progress=WeightSlopes(
        contouring=0.3 * W, heading=-0.2 * W, bound_distance=0.1 * W[::-1], progress_reward=-0.4 * W
    ),
)
"""All terms, with weights that change with their stage's progress."""
TERMS["all, blended"] = CHANGING


class Setting:
    """A plan beside an arc, walls beside it, and a cost written down once more."""

    def __init__(self, direction: int, goal: Pose2) -> None:
        path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.2), [(direction, 0.1, 30.0)])
        self.part: PathPart = path.parts[0]
        self.goal = goal
        random = np.random.default_rng(5)
        theta = np.linspace(2.0, 20.0, N + 1)
        reference = self.part.reference(theta)
        self.states = np.empty((N + 1, STATES))
        self.states[:, X] = reference.x + random.uniform(-1.0, 1.0, N + 1)
        self.states[:, Y] = reference.y + random.uniform(-1.0, 1.0, N + 1)
        self.states[:, PHI] = reference.phi + random.uniform(-0.3, 0.3, N + 1)
        self.states[:, V] = direction * random.uniform(1.0, 4.0, N + 1)
        self.states[:, DELTA] = random.uniform(-0.5, 0.5, N + 1)
        self.states[:, THETA] = theta + random.uniform(-0.5, 0.5, N + 1)
        self.controls = random.uniform(-1.0, 1.0, (N, CONTROLS))
        corridor = Corridor.from_offsets(path, left=2.2, right=-2.4)
        poses = np.column_stack([self.states[:, :2], np.zeros(N + 1)])
        near = contacts_of(corridor, 0, POINT, poses, 9.0)
        normal = near.values[:, 0, :, ALONG : ACROSS + 1].copy()
        self.walls = SoftWalls(distance=near.apart[:, 0].copy(), normal=normal)
        self.points = self.states[:, None, :2] - self.walls.distance[..., None] * normal

    def model(self, weights: PaperWeights) -> QuadraticCost:
        reference = self.part.reference(self.states[:, THETA])
        errors = frenet_errors(self.states, reference, self.part.direction)
        cost = quadratic_cost(self.states, self.controls, weights, errors, COMFORT, WHEELBASE)
        add_paper_terms(self.states, weights, self.walls, WHEELBASE, cost.state_hessian, cost.state_gradient)
        add_weight_slopes(errors, self.controls, self.walls, weights, cost.state_gradient)
        goal = np.array([self.goal.x, self.goal.y, self.goal.phi])
        add_goal(cost, weights, self.states[-1], goal, WHEELS)
        return cost

    def cost(self, states: Array, controls: Array, w: PaperWeights) -> float:
        """Eq. (C1)-(C4), (W7) stage by stage, walls as the straight lines that they are near the plan."""
        total, w = 0.0, self.blended(w, states[:, THETA])
        for k, (x, y, phi, v, delta, theta) in enumerate(states):
            error = Pose2(x, y, phi).relative_to(self.part.pose(theta))
            turned = phi - self.part.reference(np.array([theta])).phi[0]
            total += w.lag[k] * error.x**2 + w.contouring[k] * error.y**2 + w.heading[k] * turned**2
            lateral = v**2 * tan(delta) / WHEELBASE
            total += w.lateral_acceleration[k] * lateral**2
            total += w.comfort.lateral_acceleration[k] * discomfort(lateral, COMFORT.lateral_acceleration)
            for side in range(2):
                away = np.array([x, y]) - self.points[k, side]
                distance = float(self.walls.normal[k, side] @ away)
                total += w.bound_distance[k] * max(0.0, 2.0 - distance) ** 2
                total += w.bound_speed[k] * v**2 * max(0.0, 2.5 - distance) ** 2
        for k, u in enumerate(controls):
            total += w.acceleration[k] * u[A] ** 2 + w.steering_rate[k] * u[DELTA_DOT] ** 2
            total += w.virtual_speed[k] * u[THETA_DOT] ** 2 - w.progress_reward[k] * u[THETA_DOT]
            total += w.comfort.acceleration[k] * discomfort(u[A], COMFORT.acceleration)
            total += w.comfort.steering_rate[k] * discomfort(u[DELTA_DOT], COMFORT.steering_rate)
        last = states[-1]
        dx, dy, turn = last[X] - self.goal.x, last[Y] - self.goal.y, last[PHI] - self.goal.phi
        total += w.goal_speed * last[V] ** 2 + w.goal_wheels * (last[DELTA] - WHEELS) ** 2
        if not w.goal_clipped:
            return float(total + w.goal @ [dx**2, dy**2, turn**2])
        along = huber(float(np.hypot(dx, dy)), GOAL_CLIP[0])
        return float(total + w.goal[0] * along + w.goal[2] * huber(abs(turn), GOAL_CLIP[1]))

    def blended(self, w: PaperWeights, theta: Array) -> PaperWeights:
        """The weights at `theta` (N+1,), where those given are the ones at the plan's own."""
        if w.by_progress is None:
            return w
        change = {name: getattr(w.by_progress, name) * (theta - self.states[:, THETA]) for name in BLENDED}
        change["progress_reward"] = change["progress_reward"][:-1]
        return replace(w, **{name: getattr(w, name) + change[name] for name in BLENDED})


def discomfort(value: float, most: float) -> float:
    ease = COMFORT_EASE * most
    return huber(ease * log(1.0 + exp((abs(value) - most) / ease)), COMFORT_CLIP)


def huber(size: float, clip: float) -> float:
    return size**2 if size <= clip else 2.0 * clip * size - clip**2


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("name", TERMS)
def test_the_gradient_is_the_slope_of_the_cost(name: str, direction: int) -> None:
    last = Setting(direction, Pose2(0.0, 0.0, 0.0)).states[-1]
    for away in (0.1, 3.0):  # inside and beyond the clip
        goal = Pose2(last[X] + away, last[Y] - 0.5 * away, last[PHI] + 0.4 * away)
        setting = Setting(direction, goal)
        got = setting.model(TERMS[name])

        def by_states(z: Array, setting: Setting = setting) -> Array:
            return np.array(setting.cost(z.reshape(N + 1, STATES), setting.controls, TERMS[name]))

        def by_controls(u: Array, setting: Setting = setting) -> Array:
            return np.array(setting.cost(setting.states, u.reshape(N, CONTROLS), TERMS[name]))

        of_states = slopes(by_states, setting.states.ravel()).reshape(N + 1, STATES)
        of_controls = slopes(by_controls, setting.controls.ravel()).reshape(N, CONTROLS)
        assert np.abs(of_states).max() + np.abs(of_controls).max() > 0.0
        np.testing.assert_allclose(got.state_gradient, of_states, rtol=1e-5, atol=1e-4)
        np.testing.assert_allclose(got.control_gradient, of_controls, rtol=1e-5, atol=1e-4)


@pytest.mark.parametrize("name", TERMS)
def test_hessians_are_symmetric_and_positive_semi_definite(name: str) -> None:
    got = Setting(-1, Pose2(1.0, 2.0, 0.3)).model(TERMS[name])
    np.testing.assert_allclose(got.state_hessian, got.state_hessian.transpose(0, 2, 1), atol=1e-12)
    assert np.linalg.eigvalsh(got.state_hessian).min() > -1e-9
    assert (got.control_hessian >= 0.0).all()


@pytest.mark.parametrize("direction", [1, -1])
def test_gauss_newtons_hessian_is_that_of_the_linearised_residuals(direction: int) -> None:
    """g(z + dz) - g(z) = H dz where the residual is linear in what changes: lag error over x, y, v."""
    setting = Setting(direction, Pose2(0.0, 0.0, 0.0))
    before = setting.model(TERMS["lag"])
    move = np.zeros((N + 1, STATES))
    move[:, [X, Y]] = [0.3, -0.2]
    setting.states = setting.states + move
    after = setting.model(TERMS["lag"])
    rise = (after.state_gradient - before.state_gradient)[:, [X, Y]]
    np.testing.assert_allclose(
        rise, np.einsum("kij,kj->ki", before.state_hessian, move)[:, [X, Y]], rtol=1e-9
    )


def test_weights_of_zero_give_no_cost_at_all() -> None:
    got = Setting(1, Pose2(3.0, 4.0, 1.0)).model(NOTHING)
    for values in got:
        assert not values.any()


def test_the_pull_of_a_clipped_goal_is_bounded() -> None:
    weights = TERMS["clipped goal"]
    near, far = (Setting(1, Pose2(d, 0.0, 0.0)).model(weights).state_gradient[-1] for d in (1e3, 1e6))
    np.testing.assert_allclose(np.hypot(near[X], near[Y]), np.hypot(far[X], far[Y]), rtol=1e-9)
    assert np.hypot(far[X], far[Y]) == pytest.approx(2.0 * weights.goal[0] * GOAL_CLIP[0])
