from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from geometry import Corridor, Pose2, ReferencePath
from rti_mpcc.config import ControllerConfig
from rti_mpcc.controller import RtiMpcc
from rti_mpcc.iteration import Solution
from rti_mpcc.manoeuvre import PlannedStop
from rti_mpcc.model.bicycle import step
from rti_mpcc.ocp.horizon import stage_lengths, stage_times
from rti_mpcc.ocp.targets import Target
from rti_mpcc.planning import schedule, search
from rti_mpcc.planning.arrival import arrival_time
from rti_mpcc.planning.clock import TIME_IS_UP, CycleClock
from rti_mpcc.planning.state import SuspendedSearch
from rti_mpcc.qp.solver import Stop
from rti_mpcc.types import Array, Trajectory
from tests.rti_mpcc.states import arrival_at, arrives_at, begun_for, contexts, state

CONFIG = ControllerConfig()
SETTINGS = CONFIG.search
MOVED = CONFIG.arrival_timing.target_moved


@pytest.fixture(scope="module")
def mpcc() -> RtiMpcc:
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 20.0)])
    return RtiMpcc(path.parts[0], Corridor.from_offsets(path, left=3.0, right=-3.0), CONFIG)


@pytest.fixture(scope="module")
def solution(mpcc: RtiMpcc) -> Solution:
    """A plan fit to be driven, from 1 m/s."""
    times = stage_times(0.0, stage_lengths(10.0, CONFIG.cycle, CONFIG.stages))
    plan = obedient(np.array([5.0, 0.0, 0.0, 1.0, 0.05, 5.0]), times)
    mpcc.prepare(0.0, plan=plan)
    solution = mpcc.feedback(plan.states[0], 0.0)
    return replace(solution, solved=True, trajectory=plan, slack=np.zeros(CONFIG.stages))


def obedient(state: Array, times: Array) -> Trajectory:
    """A motion of the model itself."""
    controls = np.tile([0.1, 0.01, 1.0], (len(times) - 1, 1))
    states = [state]
    for control, length in zip(controls, np.diff(times), strict=True):
        states.append(step(states[-1][None], control[None], np.array([length]), CONFIG.vehicle.wheelbase)[0])
    return Trajectory(times=times, states=np.array(states), controls=controls)


def changed(solution: Solution, *, states: Any = None, controls: Any = None) -> Solution:
    plan = solution.trajectory
    altered = Trajectory(
        times=plan.times,
        states=plan.states if states is None else states(plan.states.copy()),
        controls=plan.controls if controls is None else controls(plan.controls.copy()),
    )
    return replace(solution, trajectory=altered)


def put(row: int, column: int | slice, value: Any) -> Any:
    def change(array: Array) -> Array:
        array[row, column] = value
        return array

    return change


def test_a_plan_that_obeys_the_model_is_accepted(solution: Solution) -> None:
    assert search.rejection_reason(solution, CONFIG) == ""
    assert search.defect(solution.trajectory, CONFIG) == pytest.approx((0.0, 0.0))


def test_what_osqp_did_not_solve_is_refused_by_its_word(solution: Solution) -> None:
    refused = replace(solution, solved=False, status="primal infeasible")
    assert search.rejection_reason(refused, CONFIG) == "the QP was not solved: primal infeasible"


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_plan_that_is_not_finite_is_refused(value: float, solution: Solution) -> None:
    for broken in (
        changed(solution, states=put(30, 2, value)),
        changed(solution, controls=put(30, 1, value)),
    ):
        assert search.rejection_reason(broken, CONFIG) == "the plan is not finite"


@pytest.mark.parametrize(("column", "value"), [(0, 5.2), (0, -5.2), (1, 1.1), (1, -1.1)])
def test_a_plan_that_begins_outside_the_input_limits_is_refused(
    column: int, value: float, solution: Solution
) -> None:
    broken = changed(solution, controls=put(0, column, value))
    assert "outside the input limits" in search.rejection_reason(broken, CONFIG)


@pytest.mark.parametrize(("column", "value"), [(0, 0.06), (1, -0.06), (2, 0.04)])
def test_a_plan_that_breaks_the_dynamics_is_refused(column: int, value: float, solution: Solution) -> None:
    def later(states: Array) -> Array:
        states[5:, column] += value  # one jump after 0.3 s
        return states

    assert "breaks the dynamics" in search.rejection_reason(changed(solution, states=later), CONFIG)


@pytest.mark.parametrize(
    ("place", "column", "value", "said"),
    [
        (40, 0, 99.0, "a stage of the plan breaks the dynamics by"),
        (40, 3, 22_000.0, "the plan leaves the limits: v = 2.2e+04 m/s"),
        (40, 4, -1.2, "the plan leaves the limits"),
    ],
)
def test_all_of_a_plan_has_to_be_believed(
    place: int, column: int, value: float, said: str, solution: Solution
) -> None:
    broken = changed(solution, states=put(place, column, value))
    assert broken.trajectory.times[place - 1] > SETTINGS.checked_span
    assert said in search.rejection_reason(broken, CONFIG)


@pytest.mark.parametrize("column", [0, 1])
def test_no_input_far_ahead_leaves_its_limit(column: int, solution: Solution) -> None:
    broken = changed(solution, controls=put(60, column, -1e3))
    assert "the plan leaves the input limits" in search.rejection_reason(broken, CONFIG)


def test_a_plan_that_takes_longer_than_the_way_can_is_refused(solution: Solution) -> None:
    seconds = float(solution.trajectory.times[-1] - solution.trajectory.times[0])
    assert search.rejection_reason(solution, CONFIG, longest=1.01 * seconds) == ""
    assert "the plan takes" in search.rejection_reason(solution, CONFIG, longest=0.99 * seconds)


def test_a_first_guess_is_iterated_and_a_plan_under_way_once(mpcc: RtiMpcc) -> None:
    context = contexts(target=mpcc.target, begin=0.2)
    s = state(arrival=arrival_at(15.0))
    guess = search.first_guess(mpcc, s, context)
    assert guess.times[-1] == pytest.approx(15.0)
    start = replace(search.from_guess(guess, CONFIG), settled=0.0)
    attempt = search.converge(mpcc, s, context, start, CycleClock())
    assert attempt.problem == ""
    assert not attempt.corridor_infeasible
    assert SETTINGS.first_iterations <= len(attempt.solutions) <= SETTINGS.iterations
    again = search.converge(mpcc, s, context, search.going_on(attempt.solved, CONFIG), CycleClock())
    assert len(again.solutions) == 1


def test_the_damping_of_a_first_guess_fades_from_cycle_to_cycle(mpcc: RtiMpcc) -> None:
    context = contexts(target=mpcc.target, begin=0.2)
    s = state(arrival=arrival_at(15.0))
    start = search.from_guess(search.first_guess(mpcc, s, context), CONFIG)
    last, damped = search.converge(mpcc, s, context, start, CycleClock()).solved, [start.damping]
    while damped[-1] > SETTINGS.damping:
        assert last is not None
        assert last.damping == damped[-1]
        start = search.going_on(last, CONFIG)
        damped.append(start.damping)
        last = search.converge(mpcc, s, context, start, CycleClock()).solved
    share = SETTINGS.damping_share ** np.arange(len(damped))
    np.testing.assert_allclose(damped, np.maximum(SETTINGS.first_damping * share, SETTINGS.damping))
    assert search.going_on(None, CONFIG).damping == SETTINGS.damping


def test_two_first_iterations_are_enough_where_the_second_moves_the_plan_by_little(mpcc: RtiMpcc) -> None:
    context = contexts(target=mpcc.target, begin=0.2)
    s = state(arrival=arrival_at(15.0))
    start = search.from_guess(search.first_guess(mpcc, s, context), CONFIG)
    one, other = (
        solution.trajectory
        for solution in search.converge(mpcc, s, context, start, CycleClock()).solutions[:2]
    )
    apart = np.hypot(*(other.states - one.states)[1:, :2].T)
    parting = float((apart / (one.times[1:] - one.times[0])).max())
    for speed, enough in ((1.01 * parting, 2), (0.99 * parting, SETTINGS.first_iterations)):
        found = search.converge(mpcc, s, context, replace(start, settled=speed), CycleClock())
        assert len(found.solutions) == enough


def test_without_a_planned_arrival_the_guess_spans_the_cruise_horizon(mpcc: RtiMpcc) -> None:
    guess = search.first_guess(mpcc, state(), contexts(target=mpcc.target, begin=0.2))
    assert guess.times[-1] == pytest.approx(0.2 + CONFIG.cruise_horizon)


@pytest.mark.parametrize("begin", ["guess", "solution"])
def test_it_gives_up_when_problems_are_not_solved(
    begin: str, mpcc: RtiMpcc, solution: Solution, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        mpcc, "feedback", lambda state, at, **_: replace(solution, solved=False, status="limit")
    )
    guess = begin == "guess"
    start = search.from_guess(solution.trajectory, CONFIG) if guess else search.going_on(solution, CONFIG)
    context = contexts(target=mpcc.target, begin=0.2)
    attempt = search.converge(mpcc, state(), context, start, CycleClock())
    assert attempt.problem == "the QP was not solved: limit"
    assert attempt.solved is None
    assert len(attempt.solutions) == (SETTINGS.unsolved if guess else 1)


def test_a_plan_that_goes_through_something_is_refused_unless_it_begins_there(solution: Solution) -> None:
    slack = np.full(len(solution.trajectory.controls), 0.9 * SETTINGS.blocked_slack)
    slack[0] = 0.0
    assert search.rejection_reason(replace(solution, slack=slack), CONFIG) == ""
    slack[30] = 1.5 * SETTINGS.blocked_slack
    assert "leaves the corridor by 0.45 m" in search.rejection_reason(replace(solution, slack=slack), CONFIG)
    slack[0] = 0.5 * SETTINGS.blocked_slack
    assert search.rejection_reason(replace(solution, slack=slack), CONFIG) == ""


class Granting(CycleClock):
    """Grants so many iterations."""

    def __init__(self, iterations: int) -> None:
        super().__init__()
        self.granted_yet = iterations

    def _grants(self, granted: bool) -> bool:
        self.granted_yet -= 1
        return self.granted_yet >= 0


def test_a_search_that_runs_out_of_time_goes_on_where_it_was(mpcc: RtiMpcc) -> None:
    context = contexts(target=mpcc.target, begin=0.2)
    s = state(arrival=arrival_at(15.0))
    start = replace(search.from_guess(search.first_guess(mpcc, s, context), CONFIG), settled=0.0)
    at_once = search.converge(mpcc, s, context, start, CycleClock())
    clock = Granting(2)
    cut = search.converge(mpcc, s, context, start, clock)
    assert cut.out_of_time
    assert cut.problem != ""
    assert clock.decisions.granted == (True, True, False)
    s = search.suspended(s, context, cut)
    assert s.plans.suspended is not None
    assert s.plans.suspended.iterations == 2
    rest = search.converge(
        mpcc,
        s,
        context,
        search.resumed(s.plans.suspended, at_once.solutions[0].trajectory, CONFIG),
        CycleClock(),
    )
    assert rest.problem == ""
    assert len(cut.solutions) + len(rest.solutions) == len(at_once.solutions)
    assert search.suspended(s, context, rest).plans.suspended is None


def test_one_for_a_plan_that_misses_its_target_ends_as_soon_as_it_reaches_it(mpcc: RtiMpcc) -> None:
    s = state(arrival=arrival_at(15.0))
    exact = contexts(target=mpcc.target, begin=0.2)
    start = search.from_guess(search.first_guess(mpcc, s, exact), CONFIG)
    one = search.converge(mpcc, s, exact, replace(start, least=1, most=1), CycleClock())
    ways = []
    for tolerance in ((1e-9, 1e-9, 1e-9), CONFIG.goal_tolerance, (1.0, 1.0, 1.0)):
        context = replace(exact, tolerance=tolerance)
        more = search.converge(mpcc, s, context, search.nearer(one, CONFIG), CycleClock())
        reached = [search.reaches(replace(more, solutions=(each,)), context) for each in more.solutions]
        assert not any(reached[:-1])
        assert reached[-1] or len(more.solutions) == CONFIG.search.iterations
        ways.append(len(more.solutions))
    assert ways[0] == CONFIG.search.iterations
    assert ways[2] == 1


class Answering:
    """A core whose QPs all have the same solution."""

    def __init__(self, mpcc: RtiMpcc, solution: Solution) -> None:
        self.config, self._solution = mpcc.config, solution

    def prepare(self, at: float, **options: Any) -> None:
        """Nothing."""

    def feedback(self, state: Array, at: float, **options: Any) -> Solution:
        """The solution."""
        return self._solution


def suspended(solution: Solution, target: Target) -> SuspendedSearch:
    """A search for an arrival at 15 s, planned to begin at 0.2 s."""
    return begun_for(None, solution=solution, target=target, arrival=arrival_at(15.0), begin=0.2)


@pytest.mark.parametrize("done", [0, 1, 2, 5])
def test_a_resumed_search_is_one_for_a_first_plan_however_far_it_had_come(
    done: int, mpcc: RtiMpcc, solution: Solution
) -> None:
    """What goes through something is not driven, whether it was found in one cycle or in several."""
    begun = replace(suspended(solution, mpcc.target), iterations=done)
    start = search.resumed(begun, solution.trajectory, CONFIG)
    assert start.first
    blocked = replace(solution, slack=np.full(CONFIG.stages, 2.0 * SETTINGS.blocked_slack))
    core: Any = Answering(mpcc, blocked)
    s, context = state(), contexts(target=mpcc.target, begin=0.2)
    attempt = search.converge(core, s, context, replace(start, most=1), CycleClock())
    assert attempt.corridor_infeasible
    assert not attempt.fits
    going_on = search.going_on(solution, CONFIG)
    assert not search.converge(core, s, context, going_on, CycleClock()).corridor_infeasible


def test_a_search_begun_while_standing_is_for_a_plan_that_begins_later(
    mpcc: RtiMpcc, solution: Solution
) -> None:
    s = state(time=0.5, suspended=suspended(solution, mpcc.target), standing_since=0.0)
    late = contexts.standing(0.0, target=mpcc.target, now=0.5, begin=0.7)
    after = schedule.scheduled(s, late, mpcc.config)
    begun = after.plans.suspended
    assert begun is not None
    assert begun.solution is not None
    assert arrives_at(after) == arrives_at(begun) == pytest.approx(15.5)
    assert begun.begin == pytest.approx(0.7)
    plan, later = solution.trajectory, begun.solution.trajectory
    np.testing.assert_allclose(later.times, plan.times + 0.5, rtol=0, atol=1e-12)
    np.testing.assert_array_equal(later.states, plan.states)
    assert begun.iterations == 2


def test_a_search_begun_while_moving_keeps_its_time(mpcc: RtiMpcc, solution: Solution) -> None:
    s = state(suspended=suspended(solution, mpcc.target))
    after = schedule.scheduled(s, contexts(target=mpcc.target, now=0.5, begin=0.7), mpcc.config)
    assert after.plans.suspended == s.plans.suspended
    assert arrives_at(after) == 15.0
    late = contexts(target=mpcc.target, now=14.0, begin=14.2)
    again = schedule.scheduled(s, late, mpcc.config)
    least = arrival_time(late.distance, late.speed, CONFIG)
    assert arrives_at(again) == pytest.approx(14.2 + least)


@pytest.mark.parametrize(("aside", "goes_on"), [(0.9 * MOVED, True), (1.1 * MOVED, False)])
def test_a_search_for_a_target_that_has_moved_is_dropped(
    aside: float, goes_on: bool, mpcc: RtiMpcc, solution: Solution
) -> None:
    pose = mpcc.target.pose
    moved = replace(mpcc.target, pose=Pose2(pose.x, pose.y + aside, pose.phi))
    s = state(suspended=suspended(solution, mpcc.target))
    after = schedule.scheduled(s, contexts(target=moved, begin=0.7), mpcc.config)
    assert (after.plans.suspended is not None) == goes_on
    assert (arrives_at(after) == 15.0) == goes_on


def test_a_search_whose_qps_are_not_solved_ends_however_many_cycles_it_takes(
    mpcc: RtiMpcc, solution: Solution
) -> None:
    """What time has cut counts for nothing: it may be solved yet."""
    context, unsolved = contexts(target=mpcc.target, begin=0.2), replace(solution, solved=False)
    cut = replace(unsolved, stopped=Stop(TIME_IS_UP, 3))
    s = state()
    for cycle, answer in enumerate((unsolved, cut, unsolved)):
        core: Any = Answering(mpcc, answer)
        begun, guess = s.plans.suspended, solution.trajectory
        start = search.from_guess(guess, CONFIG) if begun is None else search.resumed(begun, guess, CONFIG)
        attempt = search.converge(core, s, context, start, Granting(1))
        assert attempt.out_of_time == (cycle < 2)
        s = search.suspended(s, context, attempt)
    assert s.plans.suspended is None


def test_after_a_qp_that_was_not_solved_a_search_begins_at_its_guess_again(
    mpcc: RtiMpcc, solution: Solution
) -> None:
    """What it goes on from may lead past something that is gone."""
    s, context = state(suspended=suspended(solution, mpcc.target)), contexts(target=mpcc.target, begin=0.2)
    for status, stopped, kept in (("limit", None, None), (TIME_IS_UP, Stop(TIME_IS_UP, 3), solution)):
        last = replace(solution, solved=False, status=status, stopped=stopped)
        cut = search.SqpResult(solutions=(last,), problem="why", corridor_infeasible=False, out_of_time=True)
        begun = search.suspended(s, context, cut).plans.suspended
        assert begun is not None
        assert begun.solution is kept


def test_a_search_that_had_no_time_at_all_keeps_what_it_is_for(mpcc: RtiMpcc) -> None:
    stop = PlannedStop(at=7.0, goal=None, obstacles=1, since=0.0)
    context = contexts(target=mpcc.target, begin=0.2)
    none = search.SqpResult(solutions=(), problem=search.NO_TIME, corridor_infeasible=False, out_of_time=True)
    s = search.suspended(state(stop=stop, arrival=arrival_at(15.0)), context, none)
    begun = s.plans.suspended
    assert begun is not None
    assert (begun.segment.stop, begun.target, arrives_at(begun)) == (stop, mpcc.target, 15.0)
    assert (begun.solution, begun.iterations) == (None, 0)
    later = search.suspended(s, contexts(target=mpcc.target, begin=0.25), none)
    assert later.plans.suspended is begun


def test_without_any_time_nothing_is_solved(mpcc: RtiMpcc, solution: Solution) -> None:
    context, start = contexts(target=mpcc.target, begin=0.2), search.going_on(solution, CONFIG)
    attempt = search.converge(mpcc, state(), context, start, Granting(0))
    assert (attempt.solutions, attempt.problem, attempt.out_of_time) == ((), search.NO_TIME, True)


# -- whether a plan reaches its target ---------------------------------------------------------------------


def ending(solution: Solution, pose: Pose2, **changes: Any) -> search.SqpResult:
    """A search whose plan ends there."""
    ends = changed(solution, states=put(-1, slice(0, 3), [pose.x, pose.y, pose.phi]))
    usual: dict[str, Any] = {"solutions": (solution, ends), "problem": "", "corridor_infeasible": False}
    return search.SqpResult(**{**usual, **changes})


@pytest.mark.parametrize(
    ("error", "inside"),
    [
        (Pose2(0.0, 0.0, 0.0), True),
        (Pose2(0.049, -0.049, 0.034), True),
        (Pose2(0.0, 0.0, 2.0 * np.pi), True),
        (Pose2(0.051, 0.0, 0.0), False),
        (Pose2(0.0, -0.051, 0.0), False),
        (Pose2(0.0, 0.0, 0.036), False),
    ],
)
def test_a_plan_reaches_its_target_within_the_tolerance(
    error: Pose2, inside: bool, solution: Solution
) -> None:
    goal = Pose2(20.0, 1.0, 0.7)  # errors count along and across the goal, not the axes
    context = contexts(target=replace(contexts().target, pose=goal))
    assert search.reaches(ending(solution, goal.compose(error)), context) == inside


def test_only_what_began_from_a_clean_start_was_retried(solution: Solution) -> None:
    """Not what a first plan was iterated further by."""
    once = ending(solution, contexts().target.pose, problem="why")
    clean = replace(once, retried=True, problem="")
    assert [once.then(more).retried for more in (once, clean, replace(clean, solutions=()))] == [
        False,
        True,
        False,
    ]


def test_a_plan_not_to_be_driven_or_squeezed_reaches_nothing(solution: Solution) -> None:
    goal = contexts().target.pose
    assert search.reaches(ending(solution, goal), contexts())
    assert not search.reaches(ending(solution, goal, corridor_infeasible=True), contexts())
    assert not search.reaches(ending(solution, goal, problem="why"), contexts())
    none = search.SqpResult(solutions=(), problem=search.NO_TIME, corridor_infeasible=False, out_of_time=True)
    assert not search.reaches(none, contexts())
