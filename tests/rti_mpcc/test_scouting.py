"""The list of candidates for a first plan: what a search that runs out of time keeps of it, what asks for
another way."""

from __future__ import annotations

from dataclasses import replace
from math import cos, radians, sin
from typing import Any

import numpy as np
import pytest

from geometry import Corridor, Pose2, ReferencePath
from rti_mpcc.config import ControllerConfig
from rti_mpcc.controller import RtiMpcc
from rti_mpcc.docking import DockingController
from rti_mpcc.model.footprint import body_polygons
from rti_mpcc.model.layout import PHI, X, Y
from rti_mpcc.ocp.targets import goal_on
from rti_mpcc.planning.context import PlanningContext
from rti_mpcc.planning.pace import pace_of
from rti_mpcc.planning.plausibility import StateMonitor
from rti_mpcc.planning.search import FIRST_ITERATIONS, SqpResult
from rti_mpcc.planning.state import ControllerState, RouteState
from rti_mpcc.planning.ways import CHECK_SPACING
from rti_mpcc.planning.workspace import Workspace
from rti_mpcc.safety.contact import stop_clearance
from rti_mpcc.scouting import ACCEPTED_MISS, first_plan
from rti_mpcc.types import Reason, VehicleState
from tests.rti_mpcc.docking_runs import granting
from tests.rti_mpcc.planned import no_manoeuvre
from tests.rti_mpcc.states import AREA, NOW, PATH, begun_for, contexts, put, state, stop_at

CONFIG = ControllerConfig()
GOAL = goal_on(PATH.parts[0], Pose2(19.0, 0.3, 0.0))
STAYS = ControllerConfig(recovery=False)
"""Of a vehicle that plans no ways."""


@pytest.fixture(scope="module")
def mpcc() -> RtiMpcc:
    return RtiMpcc(PATH.parts[0], Corridor.from_offsets(PATH, left=5.0, right=-5.0), CONFIG)


def standing() -> PlanningContext:
    return contexts.standing(5.0, target=GOAL)


def workspace(mpcc: RtiMpcc, iterations: int) -> Workspace:
    """One whose cycle has time for so many iterations."""
    pace, clock = pace_of(PATH.parts[0], CONFIG), granting(iterations)
    return Workspace(config=CONFIG, mpcc=mpcc, pace=pace, start=standing().state, clock=clock)


def first(
    mpcc: RtiMpcc, s: ControllerState, iterations: int = 100, **changes: Any
) -> tuple[ControllerState, SqpResult]:
    """The state with which a first plan would be driven, and the last attempt."""
    found = first_plan(s, replace(standing(), **changes), workspace(mpcc, iterations))
    return found.s, found.attempt


def test_a_target_that_moves_is_sought_anew(mpcc: RtiMpcc) -> None:
    moved = replace(GOAL, pose=Pose2(19.0, -0.7, 0.0))
    s = state(standing_since=1.0, suspended=begun_for(None, target=moved))
    after = first_plan(s, standing(), workspace(mpcc, 0)).s
    assert after.plans.suspended is not None
    assert after.plans.suspended.target == GOAL
    found = first_plan(after, standing(), workspace(mpcc, 10))
    assert not found.attempt.problem
    assert found.s.task.drives


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
        controller = DockingController(path, lane, STAYS)
        controller.step(VehicleState(x=0.0, y=y, phi=0.0, v=0.0, delta=0.0), now=0.0)
        assert controller.state.task.stop is not None
        stops.append(controller.state.task.stop.at)
    assert np.ptp(stops) <= CHECK_SPACING
    bodies = [path.parts[0].pose(stop + 0.01 * k) for stop in stops[:1] for k in range(500)]
    poses = np.array([(pose.x, pose.y, pose.phi) for pose in bodies])
    free = 0.01 * np.argmax(lane.collides(0, body_polygons(poses, CONFIG.vehicle)))
    clearance = stop_clearance(CONFIG)
    assert clearance - CHECK_SPACING <= free <= clearance + 0.02


@pytest.mark.parametrize("x", [12.0, 18.0])
@pytest.mark.parametrize("config", [STAYS, CONFIG], ids=["stays", "plans ways"])
def test_a_wall_right_here_is_no_less_one_for_an_obstacle_behind_it(
    x: float, config: ControllerConfig
) -> None:
    """Turned to a wall 0.6 m away it has no plan, and does not wait for the box far along its path."""
    box = np.array([[x, -4.0], [x + 0.5, -4.0], [x + 0.5, 4.0], [x, 4.0]])
    lane = Corridor.from_offsets(PATH, left=4.0, right=-4.0, obstacles=[box])
    controller = DockingController(PATH, lane, config)
    command = controller.step(VehicleState(x=2.0, y=0.0, phi=radians(-60.0), v=0.0, delta=0.0), now=0.0)
    assert command.diagnostics.cause is (Reason.PLANS_WAY if config.recovers else Reason.SEARCHES_PLAN)
    whys = ("the plan leaves the corridor by ", "no plan from here stays clear: contact in ")
    assert command.diagnostics.reason.removeprefix("planning a way: ").startswith(whys)
    assert controller.state.task.stop is None


# -- onward, and a plan that misses --------------------------------------------------------------------------

PLANNED = RouteState(end=PATH.end, ways=1)


@pytest.mark.parametrize("route", [None, PLANNED], ids=["stays", "plans ways"])
def test_with_time_enough_the_first_one_is_driven(route: RouteState | None, mpcc: RtiMpcc) -> None:
    s, attempt = first(mpcc, state(standing_since=1.0, route=route))
    assert not attempt.problem
    assert s.task.drives
    assert s.plans.suspended is None
    assert s.route is route


def missing_by(share: float, mpcc: RtiMpcc) -> dict[str, Any]:
    """A tolerance that the first plan misses by so many times of it, however long it is iterated on."""
    s, attempt = first(mpcc, state(standing_since=1.0, route=PLANNED), tolerance=(1e-9, 1e-9, 1e-9))
    assert s.route is not None
    assert s.route.wanted
    end = Pose2(*attempt.plan.states[-1, [X, Y, PHI]].tolist()).relative_to(GOAL.pose)
    return {"tolerance": tuple(max(abs(off), 1e-12) / share for off in (end.x, end.y, end.phi))}


def test_a_first_plan_that_misses_the_goal_by_too_much_asks_for_another_way(mpcc: RtiMpcc) -> None:
    s = state(standing_since=1.0, route=PLANNED)
    most = ACCEPTED_MISS
    after, _ = first(mpcc, s, **missing_by(1.1 * most, mpcc))
    assert after == replace(s, route=replace(PLANNED, wanted="the first plan misses the goal"))
    near, _ = first(mpcc, s, **missing_by(0.9 * most, mpcc))
    assert near.task.drives
    assert near.route is PLANNED


@pytest.mark.parametrize(
    "values",
    [
        {"route": None},
        {"route": replace(PLANNED, manoeuvre=no_manoeuvre(Pose2(5.0, 0.0, 0.0), PATH.end), since=NOW - 1.0)},
    ],
    ids=["plans no ways", "asked a moment ago"],
)
def test_one_that_misses_is_driven_where_no_other_way_is_asked_for(
    values: dict[str, Any], mpcc: RtiMpcc
) -> None:
    here = StateMonitor(at=NOW, state=np.array([5.0, 0.0, 0.0, 0.0, 0.0, 0.0]))
    s = state(**{"standing_since": 1.0, "route": PLANNED, "monitor": here, **values})
    after, _ = first(mpcc, s, tolerance=(1e-9, 1e-9, 1e-9))
    assert after.task.drives
    assert after.route is s.route
    later = put(s, route=values.get("route") and replace(values["route"], since=NOW - 100.0))
    if later.route is not None:
        wanting, _ = first(mpcc, later, tolerance=(1e-9, 1e-9, 1e-9))
        assert wanting.route is not None
        assert wanting.route.wanted


def test_a_plan_to_a_cusp_that_misses_it_is_driven(mpcc: RtiMpcc) -> None:
    s = state(standing_since=1.0, route=PLANNED)
    after, _ = first(mpcc, s, tolerance=(1e-9, 1e-9, 1e-9), ends_at_goal=False)
    assert after.task.drives


def test_a_plan_that_there_is_no_time_to_iterate_on_is_gone_on_from(mpcc: RtiMpcc) -> None:
    """It misses the goal, by however little, and took all of the cycle's time; it wants nothing yet."""
    least = FIRST_ITERATIONS
    s = state(standing_since=1.0, route=PLANNED)
    s, attempt = first(mpcc, s, least, tolerance=(1e-9, 1e-9, 1e-9))
    assert attempt.out_of_time
    begun = s.plans.suspended
    assert begun is not None
    assert begun.solution is attempt.solved is not None
    assert begun.iterations == least
    assert s.route is PLANNED


# -- what fills the way ----------------------------------------------------------------------------------

ACROSS = np.array([[12.0, -5.0], [12.5, -5.0], [12.5, 5.0], [12.0, 5.0]])
FILLED = AREA.updated([ACROSS], NOW)


@pytest.fixture(scope="module")
def blocked() -> RtiMpcc:
    return RtiMpcc(PATH.parts[0], FILLED.corridor, CONFIG)


def before_it(**values: Any) -> ControllerState:
    """At rest 7 m before something across the way, where other ways can be planned."""
    here = StateMonitor(at=NOW, state=np.array([5.0, 0.0, 0.0, 0.0, 0.0, 0.0]))
    usual = {"standing_since": 1.0, "route": PLANNED, "area": FILLED, "monitor": here, "target": GOAL}
    return state(**{**usual, **values})


def asked(ago: float, **changes: Any) -> RouteState:
    """A way from here was planned in vain, so long ago [s]."""
    start = Pose2(5.0, 0.0, 0.0)
    known = {"manoeuvre": no_manoeuvre(start, PATH.end), "since": NOW - ago, "changes": FILLED.changes}
    return replace(PLANNED, **{**known, **changes})


AGAIN = CONFIG.route.again_after


def test_from_rest_another_way_is_asked_for_with_the_reason(blocked: RtiMpcc) -> None:
    """Nothing else of the state changes: no stop is made for, and no search goes on."""
    s = before_it()
    for begun in (None, begun_for(None, target=GOAL)):
        after, attempt = first(blocked, s.suspending(begun))
        assert after.route is not None
        assert after.route.wanted == (attempt.problem or "something fills the way")
        assert after == replace(s, route=replace(PLANNED, wanted=after.route.wanted))


@pytest.mark.parametrize(
    "route",
    [
        asked(AGAIN),
        asked(1.0, changes=FILLED.changes + 1),
        asked(1.0, manoeuvre=no_manoeuvre(PATH.end, PATH.end)),
    ],
    ids=["a while ago", "with other obstacles", "from elsewhere"],
)
def test_what_was_asked_otherwise_is_asked_again(route: RouteState, blocked: RtiMpcc) -> None:
    after, _ = first(blocked, before_it(route=route))
    assert after.route is not None
    assert after.route.wanted


@pytest.mark.parametrize(
    "values",
    [{"route": None}, {"route": asked(0.9 * AGAIN)}],
    ids=["plans no ways", "asked a moment ago"],
)
def test_otherwise_a_stop_before_it_is_made_for(values: dict[str, Any], blocked: RtiMpcc) -> None:
    s = before_it(**values)
    after, attempt = first(blocked, s)
    assert not attempt.problem
    assert after.task.stop is not None
    reach = 12.0 - CONFIG.vehicle.front
    assert reach - 1.0 < after.task.stop.at < reach
    assert after.task.drives
    assert after.route is s.route


def test_on_the_way_to_a_stop_no_other_way_is_asked_for(blocked: RtiMpcc) -> None:
    """Not even where there is no plan to it."""
    for at, drives in ((7.0, True), (16.0, False)):
        s = before_it(stop=stop_at(at))
        context = workspace(blocked, 0).context(s)
        assert not context.free
        found = first_plan(s, context, workspace(blocked, 100))
        assert (found.s.task.drives, not found.attempt.problem) == (drives, drives)
        assert found.s.route is PLANNED


@pytest.mark.parametrize("mpcc_of", ["mpcc", "blocked"], ids=["misses the goal", "something fills the way"])
def test_one_that_rolls_drives_what_was_found_while_another_way_is_planned(
    mpcc_of: str, request: pytest.FixtureRequest
) -> None:
    """Once for the same obstacles: what came of it is driven, or was too late."""
    core = request.getfixturevalue(mpcc_of)
    misses: dict[str, Any] = {"tolerance": (1e-9, 1e-9, 1e-9)} if mpcc_of == "mpcc" else {}
    area = AREA if mpcc_of == "mpcc" else FILLED
    plain, _ = first(core, before_it(standing_since=None, area=area, route=None), **misses)
    after, attempt = first(core, before_it(standing_since=None, area=area), **misses)
    assert not attempt.problem
    assert after.task.drives
    assert (after.task.phase, after.task.stop, after.task.arrival) == (
        plain.task.phase,
        plain.task.stop,
        plain.task.arrival,
    )
    assert (after.task.stop is not None) == (mpcc_of == "blocked")
    assert after.route is not None
    assert replace(after.route, wanted="") == PLANNED
    assert after.route.wanted
    before = asked(100.0, changes=area.changes)
    again, _ = first(core, before_it(standing_since=None, area=area, route=before), **misses)
    assert (again.task.stop, again.route) == (plain.task.stop, before)
