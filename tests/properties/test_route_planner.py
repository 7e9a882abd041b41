"""Planned routes near what the planner divides by: small and large vehicles, wide margins, goals close by."""

from __future__ import annotations

from collections.abc import Generator
from math import cos, hypot, pi, sin, sqrt, tan
from typing import Literal, TypeVar, cast

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from geometry import Area, Pose2, ReferencePath, wrap
from geometry.arrays import Array
from rti_mpcc.config import Clearance, ControllerConfig, RoutePlanner, Vehicle
from rti_mpcc.manoeuvre import Manoeuvre, PlanOutcome
from rti_mpcc.route_planner.arcs import after, joined, length_of, poses_after, split
from rti_mpcc.route_planner.cost_to_go import axle_clearances, cost_to_go, looked_up
from rti_mpcc.route_planner.costs import closeness_of
from rti_mpcc.route_planner.mending import mended_path
from rti_mpcc.route_planner.planner import plan_manoeuvre
from rti_mpcc.route_planner.problem import Problem
from rti_mpcc.route_planner.results import _tolerance
from rti_mpcc.route_planner.stretches import Stretches

Result = TypeVar("Result")

Direction = Literal[-1, 0, 1]
BOTH_WAYS: tuple[Direction, ...] = (1, -1)

FEW = settings(derandomize=True, deadline=None, max_examples=60)
FEWER = settings(FEW, max_examples=20)

WHEELBASES = st.sampled_from([0.05, 0.18, 0.5, 1.0, 2.875, 8.0, 20.0])
CLOSE = st.sampled_from([0.0, 1e-17, 1e-12, 1e-10, 1e-9, 1e-7, 1e-6, 1e-4, 0.01, 0.04, 0.06])
"""How near a start is to some place [m]."""
LENGTHS = st.one_of(st.sampled_from([1e-17, 1e-10, 1e-9, 2e-9, 1e-6, 1e-3]), st.floats(0.01, 8.0))
CURVATURES = st.one_of(st.sampled_from([0.0, 1e-310, 1e-17, 1e-9]), st.floats(-2.0, 2.0))
WAYS = st.lists(
    st.tuples(st.sampled_from([1.0, -1.0]), LENGTHS, CURVATURES).map(lambda row: (row[0] * row[1], row[2])),
    min_size=1,
    max_size=5,
).map(np.array)


def yard(half: float) -> Area:
    """A square without anything in it."""
    return Area(boundary=[(-half, -half), (half, -half), (half, half), (-half, half)])


def car(wheelbase: float, route: RoutePlanner | None = None) -> ControllerConfig:
    """Settings of a car of the usual shape."""
    vehicle = Vehicle(wheelbase=wheelbase, width=0.7 * wheelbase, front=1.3 * wheelbase, rear=0.3 * wheelbase)
    return ControllerConfig(vehicle=vehicle, route=route or RoutePlanner())


def leads_to_its_goal(made: Manoeuvre) -> bool:
    """Whether a manoeuvre ends in its goal, and each of its parts begins where the one before it ends."""
    path = made.path
    at = path.start
    for part in path.parts:
        if hypot(part.first.x - at.x, part.first.y - at.y) > 1e-6 or not (np.diff(part.knots) > 0.0).all():
            return False
        at = part.last
    end = made.goal
    return hypot(at.x - end.x, at.y - end.y) <= 1e-6 and abs(wrap(at.phi - end.phi)) <= 1e-6


def result_of(steps: Generator[None, None, Result]) -> Result:
    """What slices come to."""
    while True:
        try:
            next(steps)
        except StopIteration as ended:
            return cast(Result, ended.value)


def over_cells(x: float, y: float) -> float:
    """Length of a way from (0, 0) to a point along the axes and the diagonals [m]."""
    return max(abs(x), abs(y)) + (sqrt(2.0) - 1.0) * min(abs(x), abs(y))


# -- vehicles and margins ------------------------------------------------------------------------------------


@FEW
@given(
    wheelbase=st.floats(0.05, 20.0),
    least=st.floats(0.0, 3.0),
    more=st.floats(0.0, 3.0),
    reserve=st.floats(0.0, 0.1),
    room=st.floats(0.0, 5.0),
)
@example(wheelbase=2.875, least=0.05, more=0.05, reserve=0.03, room=1.4)
@example(wheelbase=0.18, least=0.05, more=0.05, reserve=0.03, room=1.4)
@example(wheelbase=2.875, least=0.5, more=0.0, reserve=0.03, room=0.501)
@example(wheelbase=2.875, least=0.0, more=0.0, reserve=0.0, room=0.0)
def test_a_planner_looks_at_least_as_far_as_the_margin_that_it_asks_for(
    wheelbase: float, least: float, more: float, reserve: float, room: float
) -> None:
    clearance = Clearance(least=least, wanted=least + more)
    config = car(wheelbase, RoutePlanner(reserve=reserve)).changed(clearance=clearance)
    problem = Problem.of(Pose2(0.0, 0.0, 0.0), Pose2(5.0, 0.0, 0.0), yard(20.0), config)
    terms = problem.terms(room)
    assert np.isfinite(terms).all()
    assert min(terms.radius, terms.arc, terms.check, terms.cell) > 0.0
    assert terms.margin >= least
    assert terms.near > terms.margin
    assert terms.open > terms.margin
    assert problem.within > least + reserve


@FEWER
@given(wheelbase=WHEELBASES, least=st.sampled_from([0.0, 0.05, 0.2, 1.25, 2.0]))
@example(wheelbase=2.875, least=0.05)
@example(wheelbase=0.18, least=0.05)
@example(wheelbase=0.5, least=0.2)
@example(wheelbase=2.875, least=1.25)
@example(wheelbase=2.875, least=2.0)
def test_in_an_empty_yard_there_is_a_route_for_any_vehicle_and_any_margin(
    wheelbase: float, least: float
) -> None:
    clearance = Clearance(least=least, wanted=max(least, 0.1))
    config = car(wheelbase, RoutePlanner()).changed(clearance=clearance)
    goal = Pose2(4.0 * wheelbase, 1.0 * wheelbase, 0.3)
    made = plan_manoeuvre(Pose2(0.0, 0.0, 0.0), goal, yard(20.0 * wheelbase + 5.0), config)
    assert made.outcome is PlanOutcome.FOUND, made.reason
    assert leads_to_its_goal(made)


@FEW
@given(clear=st.floats(0.0, 1.0), more=st.floats(0.0, 1.0))
@example(clear=0.0, more=0.0)
@example(clear=0.08, more=0.12)
def test_what_is_close_costs_the_more_the_closer_it_is_and_nothing_beyond_the_margin(
    clear: float, more: float
) -> None:
    for wanted in (0.0, 0.1, 1e-9):
        clearance = Clearance(least=0.0, wanted=wanted)
        config = ControllerConfig(clearance=clearance, route=RoutePlanner(reserve=0.0))
        terms = Problem.of(Pose2(0.0, 0.0, 0.0), Pose2(5.0, 0.0, 0.0), yard(20.0), config).terms(1.0)
        there = closeness_of(clear, terms)
        assert 0.0 <= closeness_of(clear + more, terms) <= there <= terms.closeness
        assert closeness_of(terms.near, terms) == 0.0


# -- starts and goals ----------------------------------------------------------------------------------------


@FEWER
@given(close=CLOSE, turn=st.sampled_from([0.0, 1e-17, 1e-9, 1e-6, 0.1]), bearing=st.floats(-pi, pi))
@example(close=0.0, turn=0.0, bearing=0.0)
@example(close=1e-9, turn=0.0, bearing=0.0)
@example(close=0.0, turn=0.1, bearing=0.0)
def test_a_route_leads_to_a_goal_however_close_the_start_is_to_it(
    close: float, turn: float, bearing: float
) -> None:
    start = Pose2(close * cos(bearing), close * sin(bearing), turn)
    for tolerance in ((0.05, 0.05, 0.035), (1e-9, 1e-9, 1e-9)):
        made = plan_manoeuvre(
            start, Pose2(0.0, 0.0, 0.0), yard(30.0), ControllerConfig(goal_tolerance=tolerance)
        )
        assert made.outcome is PlanOutcome.FOUND, made.reason
        assert leads_to_its_goal(made)


@FEWER
@given(
    close=CLOSE,
    bearing=st.floats(-pi, pi),
    straight=st.sampled_from([0.1, 2.0]),
    direction=st.sampled_from(BOTH_WAYS),
)
@example(close=0.0, bearing=0.0, straight=2.0, direction=1)
@example(close=1e-10, bearing=0.0, straight=2.0, direction=1)
@example(close=1e-7, bearing=0.0, straight=2.0, direction=1)
def test_a_route_into_a_dock_is_found_from_where_its_straight_approach_begins(
    close: float, bearing: float, straight: float, direction: Direction
) -> None:
    config = ControllerConfig(route=RoutePlanner(final_straight=straight, final_direction=direction))
    goal = Pose2(3.0, 1.0, 0.4)
    before = goal.compose(Pose2(-direction * straight, 0.0, 0.0))
    start = Pose2(before.x + close * cos(bearing), before.y + close * sin(bearing), before.phi)
    made = plan_manoeuvre(start, goal, yard(30.0), config)
    assert made.outcome is PlanOutcome.FOUND, made.reason
    assert leads_to_its_goal(made)


@pytest.mark.parametrize("straight", [0.0, 1e-17, 1e-9, 1e-3, 0.5])
@pytest.mark.parametrize("direction", [1, -1, 0])
def test_a_route_ends_in_its_goal_whatever_the_length_of_its_last_straight(
    straight: float, direction: Direction
) -> None:
    config = ControllerConfig(route=RoutePlanner(final_straight=straight, final_direction=direction))
    made = plan_manoeuvre(Pose2(0.0, 0.0, 0.0), Pose2(6.0, 1.0, 0.0), yard(30.0), config)
    assert made.outcome is PlanOutcome.FOUND, made.reason
    assert leads_to_its_goal(made)


@pytest.mark.parametrize("finer", [1e-6, 0.01, 1.0, 32.0])
def test_a_lattice_of_any_fineness_is_searched(finer: float) -> None:
    config = ControllerConfig(route=RoutePlanner(searches=((finer, 3.0),)))
    made = plan_manoeuvre(Pose2(0.0, 0.0, 0.0), Pose2(6.0, 1.0, 0.0), yard(30.0), config)
    assert made.outcome is PlanOutcome.FOUND, made.reason


@pytest.mark.parametrize("half", [1e-6, 0.3, 1.0])
def test_in_an_area_smaller_than_the_body_a_start_is_refused_and_nothing_raises(half: float) -> None:
    made = plan_manoeuvre(Pose2(0.0, 0.0, 0.0), Pose2(0.1, 0.0, 0.0), yard(half))
    assert made.outcome is PlanOutcome.START_IN_COLLISION


@pytest.mark.parametrize("half", [(5.0, 2.0), (300.0, 1.5)])
def test_a_lane_of_few_cells_across_is_driven_along(half: tuple[float, float]) -> None:
    long, wide = half
    lane = Area(boundary=[(-5.0, -wide), (long, -wide), (long, wide), (-5.0, wide)])
    made = plan_manoeuvre(Pose2(-3.0, 0.0, 0.0), Pose2(0.5, 0.0, 0.0), lane)
    assert made.outcome is PlanOutcome.FOUND, made.reason


@FEW
@given(cell=st.floats(0.05, 3.0), x=st.floats(-4.0, 4.0), y=st.floats(-4.0, 4.0))
@example(cell=20.0, x=0.0, y=0.0)  # all in one cell
@example(cell=0.5, x=0.0, y=0.0)
def test_what_is_left_to_a_goal_is_nothing_there_and_no_more_than_a_way_over_the_cells(
    cell: float, x: float, y: float
) -> None:
    area, config = yard(5.0), ControllerConfig()
    low, high = np.array([-5.0, -5.0]), np.array([5.0, 5.0])

    apart = result_of(axle_clearances(area.grid, low, high, cell, 0.8 + config.clearance.on_routes + cell))
    known = result_of(cost_to_go(apart, low, cell, 0.8, (0.0, 0.0), config))
    left = float(looked_up(known, x, y))
    assert known.cost.min() == 0.0
    assert left >= 0.0
    if max(abs(x), abs(y)) < 5.0 - 0.8 - config.clearance.on_routes - 2.0 * cell:
        assert left <= over_cells(x, y) + 3.0 * cell


# -- ways of arcs --------------------------------------------------------------------------------------------


@FEW
@given(length=st.floats(-10.0, 10.0), curvature=CURVATURES, phi=st.floats(-pi, pi))
@example(length=0.0, curvature=0.0, phi=0.0)
@example(length=1.0, curvature=1e-12, phi=0.0)
@example(length=1.0, curvature=3e-12, phi=0.0)
def test_an_arc_becomes_a_straight_as_its_curvature_becomes_0(
    length: float, curvature: float, phi: float
) -> None:
    x, y, turned = after(0.0, 0.0, phi, length, curvature)
    assert hypot(x - length * cos(phi), y - length * sin(phi)) <= 0.5 * abs(curvature) * length**2 + 1e-12
    assert turned == pytest.approx(phi + curvature * length)
    assert hypot(x, y) <= abs(length) + 1e-12


@FEW
@given(way=WAYS, longest=st.floats(-3.0, 2.0).map(lambda n: 10.0**n))
@example(way=np.array([[1e-17, 0.0]]), longest=1.0)
@example(way=np.array([[1.0, 0.0]]), longest=1.0)
def test_a_way_that_is_split_or_put_together_leads_to_the_same_place(way: Array, longest: float) -> None:
    start = np.array([1.0, 2.0, 0.3])
    end, short, whole = poses_after(start, way)[-1], split(way, longest), joined(way)
    assert (np.abs(short[:, 0]) <= longest * (1.0 + 1e-6)).all()
    assert length_of(short) == pytest.approx(length_of(way))
    assert poses_after(start, short)[-1] == pytest.approx(end, abs=1e-9)
    # What is shorter than 1e-9 m is none.
    led = poses_after(start, whole)[-1] if len(whole) else start
    assert led == pytest.approx(end, abs=1e-7)


@FEW
@given(way=WAYS.filter(lambda way: length_of(joined(way)) > 0.0), spacing=st.floats(0.05, 2.0))
@example(way=np.array([[2e-9, 2.0]]), spacing=1.0)
@example(way=np.array([[3.0, 0.1], [1e-17, 0.4], [2.0, -0.1]]), spacing=1.0)
def test_means_of_curvatures_are_among_them_and_stretches_are_as_long_as_their_way(
    way: Array, spacing: float
) -> None:
    stretches = Stretches.of(way, spacing, 0.25 * spacing)
    made = stretches.way()
    assert np.isfinite(made).all()
    assert length_of(made) == pytest.approx(length_of(way))
    low, high = float(way[:, 1].min()), float(way[:, 1].max())
    assert low - 1e-6 <= stretches.knots.min()
    assert stretches.knots.max() <= high + 1e-6


@FEW
@given(length=st.floats(0.0, 5.0), more=st.floats(0.0, 5.0))
@example(length=0.0, more=0.0)
@example(length=1e-17, more=1.0)
def test_the_end_of_a_longer_stretch_is_no_more_narrow(length: float, more: float) -> None:
    config = ControllerConfig()
    short, long = (_tolerance(each, config) for each in (length, length + more))
    least = config.route.least_tolerance
    for here, there, whole in zip(short, long, config.behaviour.cusp_tolerance, strict=True):
        assert least * whole <= here <= there <= whole


# -- repaired paths ------------------------------------------------------------------------------------------


@FEWER
@given(
    segments=st.lists(
        st.tuples(st.sampled_from([1, -1]), st.sampled_from([0.0, 0.1, -0.2, 0.4, 2.0]), LENGTHS),
        min_size=1,
        max_size=3,
    )
)
@example(segments=[(1, 2.0, 1e-10)])
@example(segments=[(1, 0.0, 5.0), (1, 2.0, 1e-10), (1, 0.0, 5.0)])
@example(segments=[(1, 0.0, 5.0), (-1, 2.0, 1e-10), (1, 0.0, 5.0)])
@example(segments=[(1, 0.0, 5.0), (-1, 2.0, 1e-17), (1, 0.0, 5.0)])
@example(segments=[(1, 0.0, 5.0), (-1, 0.0, 1e-9), (1, 0.0, 5.0)])
def test_a_repaired_path_keeps_the_ends_of_its_parts_however_short_they_are(
    segments: list[tuple[int, float, float]],
) -> None:
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), segments)
    config = ControllerConfig(route=RoutePlanner(nodes=500, smoothing_iterations=10))
    block = [(2.0, 1.0), (3.0, 1.0), (3.0, 2.0), (2.0, 2.0)]
    repaired = mended_path(path, yard(60.0).with_obstacles([block]), config).path
    lasting = [part for part in path.parts if part.end - part.start > 1e-8]
    kept = [part for part in repaired.parts if part.end - part.start > 1e-8]
    assert len(lasting) == len(kept)
    for given_part, made in zip(lasting, kept, strict=True):
        assert given_part.direction == made.direction
        assert hypot(given_part.last.x - made.last.x, given_part.last.y - made.last.y) <= 1e-6


def test_the_sharpest_bend_of_a_vehicle_is_that_of_its_wheels() -> None:
    for wheelbase in (0.05, 2.875, 20.0):
        config = car(wheelbase)
        assert config.max_curvature == pytest.approx(tan(config.limits.steering) / wheelbase)
