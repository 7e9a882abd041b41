from __future__ import annotations

from math import pi
from typing import Any

import numpy as np
import pytest

from geometry import Corridor, Pose2, ReferencePath
from rti_mpcc.config import ControllerConfig, Limits, SolverSettings, Vehicle, Weights
from rti_mpcc.controller import RtiMpcc
from rti_mpcc.course.guess import Course, arrival_guess, cruise_guess
from rti_mpcc.course.speed_profile import speed_profile_of
from rti_mpcc.iteration import Solution
from rti_mpcc.model.footprint import clearances
from rti_mpcc.model.layout import DELTA, DELTA_DOT, PHI, THETA, A, V, X, Y
from rti_mpcc.ocp.horizon import stage_lengths, stage_times
from rti_mpcc.ocp.objectives import STAGE_LENGTH, ArrivalAtRest, TargetKind
from rti_mpcc.paper.objective import CartesianPose
from rti_mpcc.types import Array, Trajectory
from tests.lists import acceptance
from tests.rti_mpcc.model_steps import step

FORWARD = [(1, 0.0, 10.0), (1, 0.1, 10.0), (1, 0.0, 10.0)]
TIGHT = SolverSettings(tolerance=1e-6)
DAMPING = 1e-4
"""As little as lets repeated steps come to rest within a few."""
SMALL: dict[str, Any] = {"stages": 30, "solver": TIGHT}


def core(
    segments: list[tuple[int, float, float]] | None = None, width: float = 5.0, **changes: Any
) -> RtiMpcc:
    path = ReferencePath.from_segments(Pose2(1.0, 2.0, 0.5), segments or FORWARD)
    obstacles = changes.pop("obstacles", ())
    corridor = Corridor.from_offsets(path, left=width, right=-width, obstacles=obstacles)
    preset = changes.pop("preset", ControllerConfig)
    return RtiMpcc(path.parts[0], corridor, preset(**{**SMALL, **changes}))


def at(mpcc: RtiMpcc, theta: float, *, v: float = 0.0, delta: float = 0.0, left: float = 0.0) -> Array:
    pose = mpcc.part.pose(theta).compose(Pose2(0.0, left, 0.0))
    return np.array([pose.x, pose.y, pose.phi, v, delta, theta])


def arrive(mpcc: RtiMpcc, state: Array, seconds: float, iterations: int = 8) -> Solution:
    """Iterate a planned arrival from a first guess until it hardly moves any more."""
    config = mpcc.config
    times = stage_times(0.0, stage_lengths(seconds, config.cycle, config.stages))
    distance = mpcc.target.theta - state[THETA]
    guess = arrival_guess(
        Course(mpcc.part, mpcc.target), state, times, distance, speed_profile_of(mpcc.part, config), config
    )
    return repeat(mpcc, state, guess, iterations, objective=ArrivalAtRest(seconds))


def guessed(mpcc: RtiMpcc, state: Array) -> Trajectory:
    """The first guess of a cruise."""
    config = mpcc.config
    times = stage_times(0.0, stage_lengths(config.cruise_horizon, config.cycle, config.stages))
    return cruise_guess(
        Course(mpcc.part, mpcc.target), state, times, speed_profile_of(mpcc.part, config), config
    )


def cruise(mpcc: RtiMpcc, state: Array, iterations: int = 8, **options: Any) -> Solution:
    return repeat(mpcc, state, guessed(mpcc, state), iterations, **options)


def repeat(mpcc: RtiMpcc, state: Array, guess: Trajectory, iterations: int, **options: Any) -> Solution:
    mpcc.prepare(0.0, plan=guess, damping=DAMPING, **options)
    solution = mpcc.feedback(state, 0.0)
    for _ in range(iterations - 1):
        mpcc.prepare(0.0, last=solution, damping=DAMPING, **options)
        solution = mpcc.feedback(state, 0.0)
    assert solution.solved, solution.status
    return solution


def test_an_arrival_ends_at_rest_at_the_goal_and_obeys_the_dynamics() -> None:
    mpcc = core()
    goal = mpcc.part.last.compose(Pose2(0.5, 1.0, 0.1))
    mpcc.set_goal(goal)
    solution = arrive(mpcc, at(mpcc, 0.0), 25.0)
    plan = solution.trajectory
    np.testing.assert_allclose(plan.states[-1, :4], [goal.x, goal.y, goal.phi, 0.0], atol=0.25)
    np.testing.assert_allclose(plan.states[-1, :3], [goal.x, goal.y, goal.phi], atol=0.02)
    reached = step(plan.states[:-1], plan.controls, np.diff(plan.times), mpcc.config.vehicle.wheelbase)
    np.testing.assert_allclose(reached[:, :5], plan.states[1:, :5], atol=5e-3)
    assert solution.slack.max() < 1e-3


def test_a_straight_arrival_is_the_cubic_of_least_acceleration() -> None:
    """a(t) is linear in time: Pontryagin for r a² with the end's weights q on position and p on speed.

    a = f (T - t) + g with r f = q (D - x_T) and r g = -p v_T.
    """
    mpcc = core([(1, 0.0, 30.0)], comfort_acceleration=1.0)
    solution = arrive(mpcc, at(mpcc, 0.0), 20.0)
    distance, span, weights = 30.0, 20.0, mpcc.config.weights
    r = weights.acceleration / STAGE_LENGTH
    q, p = weights.arrival_pose, weights.arrival_speed
    # v_T = f T²/2 + g T and x_T = f T³/3 + g T²/2
    lines = [[r + q * span**3 / 3.0, q * span**2 / 2.0], [p * span**2 / 2.0, r + p * span]]
    f, g = np.linalg.solve(lines, [q * distance, 0.0])
    middle = 0.5 * (solution.trajectory.times[1:] + solution.trajectory.times[:-1])
    np.testing.assert_allclose(solution.trajectory.controls[:, A], f * (span - middle) + g, atol=5e-3)
    np.testing.assert_allclose(solution.trajectory.states[:, DELTA], 0.0, atol=1e-4)


def limited(**limits: float) -> Limits:
    return Limits(**{**Limits().model_dump(), **limits})


def test_speed_limit_with_and_without() -> None:
    for limit in (1.5, 10.0):
        weights = Weights(virtual_speed=0.0)
        mpcc = core([(1, 0.0, 300.0)], weights=weights, limits=limited(speed=limit))
        speed = cruise(mpcc, at(mpcc, 5.0, v=1.0)).trajectory.states[:, V].max()
        assert speed == pytest.approx(limit, abs=1e-3) if limit < 2.0 else speed > 3.0


def test_a_cruise_keeps_to_the_comfort_acceleration() -> None:
    """From rest the reward asks for more: k v_c of (T4)."""
    most = []
    for weights in (Weights(comfort=(0.0, 0.0, 0.0)), Weights()):
        mpcc = core([(1, 0.0, 300.0)], weights=weights, comfort_acceleration=0.2)
        most.append(cruise(mpcc, at(mpcc, 5.0), 20).trajectory.controls[:, A].max())
    assert most[0] > 0.25
    assert most[1] < 0.21


@pytest.mark.parametrize("direction", [acceptance(1), -1])
def test_in_a_bend_an_arrival_keeps_to_the_comfort_of_load_and_steering(direction: int) -> None:
    bends = [(direction, 0.2, 12.0), (direction, -0.2, 12.0)]
    comfort = {"comfort_lateral_acceleration": 0.3, "comfort_steering_rate": 0.12}
    most = []
    for settings in ({"weights": Weights(arrival_comfort=(0.0, 0.0, 0.0))}, comfort):
        mpcc = core(bends, width=2.5, **settings)
        plan = arrive(mpcc, at(mpcc, 0.0, delta=0.5), 24.0, 30).trajectory
        lateral = plan.states[:, V] ** 2 * np.tan(plan.states[:, DELTA]) / mpcc.config.vehicle.wheelbase
        most.append((np.abs(lateral).max(), np.abs(plan.controls[:, DELTA_DOT]).max()))
    assert most[0][0] > 0.33
    assert most[0][1] > 0.13
    assert most[1][0] < 1.05 * comfort["comfort_lateral_acceleration"]
    assert most[1][1] < 1.05 * comfort["comfort_steering_rate"]


@pytest.mark.parametrize(
    ("name", "values", "free", "aside", "theta", "quantity"),
    [
        ("steering", (0.25, 0.6), 0.3, 3.0, 6.0, lambda plan: plan.states[:, DELTA]),
        ("steering_rate", (0.06, 1.0), 0.08, 2.0, 8.0, lambda plan: plan.controls[:, DELTA_DOT]),
    ],
)
def test_steering_limits_with_and_without(
    name: str, values: tuple[float, float], free: float, aside: float, theta: float, quantity: Any
) -> None:
    for limit in values:
        mpcc = core([(1, 0.0, 20.0)], limits=limited(**{name: limit}))
        mpcc.set_goal(mpcc.part.last.compose(Pose2(0.0, aside, 0.0)))
        largest = np.abs(quantity(arrive(mpcc, at(mpcc, theta), 15.0, 15).trajectory)).max()
        assert largest == pytest.approx(limit, abs=1e-3) if limit == values[0] else largest > free


def test_only_an_objective_that_leaves_the_path_drives_both_ways() -> None:
    """A goal 1 m behind the vehicle is reached in reverse by that alone."""
    for objective, both in ((ArrivalAtRest(8.0), False), (CartesianPose(), True)):
        mpcc = core([(1, 0.0, 20.0)])
        mpcc.set_goal(mpcc.part.pose(15.0))
        state = at(mpcc, 16.0)
        times = stage_times(0.0, stage_lengths(8.0, 0.05, 30))
        plan = Trajectory(times=times, states=np.tile(state, (31, 1)), controls=np.zeros((30, 3)))
        arrived = repeat(mpcc, state, plan, 8, objective=objective)
        slowest = arrived.trajectory.states[:, V].min()
        assert slowest < -0.1 if both else slowest == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_goal_that_lies_too_far_to_the_side_is_not_reached_through_the_boundary(side: float) -> None:
    mpcc = core([(1, 0.0, 30.0)], width=2.0)
    path = ReferencePath.from_segments(Pose2(1.0, 2.0, 0.5), [(1, 0.0, 30.0)])
    corridor = Corridor.from_offsets(path, left=2.0, right=-2.0)
    mpcc.set_goal(mpcc.part.pose(22.0).compose(Pose2(0.0, 1.5 * side, 0.0)))
    plan = arrive(mpcc, at(mpcc, 2.0), 20.0, 15).trajectory
    gap = float(clearances(plan.states, corridor, 0, mpcc.config.vehicle).min())
    assert gap > mpcc.config.clearance.wanted - 0.01


def test_an_obstacle_is_passed_with_and_without() -> None:
    """A block beside the straight way in: the plan goes round it on its side."""
    block = np.array([[-0.8, -0.8], [0.8, -0.8], [0.8, 0.8], [-0.8, 0.8]])
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 40.0)])
    for there in (True, False):
        obstacles = [block + np.array([18.0, -1.5])] if there else []
        corridor = Corridor.from_offsets(path, left=6.0, right=-6.0, obstacles=obstacles)
        mpcc = RtiMpcc(path.parts[0], corridor, ControllerConfig(**SMALL))
        plan = arrive(mpcc, at(mpcc, 0.0), 25.0, 15).trajectory
        beside = plan.states[np.abs(plan.states[:, X] - 17.0) < 2.0, Y]
        assert beside.min() > 0.2 if there else abs(beside).max() < 1e-2


def test_a_measured_state_outside_the_limits_is_admitted_and_returns() -> None:
    mpcc = core([(1, 0.0, 60.0)], limits=limited(speed=2.0, steering=0.4))
    mpcc.prepare(0.0, plan=guessed(mpcc, at(mpcc, 5.0, v=2.0)))
    solution = mpcc.feedback(at(mpcc, 5.0, v=2.3, delta=-0.43), 0.0)
    assert solution.solved
    states = solution.trajectory.states
    assert states[0, [V, DELTA]] == pytest.approx([2.3, -0.43], abs=1e-4)
    assert states[-1, V] <= 2.0 + 1e-3
    assert states[-1, DELTA] >= -0.4 - 1e-3


def test_a_heading_on_another_branch_changes_nothing() -> None:
    mpcc = core()
    state = at(mpcc, 3.0, v=1.0, left=0.2)
    plain = cruise(mpcc, state, 2)
    turned = state.copy()
    turned[PHI] += 4.0 * pi
    mpcc.prepare(0.0, last=plain)
    once = mpcc.feedback(state, 0.0)
    mpcc.prepare(0.0, last=plain)
    again = mpcc.feedback(turned, 0.0)
    np.testing.assert_allclose(again.trajectory.states, once.trajectory.states, atol=2e-3)


@pytest.mark.parametrize("cycle", [0.005, 0.05, 0.2])
def test_the_plan_shifts_by_any_cycle(cycle: float) -> None:
    """A vehicle that does as planned finds nearly the same plan one cycle on."""
    mpcc = core(cycle=cycle)
    mpcc.set_goal(mpcc.part.last.compose(Pose2(0.0, 0.5, 0.0)))
    before = arrive(mpcc, at(mpcc, 0.0), 20.0, 10).trajectory
    assert np.diff(before.times)[0] == pytest.approx(cycle)
    mpcc.prepare(cycle, objective=ArrivalAtRest(20.0))
    after = mpcc.feedback(before.states[1], cycle).trajectory
    assert after.times[0] == pytest.approx(cycle)
    assert after.times[-1] == pytest.approx(20.0)
    np.testing.assert_allclose(after.controls[0, :2], before.controls[1, :2], atol=0.03)
    np.testing.assert_allclose(after.states[-1, :3], before.states[-1, :3], atol=0.01)


def test_a_qp_that_is_not_solved_leaves_the_plan_that_was_linearised_about() -> None:
    mpcc = core()
    state = at(mpcc, 3.0, v=1.0)
    linear = mpcc.prepare(0.0, plan=guessed(mpcc, state))
    solution = mpcc.feedback(state, 0.0, ends=lambda _: "enough")
    assert not solution.solved
    assert solution.status
    np.testing.assert_allclose(solution.trajectory.states, linear.trajectory.states, atol=1e-12)
    np.testing.assert_array_equal(solution.trajectory.controls, linear.trajectory.controls)


def test_numbers_that_are_no_numbers_are_refused_and_the_next_cycle_works() -> None:
    mpcc = core()
    state = at(mpcc, 3.0, v=1.0)
    good = cruise(mpcc, state, 3)
    mpcc.prepare(0.0, last=good, damping=DAMPING)
    expected = mpcc.feedback(state, 0.0)
    for quantity in (X, V, THETA):
        spoilt = state.copy()
        spoilt[quantity] = np.nan
        mpcc.prepare(0.0, last=good)
        refused = mpcc.feedback(spoilt, 0.0)
        assert not refused.solved
        assert np.isfinite(refused.trajectory.states).all()
    mpcc.prepare(0.0, last=good, damping=DAMPING)
    again = mpcc.feedback(state, 0.0)
    assert again.solved
    np.testing.assert_allclose(again.trajectory.states, expected.trajectory.states, atol=1e-2)


def test_the_target_is_the_parts_end_or_a_goal_on_any_branch() -> None:
    mpcc = core()
    goal = mpcc.part.pose(20.0).compose(Pose2(0.0, 1.0, 0.2))
    for turns in (-1, 0, 2):
        mpcc.set_goal(Pose2(goal.x, goal.y, goal.phi + 2.0 * pi * turns))
        assert mpcc.target.kind is TargetKind.POSE
        assert mpcc.target.stop == pytest.approx(20.0)
        assert mpcc.target.pose.phi == pytest.approx(goal.phi)
    mpcc.set_goal(mpcc.part.pose(25.0))
    assert mpcc.target.theta == pytest.approx(25.0)
    mpcc.set_goal(None)
    assert (mpcc.target.kind, mpcc.target.pose) == (TargetKind.PATH_END, mpcc.part.last)


def test_mirrored_problems_have_mirrored_plans() -> None:
    plans = []
    for side in (1.0, -1.0):
        path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(-1, 0.1 * side, 10.0), (-1, 0.0, 10.0)])
        corridor = Corridor.from_offsets(path, left=4.0, right=-4.0)
        mpcc = RtiMpcc(path.parts[0], corridor, ControllerConfig(**SMALL))
        mpcc.set_goal(path.end.compose(Pose2(-1.0, 1.5 * side, 0.2 * side)))
        plans.append(arrive(mpcc, at(mpcc, 0.0), 20.0).trajectory)
    sign = np.array([1.0, -1.0, -1.0, 1.0, -1.0, 1.0])
    np.testing.assert_allclose(plans[0].states, plans[1].states * sign, atol=1e-3)


@pytest.mark.parametrize("preset", [ControllerConfig, ControllerConfig.paper, ControllerConfig.paper_printed])
def test_all_presets_solve_their_first_problem(preset: Any) -> None:
    mpcc = core([(1, 0.0, 60.0)], preset=preset, vehicle=Vehicle())
    assert cruise(mpcc, at(mpcc, 2.0, v=1.0), 3).trajectory.states[-1, THETA] > 5.0
