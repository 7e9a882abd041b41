"""What asks for another way and what does not, what is planned for, and what is made of the answer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from estimation import PoseHistory
from geometry import Area, Corridor, Pose2, ReferencePath
from rti_mpcc import rerouting
from rti_mpcc.behaviour.conditions import SETTLE_SHARE
from rti_mpcc.config import ControllerConfig
from rti_mpcc.config.route import RoutePlanner
from rti_mpcc.docking import DockingController
from rti_mpcc.manoeuvre import Manoeuvre, SegmentEnd
from rti_mpcc.planning.plausibility import StateMonitor
from rti_mpcc.planning.sensing import OFF_PATH
from rti_mpcc.planning.state import ControllerState, Halt, Phase, Plans, RouteState, Task
from rti_mpcc.planning.surroundings import Surroundings
from rti_mpcc.rerouting import Rerouter, standing_route
from rti_mpcc.types import Array, Trajectory
from tests.rti_mpcc.docking_runs import granting
from tests.rti_mpcc.encounters import square
from tests.rti_mpcc.planned import manoeuvre_along, no_manoeuvre
from tests.rti_mpcc.states import NOW, put, some_plan, state, stop_at, target_at
from tests.rti_mpcc.yards import YARD

CONFIG = ControllerConfig(dead_time=0.2, route=RoutePlanner(slices=4, slices_at_rest=5))
ROUTE = CONFIG.route
PATH = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 14.0)])
GOAL = PATH.end
WAY = manoeuvre_along(PATH)
LONG_AGO = NOW - max(ROUTE.replan_after, ROUTE.again_after) - 1.0
OPEN = Surroundings.in_area(YARD)
PLENTY = 100


@dataclass
class Search:
    """A search in the place of `RoutePlanning`: it takes three slices of 10 ms."""

    start: Pose2
    goal: Pose2
    area: Area
    config: ControllerConfig
    came: tuple[float, float] = (0.0, 0.0)
    there: float = 1.0
    keep_out: Sequence[Array] = ()
    seconds: float = 0.0
    longest: float = 0.0
    slices: int = 0
    manoeuvre: Manoeuvre | None = None

    def waited(self) -> None:
        """Nothing is remembered."""

    def advance(self) -> None:
        self.slices += 1
        self.seconds += 0.01
        if self.slices == 3:
            path = ReferencePath.from_segments(self.start, [(1, 0.0, 5.0)])
            self.manoeuvre = replace(manoeuvre_along(path, self.goal), start=self.start)


@dataclass
class InVain(Search):
    """The same, but there is no way."""

    def advance(self) -> None:
        super().advance()
        if self.manoeuvre is not None:
            self.manoeuvre = no_manoeuvre(self.start, self.goal)


@pytest.fixture
def searches(monkeypatch: pytest.MonkeyPatch) -> list[Search]:
    """Those that were begun."""
    return begun(monkeypatch, Search)


def begun(monkeypatch: pytest.MonkeyPatch, kind: type[Search]) -> list[Search]:
    found: list[Search] = []

    def begin(*given: Any, **named: Any) -> Search:
        found.append(kind(*given, **named))
        return found[-1]

    monkeypatch.setattr(rerouting, "RoutePlanning", begin)
    return found


def rerouter() -> Rerouter:
    return Rerouter(YARD, CONFIG)


def at(x: float, y: float = 0.0, phi: float = 0.0) -> StateMonitor:
    """What is believed, and not doubted."""
    return StateMonitor(at=NOW, state=np.array([x, y, phi, 0.0, 0.0, 0.0]))


def on_way(x: float = 5.0, y: float = 0.0, phi: float = 0.0, **values: Any) -> ControllerState:
    """On a way that was planned, so far along it, at rest for long unless the values say otherwise."""
    route = RouteState(manoeuvre=WAY, ways=1, since=0.0)
    usual: dict[str, Any] = {
        "time": NOW,
        "monitor": at(x, y, phi),
        "standing_since": LONG_AGO,
        "pose": GOAL,
        "target": target_at(14.0),
    }
    task = replace(Task.begun(WAY.segments), phase=Phase.ARRIVING)
    s = ControllerState(area=OPEN, path=PATH, task=task, route=route)
    return put(s, **{**usual, **values})


def without_way(x: float = 0.0, y: float = 0.0, phi: float = 0.0, **values: Any) -> ControllerState:
    """Standing there, with no way yet."""
    path, segments = standing_route(Pose2(x, y, phi))
    task = replace(Task.begun(segments), phase=Phase.PLANNING)
    route = RouteState(why="the first one")
    s = ControllerState(area=OPEN, path=path, task=task, route=route)
    usual = {"time": NOW, "monitor": at(x, y, phi), "standing_since": LONG_AGO, "pose": GOAL}
    return put(s, **{**usual, **values})


def asks(s: ControllerState) -> str:
    """Why another way is asked for, or ""."""
    after = rerouter().routed(s)
    assert after.route is not None
    if after.task.phase is Phase.PLANNING:
        assert after.route.why
    else:
        assert after == replace(s, route=after.route)
        assert not after.route.why
    return after.route.why


def changed(count: int = 1) -> Surroundings:
    return replace(OPEN.updated([square(6.0, 7.0, 1.0)], NOW), changes=count)


# -- what asks for another way -------------------------------------------------------------------------------

ON_ITS_WAY = [phase for phase in Phase if phase not in (Phase.PLANNING, Phase.WAITING)]


@pytest.mark.parametrize("phase", [p for p in ON_ITS_WAY if p is not Phase.STALLED], ids=lambda p: p.name)
def test_on_its_way_nothing_is_asked_for(phase: Phase) -> None:
    for standing in (None, NOW, LONG_AGO):
        assert asks(on_way(phase=phase, standing_since=standing)) == ""


@pytest.mark.parametrize("phase", ON_ITS_WAY, ids=lambda p: p.name)
@pytest.mark.parametrize("standing_since", [None, LONG_AGO])
def test_a_goal_that_is_elsewhere_asks_at_once(phase: Phase, standing_since: float | None) -> None:
    most, turn = ROUTE.goal_moved
    for goal in (
        GOAL.compose(Pose2(most + 0.01, 0.0, 0.0)),
        GOAL.compose(Pose2(0.0, -most - 0.01, 0.0)),
        GOAL.compose(Pose2(0.0, 0.0, turn + 0.01)),
    ):
        s = on_way(phase=phase, pose=goal, standing_since=standing_since)
        assert asks(s) == "the goal is elsewhere"


def test_one_that_was_told_to_stand_is_left_there() -> None:
    s = on_way(phase=Phase.WAITING, pose=GOAL.compose(Pose2(5.0, 0.0, 0.0)), standing_since=LONG_AGO)
    assert rerouter().routed(s) is s
    assert rerouter().planned_on(s, granting(PLENTY)) is s


def test_a_goal_that_is_near_where_the_way_leads_does_not() -> None:
    most, turn = ROUTE.goal_moved
    for goal in (
        GOAL.compose(Pose2(most - 0.01, 0.0, 0.0)),
        GOAL.compose(Pose2(0.0, 0.0, 0.01 - turn)),
        Pose2(GOAL.x, GOAL.y, GOAL.phi + 2.0 * np.pi),
        None,
    ):
        assert asks(on_way(pose=goal)) == ""


def test_standing_at_a_stop_before_something_asks_at_once() -> None:
    held = on_way(phase=Phase.HOLDING, stop=stop_at(6.0), standing_since=NOW)
    assert asks(held) == "something fills the way"
    for phase in (Phase.STARTING, Phase.CONTOURING, Phase.ARRIVING, Phase.SETTLING):
        assert asks(on_way(phase=phase, stop=stop_at(6.0))) == ""


def test_standing_at_a_stop_from_which_a_way_was_sought_a_moment_ago_asks_later() -> None:
    held = on_way(0.02, phase=Phase.HOLDING, stop=stop_at(0.0))
    assert held.route is not None
    for since, why in (
        (NOW - 0.5 * ROUTE.again_after, ""),
        (NOW - ROUTE.again_after, "something fills the way"),
    ):
        assert asks(replace(held, route=replace(held.route, since=since))) == why


@pytest.mark.parametrize("wanted", ["something fills the way", "the first plan misses the goal"])
def test_what_the_search_for_a_first_plan_wants_is_asked_for_at_once(wanted: str) -> None:
    """From rest, and while it still has not begun to drive."""

    def wants(phase: Phase, standing_since: float | None) -> ControllerState:
        s = on_way(phase=phase, standing_since=standing_since)
        assert s.route is not None
        return replace(s, route=replace(s.route, wanted=wanted))

    assert asks(wants(Phase.STARTING, NOW)) == wanted
    assert asks(wants(Phase.STARTING, None)) == ""
    assert asks(wants(Phase.ARRIVING, NOW)) == ""


@pytest.mark.parametrize(
    ("values", "why"),
    [
        ({"phase": Phase.STALLED}, "no plan from here ends inside the tolerance"),
        ({"phase": Phase.ARRIVING, "halt": Halt()}, "something is in the way"),
        ({"phase": Phase.STARTING, "halt": Halt()}, "something is in the way"),
        ({"phase": Phase.STARTING, "latched": "no plan was found"}, "no plan was found"),
    ],
    ids=["stalled", "halts", "halts before it starts", "no plan"],
)
def test_a_vehicle_that_cannot_get_on_asks_after_it_has_stood_for_a_while(
    values: dict[str, Any], why: str
) -> None:
    assert asks(on_way(**values)) == why
    for since in (None, NOW, NOW - ROUTE.replan_after + 0.01):
        assert asks(on_way(**values, standing_since=since)) == ""
    assert asks(on_way(**values, standing_since=NOW - ROUTE.replan_after)) == why


def test_a_plan_that_is_driven_although_there_was_none_before_asks_for_nothing() -> None:
    for phase in (Phase.CONTOURING, Phase.ARRIVING, Phase.SETTLING, Phase.HOLDING):
        assert asks(on_way(phase=phase, latched="no plan was found")) == ""


def test_the_same_is_not_asked_for_again_from_where_the_way_begins() -> None:
    """But after a while, from elsewhere, or with other obstacles it is."""
    stalled, soon = on_way(0.02, 0.01, phase=Phase.STALLED), NOW - 0.5 * ROUTE.again_after

    def driven_since(s: ControllerState, since: float) -> ControllerState:
        assert s.route is not None
        return replace(s, route=replace(s.route, since=since))

    assert asks(driven_since(stalled, soon)) == ""
    assert asks(driven_since(stalled, NOW - ROUTE.again_after)) != ""
    assert asks(driven_since(on_way(0.5, phase=Phase.STALLED), soon)) != ""
    assert asks(driven_since(put(stalled, area=changed()), soon)) != ""
    elsewhere = put(stalled, pose=Pose2(10.0, 4.0, 0.0))
    assert asks(driven_since(elsewhere, soon)) == "the goal is elsewhere"


def test_whoever_asks_stands_on_a_route_of_no_length_with_no_plans() -> None:
    s = on_way(5.0, 0.2, 0.1, phase=Phase.STALLED, driven=some_plan(), latched="why")
    after = rerouter().routed(s)
    assert after.path.start == Pose2(5.0, 0.2, 0.1)
    (segment,) = after.task.segments
    assert segment.end is SegmentEnd.STOP
    assert segment.part is after.path.parts[0]
    assert (after.plans, after.begin) == (Plans(), None)
    assert (after.task.latched, after.task.stop) == ("", None)
    assert after.route is not None
    assert (after.route.since, after.route.ways, after.route.manoeuvre) == (NOW, 1, WAY)
    assert (after.goal, after.vehicle, after.area) == (s.goal, s.vehicle, s.area)


# -- what is planned for -------------------------------------------------------------------------------------


def test_a_vehicle_that_stands_without_a_way_plans_from_where_it_is(searches: list[Search]) -> None:
    one = rerouter()
    after = one.planned_on(without_way(1.0, 2.0, 0.3), granting(PLENTY))
    (search,) = searches
    assert (search.start, search.goal, search.config) == (Pose2(1.0, 2.0, 0.3), GOAL, CONFIG)
    assert search.area is YARD
    assert search.slices == 3 <= ROUTE.slices
    assert after.route is not None
    assert after.route.seconds == pytest.approx(0.03)


@pytest.mark.parametrize(
    "values",
    [
        {"pose": None},
        {"monitor": StateMonitor()},
        {"monitor": replace(at(0.0), why="frozen")},
        {"standing_since": None},
        {"standing_since": NOW - 0.1},  # shorter than the dead time: commands are under way
    ],
    ids=["no goal", "no state", "doubted", "rolls", "has just stopped"],
)
def test_without_goal_or_state_or_before_it_stands_nothing_is_planned(
    values: dict[str, Any], searches: list[Search]
) -> None:
    s = without_way(**values)
    assert rerouter().planned_on(s, granting(PLENTY)) is s
    assert searches == []


def test_on_its_way_nothing_is_planned(searches: list[Search]) -> None:
    for phase in ON_ITS_WAY:
        s = on_way(phase=phase)
        assert rerouter().planned_on(s, granting(PLENTY)) is s
    assert searches == []


@pytest.mark.parametrize(("granted", "taken"), [(0, 0), (1, 1), (2, 2), (PLENTY, ROUTE.slices_at_rest)])
def test_so_many_slices_are_taken_as_are_granted(granted: int, taken: int, searches: list[Search]) -> None:
    class Long(Search):
        def advance(self) -> None:
            self.slices += 1
            self.seconds += 0.01

    searches.clear()
    one, s = rerouter(), without_way()
    with pytest.MonkeyPatch.context() as patch:
        found = begun(patch, Long)
        s = one.planned_on(s, granting(granted))
        assert found[0].slices == taken
        s = one.planned_on(s, granting(1))
        assert (len(found), found[0].slices) == (1, taken + 1)  # it goes on
    assert s.route is not None
    assert s.route.seconds == pytest.approx(0.01 * (taken + 1))


def test_a_vehicle_that_makes_for_a_stop_plans_from_there(searches: list[Search]) -> None:
    one = rerouter()
    rolling = on_way(3.0, stop=stop_at(6.0), standing_since=None)
    for cycle in range(1, 3):
        one.planned_on(rolling, granting(1))
        (search,) = searches
        assert (search.start, search.came, search.slices) == (Pose2(6.0, 0.0, 0.0), (0.0, 0.0), cycle)
    beyond = on_way(3.0, stop=stop_at(99.0), standing_since=None)
    rerouter().planned_on(beyond, granting(PLENTY))
    assert searches[-1].start == PATH.end


def test_a_search_goes_on_while_nothing_of_what_it_is_for_has_changed(searches: list[Search]) -> None:
    one, (along, across, turn) = rerouter(), ROUTE.unmoved
    one.planned_on(without_way(), granting(1))
    share = 0.9
    for s in (
        without_way(share * along, share * across, share * turn),
        without_way(pose=GOAL.compose(Pose2(0.0, -share * across, 0.0))),
    ):
        one.planned_on(s, granting(0))
    assert len(searches) == 1


@pytest.mark.parametrize(
    "s",
    [
        without_way(0.05),
        without_way(phi=0.05),
        without_way(pose=GOAL.compose(Pose2(0.05, 0.0, 0.0))),
        without_way(area=changed()),
    ],
    ids=["moved", "turned", "another goal", "other obstacles"],
)
def test_another_search_is_begun_when_something_has(s: ControllerState, searches: list[Search]) -> None:
    one = rerouter()
    one.planned_on(without_way(), granting(1))
    one.planned_on(s, granting(1))
    assert [search.slices for search in searches] == [1, 1]


def test_the_obstacles_that_stand_are_planned_round(searches: list[Search]) -> None:
    around = OPEN.updated([square(6.0, 3.0, 1.0)], NOW)
    rerouter().planned_on(without_way(area=around), granting(1))
    assert len(searches[0].area.obstacles) == len(YARD.obstacles) + 1


def noisy(x: float, y: float, since: float, random: np.random.Generator) -> ControllerState:
    """Standing there since then, each cycle measured a few centimetres off."""
    poses, values = PoseHistory(), np.zeros(3)
    for stamp in np.arange(since, NOW + 1e-9, 0.05):
        values = np.array([x, y, 0.0]) + random.normal(size=3) * [0.03, 0.03, 0.01]
        poses = poses.noted(float(stamp), Pose2(*values.tolist()), length=1.0)
    return without_way(*values.tolist(), poses=poses, standing_since=since)


def test_noise_of_what_is_measured_begins_no_search_anew(searches: list[Search]) -> None:
    one, random = rerouter(), np.random.default_rng(1)
    for _ in range(40):
        one.planned_on(noisy(1.0, 2.0, NOW - 1.0, random), granting(0))
    assert len(searches) == 1
    assert searches[0].start.relative_to(Pose2(1.0, 2.0, 0.0)).within((0.02, 0.02, 0.01))


def test_where_it_was_before_it_stood_does_not_count(searches: list[Search]) -> None:
    poses = PoseHistory()
    for k in range(10):
        poses = poses.noted(NOW - 0.5 + 0.05 * k, Pose2(0.1 * k, 0.0, 0.0), length=1.0)
    poses = poses.noted(NOW, Pose2(0.9, 0.0, 0.0), length=1.0)
    rerouter().planned_on(without_way(0.9, poses=poses, standing_since=NOW - 0.21), granting(1))
    assert searches[0].start.x == pytest.approx(np.mean([0.6, 0.7, 0.8, 0.9, 0.9]))


# -- what is made of the answer ------------------------------------------------------------------------------


def answered(s: ControllerState, *, then: ControllerState | None = None) -> ControllerState:
    """The state after a search for `s` that was done, in the next cycle, where it is `then`."""
    one = rerouter()
    s = one.planned_on(s, granting(PLENTY))
    return one.routed(s if then is None else replace(then, route=s.route))


def test_a_way_that_was_found_is_driven(searches: list[Search]) -> None:
    s = without_way(1.0, area=changed(3))
    after = answered(s)
    manoeuvre = searches[0].manoeuvre
    assert manoeuvre is not None
    assert after.task.phase is Phase.STARTING
    assert after.task.segments == manoeuvre.segments
    assert [part.end for part in after.path.parts] == [part.end for part in manoeuvre.path.parts]
    assert after.path.start == Pose2(1.0, 0.0, 0.0)
    assert after.route is not None
    assert after.route.seconds == pytest.approx(0.03)
    route = replace(after.route, seconds=0.0)
    assert route == RouteState(manoeuvre=manoeuvre, why="", since=NOW, changes=3, ways=1)


def test_the_next_one_counts_as_planned_anew(searches: list[Search]) -> None:
    s = without_way()
    assert s.route is not None
    after = answered(replace(s, route=replace(s.route, ways=2)))
    assert after.route is not None
    assert after.route.ways == 3


def test_where_there_is_none_it_stands_and_says_why(monkeypatch: pytest.MonkeyPatch) -> None:
    found = begun(monkeypatch, InVain)
    one = rerouter()
    s = one.routed(one.planned_on(without_way(), granting(PLENTY)))
    assert s.task.phase is Phase.PLANNING
    assert s.route is not None
    assert (s.route.manoeuvre, s.route.why, s.route.ways) == (found[0].manoeuvre, "too narrow", 0)
    # It is not looked for again before something has changed.
    for _ in range(3):
        s = one.routed(one.planned_on(s, granting(PLENTY)))
    assert (len(found), found[0].slices) == (1, 3)
    s = one.planned_on(put(s, area=changed()), granting(1))
    assert len(found) == 2


def test_before_the_search_is_done_nothing_changes(searches: list[Search]) -> None:
    one = rerouter()
    s = one.planned_on(without_way(), granting(2))
    assert one.routed(s) is s


def test_a_way_planned_from_a_stop_is_driven_from_there(searches: list[Search]) -> None:
    """Planned while it was made for; standing near enough to it there is nothing to plan any more."""
    one, stop = rerouter(), stop_at(6.0)
    rolling = on_way(3.0, stop=stop, standing_since=None)
    for _ in range(3):
        rolling = one.planned_on(rolling, granting(PLENTY))
    along, across, turn = ROUTE.near
    held = on_way(6.0 - 0.9 * along, 0.9 * across, 0.9 * turn, phase=Phase.HOLDING, stop=stop)
    after = one.routed(held)
    assert after.task.phase is Phase.STARTING
    assert after.task.segments == (searches[0].manoeuvre or WAY).segments
    assert after.task.stop is None


@pytest.mark.parametrize(
    ("x", "y", "changes"), [(5.7, 0.0, 0), (6.0, 0.1, 0), (6.0, 0.0, 1)], ids=["short", "beside", "changed"]
)
def test_one_planned_from_elsewhere_or_without_knowing_all_is_not(
    x: float, y: float, changes: int, searches: list[Search]
) -> None:
    one, stop = rerouter(), stop_at(6.0)
    rolling = on_way(3.0, stop=stop, standing_since=None)
    for _ in range(3):
        rolling = one.planned_on(rolling, granting(PLENTY))
    held = on_way(x, y, phase=Phase.HOLDING, stop=stop, area=changed(changes) if changes else OPEN)
    after = one.routed(held)
    assert after.task.phase is Phase.PLANNING
    after = one.planned_on(after, granting(PLENTY))
    assert [search.start.x for search in searches] == [6.0, x]
    assert one.routed(after).task.phase is Phase.STARTING


@pytest.mark.parametrize("share", [0.0, 0.9, -0.9])
def test_a_vehicle_that_stands_in_its_goal_already_needs_no_way_there(share: float) -> None:
    along, across, turn = (share * most for most in CONFIG.goal_tolerance)
    goal = Pose2(3.0, 2.0, 0.5)
    here = goal.compose(Pose2(along, across, turn))
    s = answered(without_way(here.x, here.y, here.phi, pose=goal))
    assert s.task.phase is Phase.STARTING  # and stands inside the tolerance of its target
    (segment,) = s.task.segments
    assert (segment.end, segment.tolerance) == (SegmentEnd.GOAL, CONFIG.goal_tolerance)
    assert s.path.end.relative_to(goal).within((1e-9, 1e-9, 1e-9))
    assert s.route is not None
    assert s.route.manoeuvre is not None
    assert (s.route.manoeuvre.found, s.route.manoeuvre.goal, s.route.ways) == (True, goal, 1)
    assert s.route.manoeuvre.nodes == 0


def test_forgotten_it_is_begun_anew(searches: list[Search]) -> None:
    one = rerouter()
    s = one.planned_on(without_way(), granting(PLENTY))
    one.forget()
    assert one.routed(s) is s
    one.planned_on(s, granting(1))
    assert len(searches) == 2


# -- on a path that was given --------------------------------------------------------------------------------

LANE = Surroundings.of(Corridor.from_offsets(PATH, left=4.0, right=-4.0), PATH, CONFIG)
WANTS = RouteState(end=PATH.end, ways=1, wanted="the first plan misses the goal")
CANNOT_GET_ON: list[tuple[dict[str, Any], str]] = [
    ({"phase": Phase.STALLED}, "no plan from here ends inside the tolerance"),
    ({"phase": Phase.HOLDING, "stop": stop_at(5.0)}, "something fills the way"),
    ({"phase": Phase.STARTING, "halt": Halt()}, "something is in the way"),
    ({"phase": Phase.STARTING, "latched": "no plan was found"}, "no plan was found"),
    ({"phase": Phase.STARTING, "route": WANTS}, "the first plan misses the goal"),
]


def on_path(x: float = 5.0, **values: Any) -> ControllerState:
    """The same as `on_way` on a path that was given, of which the end is the goal."""
    route = RouteState(end=PATH.end, ways=1)
    s = replace(on_way(x, pose=None), area=LANE, route=route)
    return put(s, **values)


def asked_on_path(**values: Any) -> tuple[Rerouter, ControllerState]:
    """One that cannot get on for long, in the cycle in which that is noticed."""
    one = rerouter()
    return one, one.routed(on_path(**{"phase": Phase.STALLED, **values}))


@pytest.mark.parametrize(
    ("values", "goes_on"),
    [
        ({"phase": Phase.ARRIVING}, True),
        ({"phase": Phase.STARTING}, True),
        ({"phase": Phase.ARRIVING, "standing_since": None}, False),
        ({"phase": Phase.HOLDING}, False),
    ],
    ids=["a plan came", "none", "it moves", "it holds"],
)
def test_while_plans_come_and_go_what_was_asked_for_is_planned_on_as_long_as_it_stands(
    values: dict[str, Any], goes_on: bool, searches: list[Search]
) -> None:
    one, s = asked_on_path(phase=Phase.ARRIVING, halt=Halt())
    s = one.planned_on(s, granting(2))
    (search,) = searches
    assert search.slices == 2
    s = one.routed(put(s, **{"halt": None, **values}))
    assert s.route is not None
    assert s.route.why == ""
    s = one.planned_on(s, granting(PLENTY))
    assert (search.manoeuvre is not None) is goes_on
    # It is driven once it asks again.
    stuck = put(s, phase=Phase.ARRIVING, halt=Halt(), standing_since=LONG_AGO)
    for at, driven in ((s, False), (stuck, goes_on)):
        route = one.routed(at).route
        assert route is not None
        assert (route.ways == 2) is driven


@pytest.mark.parametrize(("ways", "there"), [(0, 1.0), (1, SETTLE_SHARE)])
def test_one_that_has_driven_has_to_get_well_inside(ways: int, there: float, searches: list[Search]) -> None:
    s = on_way(phase=Phase.PLANNING)
    assert s.route is not None
    rerouter().planned_on(replace(s, route=replace(s.route, ways=ways)), granting(1))
    assert [search.there for search in searches] == [there]


@pytest.mark.parametrize(("values", "why"), CANNOT_GET_ON)
def test_on_a_given_path_it_stays_there_and_in_its_phase_while_another_way_is_planned(
    values: dict[str, Any], why: str, searches: list[Search]
) -> None:
    one, s = rerouter(), on_path(**values)
    after = one.routed(s)
    assert after.route is not None
    assert after.route.why == why
    assert after == replace(s, route=after.route)
    for _ in range(2):
        after = one.planned_on(one.routed(after), granting(1))
        assert (after.path, after.task, after.area) == (PATH, s.task, LANE)
    (search,) = searches
    assert (search.start, search.goal, search.area, search.slices) == (
        Pose2(5.0, 0.0, 0.0),
        PATH.end,
        YARD,
        2,
    )


def test_on_a_given_path_that_it_can_drive_nothing_is_asked_for(searches: list[Search]) -> None:
    for phase in (Phase.STARTING, Phase.CONTOURING, Phase.ARRIVING, Phase.SETTLING, Phase.HOLDING):
        one, s = rerouter(), on_path(phase=phase)
        after = one.routed(s)
        assert after == s
        assert one.planned_on(after, granting(PLENTY)) is after
    assert searches == []


def test_on_a_given_path_a_goal_that_is_elsewhere_is_driven_to_along_it() -> None:
    goal = GOAL.compose(Pose2(5.0 * ROUTE.goal_moved[0], 0.0, 0.0))
    s = on_path(phase=Phase.ARRIVING, pose=goal)
    assert rerouter().routed(s) == s


def test_what_gets_on_meanwhile_stays_on_its_path(searches: list[Search]) -> None:
    """Something that stood in the way has gone: the way that was looked for is not needed any more."""
    one, s = asked_on_path(phase=Phase.STARTING, route=WANTS)
    s = one.planned_on(s, granting(PLENTY))
    assert searches[0].manoeuvre is not None
    assert s.route is not None
    for phase, wanted in ((Phase.ARRIVING, WANTS.wanted), (Phase.SETTLING, ""), (Phase.HOLDING, "")):
        after = one.routed(put(s, phase=phase))
        assert after == put(replace(s, route=replace(s.route, why="", wanted=wanted)), phase=phase)


@pytest.mark.parametrize(("values", "why"), CANNOT_GET_ON)
def test_it_sets_out_on_the_way_that_was_planned_in_all_of_the_corridor(
    values: dict[str, Any], why: str, searches: list[Search]
) -> None:
    one, s = asked_on_path(**values)
    box = LANE.updated([square(12.0, 3.0, 0.5)], NOW)
    s = one.planned_on(replace(s, area=box), granting(PLENTY))
    after = one.routed(s)
    manoeuvre = searches[0].manoeuvre
    assert manoeuvre is not None
    assert (after.task.phase, after.task.segments) == (Phase.STARTING, manoeuvre.segments)
    assert after.path.parts == manoeuvre.path.parts
    assert after.on_planned_way
    assert after.area.changes == box.changes
    assert [each.outline.tolist() for each in after.area.obstacles] == [
        each.outline.tolist() for each in box.obstacles
    ]
    assert after.area.corridor.area is not None
    assert len(after.area.corridor.obstacles) == 1
    assert after.route is not None
    assert replace(after.route, seconds=0.0) == RouteState(
        end=PATH.end, manoeuvre=manoeuvre, since=NOW, changes=box.changes, ways=2
    )
    assert (after.goal.pose, after.goal_pose) == (PATH.end, PATH.end)
    assert rerouter().routed(after) == after


def test_a_goal_that_was_told_is_planned_for_in_place_of_the_end_of_the_path(searches: list[Search]) -> None:
    goal = Pose2(16.0, 1.0, 0.2)
    one, s = asked_on_path(pose=goal)
    after = one.routed(one.planned_on(s, granting(PLENTY)))
    assert searches[0].goal == goal
    assert after.goal.pose == goal


def test_on_a_given_path_a_way_is_planned_from_the_stop_that_is_made_for(searches: list[Search]) -> None:
    one, stop = rerouter(), stop_at(6.0)
    rolling = on_path(3.0, phase=Phase.ARRIVING, stop=stop, standing_since=None)
    for _ in range(3):
        rolling = one.planned_on(one.routed(rolling), granting(PLENTY))
        assert rolling.path is PATH
    assert (searches[0].start, searches[0].goal) == (Pose2(6.0, 0.0, 0.0), PATH.end)
    after = one.routed(on_path(6.0, phase=Phase.HOLDING, stop=stop))
    assert after.on_planned_way
    assert after.task.segments == (searches[0].manoeuvre or WAY).segments


def test_one_that_has_just_stopped_waits_for_its_last_commands(searches: list[Search]) -> None:
    one, s = asked_on_path(phase=Phase.STARTING, route=WANTS, standing_since=NOW - 0.5 * CONFIG.dead_time)
    assert s.route is not None
    assert s.route.why
    assert one.planned_on(s, granting(PLENTY)) is s
    assert searches == []


def test_where_there_is_no_other_way_it_stays_on_its_path_and_asks_again_later(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    found = begun(monkeypatch, InVain)
    one, s = asked_on_path()
    before = s
    s = one.routed(one.planned_on(s, granting(PLENTY)))
    assert (s.path, s.task, s.area) == (PATH, before.task, LANE)
    assert s.route is not None
    assert replace(s.route, seconds=0.0) == RouteState(
        end=PATH.end, manoeuvre=found[0].manoeuvre, since=NOW, ways=1
    )
    soon = put(s, time=NOW + 0.9 * ROUTE.again_after)
    assert one.routed(soon) == soon
    later = one.routed(put(s, time=NOW + ROUTE.again_after))
    assert later.route is not None
    assert later.route.since == NOW + ROUTE.again_after  # it has asked, and knows the answer
    assert (len(found), later.task) == (1, before.task)


@pytest.mark.parametrize(
    "values",
    [{"area": LANE.updated([square(6.0, 7.0, 1.0)], NOW)}, {"monitor": at(5.5)}],
    ids=["other obstacles", "elsewhere"],
)
def test_where_there_was_no_other_way_it_asks_at_once_when_something_has_changed(
    values: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    found = begun(monkeypatch, InVain)
    one, s = asked_on_path()
    s = one.routed(put(one.routed(one.planned_on(s, granting(PLENTY))), **values))
    assert s.route is not None
    assert s.route.why == "no plan from here ends inside the tolerance"
    one.planned_on(s, granting(1))
    assert [search.slices for search in found] == [3, 1]


@pytest.mark.parametrize("told", [None, Pose2(15.0, 1.0, 0.1)])
def test_a_goal_that_is_cleared_leaves_the_end_of_the_path_that_was_given(
    told: Pose2 | None, searches: list[Search]
) -> None:
    """However the vehicle gets there: the way that it left the path for ends somewhere else, maybe."""
    controller = DockingController(PATH, LANE.corridor, CONFIG)
    controller.state = on_path(phase=Phase.STALLED, pose=told, planned=told, dock=told)
    controller.clear_goal()
    assert (controller.state.goal.pose, controller.state.goal_pose) == (None, PATH.end)
    one, s = asked_on_path(pose=told, planned=told, dock=told)
    controller.state = one.routed(one.planned_on(s, granting(PLENTY)))
    assert controller.state.on_planned_way
    assert controller.state.goal_pose == (told or PATH.end)
    controller.clear_goal()
    assert (controller.state.goal.pose, controller.state.goal.planned) == (PATH.end, PATH.end)


# -- where it stands meanwhile -------------------------------------------------------------------------------


def test_a_vehicle_first_heard_of_far_away_stands_on_a_route_there() -> None:
    far = 2.0 * OFF_PATH
    s = put(without_way(), monitor=at(far, far), pose=Pose2(far + 5.0, far, 0.0))
    after = rerouter().routed(s)
    assert after.path.start == Pose2(far, far, 0.0)
    assert after.route is not None
    assert after.route.why == "the first one"
    near = put(without_way(), monitor=at(0.5 * far, 0.0))
    assert rerouter().routed(near).path is near.path


def test_the_route_that_it_stands_on_is_none_to_be_driven() -> None:
    path, segments = standing_route(Pose2(1.0, 2.0, 0.5))
    assert path.start == Pose2(1.0, 2.0, 0.5)
    assert len(path.parts) == len(segments) == 1
    assert segments[0].end is SegmentEnd.STOP


def test_a_mean_is_taken_on_the_branch_of_the_latest_heading() -> None:
    history = PoseHistory()
    turns: Array = np.array([np.pi - 0.01, -np.pi + 0.01, np.pi - 0.01, -np.pi + 0.01])
    for k, phi in enumerate(turns.tolist()):
        history = history.noted(float(k), Pose2(float(k), 1e9, phi), length=9.0)
    mean = history.mean(1.0)
    assert mean is not None
    assert (mean.x, mean.y) == (2.0, 1e9)
    assert mean.relative_to(Pose2(0.0, 0.0, np.pi)).phi == pytest.approx(0.01 / 3.0)
    assert history.mean(4.0) is None
    assert PoseHistory().mean(0.0) is None


@pytest.mark.parametrize(
    ("direction", "length", "joined"),
    [(1, 3.1, True), (1, 2.9, False), (-1, 3.1, False)],
    ids=["long enough", "too short to brake on in comfort", "the other way"],
)
def test_a_way_is_joined_on_the_move_where_its_first_stretch_is_long_enough(
    direction: int, length: float, joined: bool
) -> None:
    config = ControllerConfig()
    speed = (2.0 * config.comfort_acceleration * 3.0) ** 0.5
    states = np.zeros((2, 6))
    states[:, 3] = speed
    plan = Trajectory(times=np.array([NOW, NOW + 1.0]), states=states, controls=np.zeros((1, 3)))
    s = state(driven=plan)
    asked = rerouting._driving(s, Pose2(20.0, 0.0, 0.0), 0.2, config)
    assert asked is not None
    assert asked.stopping == pytest.approx(3.0)
    segments = [(direction, 0.0, length), (-direction, 0.0, 5.0)]
    way = ReferencePath.from_segments(start=asked.start, segments=segments)
    assert asked.is_joined_by(manoeuvre_along(way)) is joined
    assert not asked.is_joined_by(no_manoeuvre(asked.start, asked.goal))
