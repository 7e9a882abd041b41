"""Planned routes near what the planner divides by: small and large vehicles, wide margins, goals close by."""

from __future__ import annotations

from math import cos, hypot, pi, sin

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from geometry import Area, Pose2, ReferencePath, wrap
from rti_mpcc.config import Clearance, ControllerConfig, RoutePlanner, Vehicle
from rti_mpcc.manoeuvre import Manoeuvre, PlanOutcome
from rti_mpcc.route_planner.path_repair import repaired_path
from rti_mpcc.route_planner.planner import plan_manoeuvre

FEW = settings(derandomize=True, deadline=None, max_examples=60)
FEWER = settings(FEW, max_examples=20)

WHEELBASES = st.sampled_from([0.05, 0.18, 0.5, 1.0, 2.875, 8.0, 20.0])
CLOSE = st.sampled_from([0.0, 1e-17, 1e-12, 1e-10, 1e-9, 1e-7, 1e-6, 1e-4, 0.01, 0.04, 0.06])
"""How near a start is to some place [m]."""
LENGTHS = st.one_of(st.sampled_from([1e-17, 1e-10, 1e-9, 2e-9, 1e-6, 1e-3]), st.floats(0.01, 8.0))


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
    config = ControllerConfig(route=RoutePlanner(nodes=500))
    block = [(2.0, 1.0), (3.0, 1.0), (3.0, 2.0), (2.0, 2.0)]
    repaired = repaired_path(path, yard(60.0).with_obstacles([block]), config).path
    lasting = [part for part in path.parts if part.end - part.start > 1e-8]
    kept = [part for part in repaired.parts if part.end - part.start > 1e-8]
    assert len(lasting) == len(kept)
    for given_part, made in zip(lasting, kept, strict=True):
        assert given_part.direction == made.direction
        assert hypot(given_part.last.x - made.last.x, given_part.last.y - made.last.y) <= 1e-6
