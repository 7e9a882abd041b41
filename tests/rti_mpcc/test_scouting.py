"""The list of candidates for a first plan: what a search that runs out of time keeps of it."""

from __future__ import annotations

from dataclasses import replace
from math import cos, radians, sin

import numpy as np
import pytest

from geometry import Corridor, Pose2, ReferencePath
from rti_mpcc.config import ControllerConfig
from rti_mpcc.controller import RtiMpcc
from rti_mpcc.docking import DockingController
from rti_mpcc.model.footprint import body_polygons
from rti_mpcc.ocp.targets import goal_on
from rti_mpcc.planning.context import PlanningContext
from rti_mpcc.planning.pace import pace_of
from rti_mpcc.planning.state import Candidate, ControllerState, Obstruction
from rti_mpcc.planning.workspace import Workspace
from rti_mpcc.safety.contact import stop_clearance
from rti_mpcc.scouting import first_plan
from rti_mpcc.types import Reason, VehicleState
from tests.rti_mpcc.docking_runs import granting
from tests.rti_mpcc.states import PATH, backing_up, begun_for, contexts, put, state, stop_at

CONFIG = ControllerConfig()
ALL = tuple(Candidate)
ONWARD, PAST, STOP, BACK = ALL
GOAL = goal_on(PATH.parts[0], Pose2(19.0, 0.3, 0.0))
SEEN = Obstruction(at=12.0, detours=())


@pytest.fixture(scope="module")
def mpcc() -> RtiMpcc:
    return RtiMpcc(PATH.parts[0], Corridor.from_offsets(PATH, left=5.0, right=-5.0), CONFIG)


def standing() -> PlanningContext:
    return contexts.standing(5.0, target=GOAL)


def workspace(mpcc: RtiMpcc, iterations: int) -> Workspace:
    """One whose cycle has time for so many iterations."""
    pace, clock = pace_of(PATH.parts[0], CONFIG), granting(iterations)
    return Workspace(config=CONFIG, mpcc=mpcc, pace=pace, start=standing().state, clock=clock)


def left(s: ControllerState, w: Workspace) -> tuple[Candidate, ...]:
    """What is still to be tried after a cycle."""
    begun = first_plan(s, standing(), w).s.plans.suspended
    assert begun is not None
    return begun.candidates


@pytest.mark.parametrize("iterations", [0, 1])
def test_a_search_that_has_just_begun_has_all_before_it(iterations: int, mpcc: RtiMpcc) -> None:
    s = state(standing_since=1.0)
    assert left(s, workspace(mpcc, iterations)) == ALL


def test_what_is_left_stays_left(mpcc: RtiMpcc) -> None:
    """After one that backs up was sought in vain, the search onward is the last one."""
    begun = begun_for(None, target=GOAL, reverse_failed=True)
    assert begun.candidates == (ONWARD, PAST, STOP)
    assert left(state(standing_since=1.0, suspended=begun), workspace(mpcc, 0)) == (ONWARD, PAST, STOP)


def test_before_one_that_backs_up_nothing_is_kept(mpcc: RtiMpcc) -> None:
    begun = begun_for(None, target=GOAL, segment=backing_up())
    s = state(standing_since=1.0, suspended=begun)
    expected = (BACK, ONWARD, PAST, STOP)
    assert left(s, workspace(mpcc, 0)) == expected
    again = put(s, suspended=first_plan(s, standing(), workspace(mpcc, 0)).s.plans.suspended)
    assert left(again, workspace(mpcc, 0)) == expected


def test_a_target_that_moves_is_sought_onward_again(mpcc: RtiMpcc) -> None:
    """Not past what filled the way to where it was."""
    moved = replace(GOAL, pose=Pose2(19.0, -0.7, 0.0))
    begun = begun_for(None, target=moved, obstruction=SEEN)
    assert begun.candidates == (PAST, STOP, BACK)
    s = state(standing_since=1.0, suspended=begun)
    after = first_plan(s, standing(), workspace(mpcc, 0)).s
    assert after.plans.suspended is not None
    assert after.plans.suspended.obstruction is None
    assert after.plans.suspended.candidates == ALL
    found = first_plan(after, standing(), workspace(mpcc, 10))
    assert not found.attempt.problem
    assert found.s.task.drives


def test_on_the_way_to_a_stop_there_is_nothing_else(mpcc: RtiMpcc) -> None:
    s = state(standing_since=1.0, stop=stop_at(12.0))
    context = replace(standing(), free=False, ends_at_goal=False)
    begun = first_plan(s, context, workspace(mpcc, 0)).s.plans.suspended
    assert begun is not None
    assert begun.candidates == (ONWARD,)


@pytest.mark.parametrize("x", [12.0, 18.0])
def test_a_wall_right_here_is_no_less_one_for_an_obstacle_behind_it(x: float) -> None:
    """Turned to a wall 0.6 m away it has no plan, and does not wait for the box far along its path."""
    box = np.array([[x, -4.0], [x + 0.5, -4.0], [x + 0.5, 4.0], [x, 4.0]])
    lane = Corridor.from_offsets(PATH, left=4.0, right=-4.0, obstacles=[box])
    controller = DockingController(PATH, lane, CONFIG)
    command = controller.step(VehicleState(x=2.0, y=0.0, phi=radians(-60.0), v=0.0, delta=0.0), now=0.0)
    assert command.diagnostics.cause is Reason.SEARCHES_PLAN
    whys = ("the plan leaves the corridor by ", "no plan from here stays clear: contact in ")
    assert command.diagnostics.reason.startswith(whys)
    assert controller.state.task.stop is None


def test_a_stop_before_something_in_a_bend_is_where_the_body_on_the_path_meets_it() -> None:
    """Wherever the vehicle comes from: the plans that find what fills the way are beside the path, and gain
    more progress than they drive, or less."""
    radius, at = 12.0, 18.0
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 1.0 / radius, 25.0)])
    across = [
        (r * sin(angle), radius - r * cos(angle))
        for r, angle in ((6.0, at / radius), (18.0, at / radius), (18.0, 1.55), (6.0, 1.55))
    ]
    lane = Corridor.from_offsets(path, left=5.0, right=-5.0, obstacles=[np.array(across)])
    stops = []
    for y in (-3.0, 0.0, 3.0):
        controller = DockingController(path, lane, CONFIG)
        controller.step(VehicleState(x=0.0, y=y, phi=0.0, v=0.0, delta=0.0), now=0.0)
        assert controller.state.task.stop is not None
        stops.append(controller.state.task.stop.at)
    assert np.ptp(stops) <= CONFIG.caution.check_spacing
    bodies = [path.parts[0].pose(stop + 0.01 * k) for stop in stops[:1] for k in range(500)]
    poses = np.array([(pose.x, pose.y, pose.phi) for pose in bodies])
    free = 0.01 * np.argmax(lane.collides(0, body_polygons(poses, CONFIG.vehicle)))
    clearance = stop_clearance(CONFIG)
    assert clearance - CONFIG.caution.check_spacing <= free <= clearance + 0.02


def test_with_time_enough_the_first_one_is_driven(mpcc: RtiMpcc) -> None:
    found = first_plan(state(standing_since=1.0), standing(), workspace(mpcc, 30))
    assert not found.attempt.problem
    assert found.s.task.drives
    assert found.s.plans.suspended is None
    assert not found.s.task.segment.reverses_into_goal


def test_a_plan_that_there_is_no_time_to_iterate_on_is_gone_on_from(mpcc: RtiMpcc) -> None:
    """It misses the goal, by however little, and took all of the cycle's time."""
    context = replace(standing(), tolerance=(1e-9, 1e-9, 1e-9))
    least = CONFIG.search.first_iterations
    found = first_plan(state(standing_since=1.0), context, workspace(mpcc, least))
    assert found.attempt.out_of_time
    begun = found.s.plans.suspended
    assert begun is not None
    assert begun.solution is found.attempt.solved is not None
    assert begun.iterations == least
