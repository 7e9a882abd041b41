"""The speed of an obstacle divides by the time between two sights of it; contacts divide by a step's way."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from estimation import GoalEstimate, GoalStatus
from geometry import Corridor, Pose2, ReferencePath
from rti_mpcc.config import Caution, ControllerConfig, GoalTracking
from rti_mpcc.model.layout import STATES, V, X
from rti_mpcc.ocp.targets import goal_on
from rti_mpcc.planning.aim import rate_limited_goal
from rti_mpcc.planning.obstacles import observed
from rti_mpcc.planning.sensing import way_left
from rti_mpcc.planning.state import GoalState
from rti_mpcc.safety.contact import distance_to_contact
from rti_mpcc.types import Array, Trajectory
from tests.properties.magnitudes import examples, few_examples, from_zero, positive, signed

CONFIG = ControllerConfig(caution=Caution(check_spacing=0.01))
LEAST = CONFIG.clearance.least
PATH = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 40.0)])


def box(x: float, y: float = 0.0) -> Array:
    """A square of a metre, its near side at `x` [m]."""
    return np.array([[x, y - 0.5], [x + 1.0, y - 0.5], [x + 1.0, y + 0.5], [x, y + 0.5]])


@given(st.lists(st.tuples(positive(1e-9, 2.0), signed(1e-6, 5.0)), min_size=1, max_size=8))
@example([(1e-9, 0.19)])
@example([(5e-3, 0.19)])
@example([(1e-9, 0.0)])
@examples
def test_no_obstacle_is_taken_to_move_faster_than_one_can(sights: list[tuple[float, float]]) -> None:
    """However soon it was seen again: what seems faster is noise, or another obstacle."""
    now = place = 0.0
    known = observed((), [box(place)], now, now, CONFIG)
    for seconds, moved in sights:
        last, now, place = now, now + seconds, place + moved
        known = observed(known, [box(place)], now, last, CONFIG)
        (obstacle,) = known
        assert np.isfinite(obstacle.velocity).all()
        assert obstacle.speed <= CONFIG.obstacle_tracking.fastest * (1.0 + 1e-9)
        assert obstacle.moves or obstacle.speed == 0.0


@given(from_zero(1e-9, 20.0), positive(1e-3, 5.0))
@example(0.0, 0.05)
@few_examples
def test_a_steady_obstacle_has_its_own_speed(speed: float, cycle: float) -> None:
    speed = min(speed, CONFIG.obstacle_tracking.fastest)
    cycle = min(cycle, CONFIG.obstacle_tracking.forgotten)
    known = observed((), [box(0.0)], 0.0, 0.0, CONFIG)
    for k in range(1, 12):
        known = observed(known, [box(k * cycle * speed)], k * cycle, (k - 1) * cycle, CONFIG)
    if known[0].moves:
        assert known[0].speed == pytest.approx(speed, rel=1e-6)


def forward(way: float, stages: int = 10) -> Trajectory:
    """Straight on along the path, `way` [m] in a second."""
    states = np.zeros((stages + 1, STATES))
    states[:, X], states[:, V] = np.linspace(0.0, way, stages + 1), way
    return Trajectory(times=np.linspace(0.0, 1.0, stages + 1), states=states, controls=np.zeros((stages, 3)))


def way_before(gap: float, *, stages: int = 10) -> float:
    """Way [m] that a plan may drive on towards an obstacle that is so far ahead of the body [m]."""
    obstacle = box(CONFIG.vehicle.front + gap)
    corridor = Corridor.from_offsets(PATH, left=4.0, right=-4.0, obstacles=[obstacle])
    return distance_to_contact(forward(1.0, stages), corridor, 0, CONFIG, np.inf, least=LEAST)


@given(from_zero(1e-6, 0.3), from_zero(1e-6, 0.3))
@example(0.0, 0.0)
@example(0.9 * LEAST, 0.2 * LEAST)
@example(LEAST, LEAST)
@few_examples
def test_from_farther_off_a_plan_may_go_as_far_towards_an_obstacle_at_least(
    gap: float, farther: float
) -> None:
    near, far = way_before(gap), way_before(gap + farther)
    # The bodies that are looked at are a centimetre apart.
    assert far >= near - 1.01 * CONFIG.caution.check_spacing
    assert near <= gap + 1.01 * CONFIG.caution.check_spacing


@given(from_zero(1e-12, 1.0), st.integers(1, 20))
@example(0.0, 1)
@example(5e-10, 5)
@few_examples
def test_the_way_to_a_contact_is_found_on_a_plan_that_hardly_moves(way: float, stages: int) -> None:
    corridor = Corridor.from_offsets(PATH, left=4.0, right=-4.0, obstacles=[box(CONFIG.vehicle.front + 0.5)])
    found = distance_to_contact(forward(way, stages), corridor, 0, CONFIG, np.inf, least=LEAST)
    assert found == np.inf or 0.0 <= found <= way
    assert (found == np.inf) == (way < 0.5 - LEAST)


@given(signed(1e-9, 100.0), signed(1e-9, 100.0), st.floats(-3.0, 3.0), from_zero(1e-9, 10.0))
@example(0.0, 0.0, 0.0, 0.0)
@example(1.0, 0.0, 0.0, 0.0)
@example(0.0, 0.0, 0.1, 1e-9)
@examples
def test_the_pose_made_for_moves_no_faster_than_it_may_and_comes_to_the_estimate(
    x: float, y: float, turn: float, seconds: float
) -> None:
    tracking = GoalTracking(speed=0.5, turn_rate=0.3)
    config, here, there = ControllerConfig(goal_tracking=tracking), Pose2(0.0, 0.0, 0.0), Pose2(x, y, turn)
    seen = GoalEstimate(status=GoalStatus.TRACKING, pose=there, covariance=np.eye(3), age=0.0)
    known = GoalState(planned=here, pose=here, estimated_at=0.0)
    pose = rate_limited_goal(known, seen, None, seconds, config).pose
    assert pose is not None
    step = min(seconds, tracking.longest_step)
    assert np.hypot(pose.x, pose.y) <= 0.5 * step * (1.0 + 1e-9)
    assert abs(pose.phi) <= 0.3 * step * (1.0 + 1e-9) + 1e-12
    if np.hypot(x, y) <= 0.5 * step:
        assert (pose.x, pose.y) == (x, y)
    left = np.hypot(x - pose.x, y - pose.y)
    assert left == pytest.approx(max(np.hypot(x, y) - 0.5 * step, 0.0), abs=1e-9)


@given(signed(1e-12, 20.0), signed(1e-12, 5.0), st.floats(-1.0, 1.0))
@example(0.0, 0.0, 0.0)
@example(-1e-12, 0.4, 0.0)
@example(-1.0, 2.0, 0.0)
@examples
def test_the_way_left_is_never_negative_nor_shorter_than_what_is_left_along_the_path(
    left: float, beside: float, turn: float
) -> None:
    part, goal = PATH.parts[0], Pose2(30.0, 0.0, 0.0)
    here = Pose2(30.0 - left, beside, turn)
    theta = part.project(here.x, here.y)
    along, distance = way_left(here, theta, part.pose(theta), part, goal_on(part, goal), 0.5)
    assert along == pytest.approx(left, abs=1e-9)
    assert distance >= max(along, 0.0)
    assert distance <= np.hypot(left, beside) + 1e-9
    if left < 0.0 and np.hypot(left, beside) >= 0.5 + 1e-9:
        assert distance == 0.0
