"""The result of planning: a manoeuvre in the world, or the reason why there is none."""

from __future__ import annotations

from dataclasses import replace
from math import atan, inf

from geometry import Pose2, ReferencePath
from rti_mpcc.config import ControllerConfig
from rti_mpcc.manoeuvre import CUSP_TOLERANCE, WHOLE_TOLERANCE, Manoeuvre, PlanOutcome, Segment, SegmentEnd
from rti_mpcc.route_planner.drivable import DrivableRoute
from rti_mpcc.route_planner.problem import RouteProblem

LEAST_TOLERANCE = 0.5
"""Share of the tolerance at the end of the shortest segment."""
_STANDING = 1.0
"""Length of the straight segment at the end of which a vehicle stands that is in its goal already [m]."""


def no_manoeuvre(
    problem: RouteProblem, outcome: PlanOutcome, reason: str, nodes: int = 0, nearest: float = inf
) -> Manoeuvre:
    """No manoeuvre, and why; after so many nodes, the nearest one so far from the goal [m]."""
    start, goal = problem.given
    nearest = min(nearest, problem.distance)
    return Manoeuvre(start=start, goal=goal, outcome=outcome, reason=reason, nodes=nodes, nearest=nearest)


def nothing_to_drive(problem: RouteProblem, clearance: float) -> Manoeuvre:
    """The manoeuvre of a vehicle that stands in its goal: a straight segment that ends there."""
    start, goal = problem.given
    before = goal.compose(Pose2(-_STANDING, 0.0, 0.0))
    (part,) = ReferencePath.from_segments(start=before, segments=[(1, 0.0, _STANDING)]).parts
    segment = Segment(part=part, index=0, end=SegmentEnd.GOAL, tolerance=problem.config.goal_tolerance)
    return Manoeuvre(
        start=start, goal=goal, outcome=PlanOutcome.FOUND, segments=(segment,), clearance=clearance,
        nearest=0.0,
    )  # fmt: skip


def manoeuvre_of(problem: RouteProblem, route: DrivableRoute, nodes: int) -> Manoeuvre:
    """The manoeuvre of a route."""
    # From the start, and then put in place: so no coordinate is rounded more than once.
    (start, goal), config = problem.given, problem.config
    pose, theta = Pose2(0.0, 0.0, start.phi), 0.0
    segments: list[Segment] = []
    found = route.segments
    for index, (arcs, clearance) in enumerate(found):
        pieces = [(1 if length > 0.0 else -1, curvature, abs(length)) for length, curvature in arcs.tolist()]
        (part,) = ReferencePath.from_segments(start=pose, segments=pieces).parts
        pose = part.last
        part = replace(part, knots=part.knots + theta, x=part.x + start.x, y=part.y + start.y)
        theta = part.end
        last = index == len(found) - 1
        segments.append(
            Segment(
                part=part,
                index=index,
                end=SegmentEnd.GOAL if last else SegmentEnd.CUSP,
                tolerance=config.goal_tolerance if last else _tolerance(part.end - part.start, config),
                wheels=atan(config.vehicle.wheelbase * float(part.curvatures[0])),
                margin=clearance,
            )
        )
    return Manoeuvre(
        start=start, goal=goal, outcome=PlanOutcome.FOUND, segments=tuple(segments),
        clearance=route.clearance, nearest=0.0, nodes=nodes,
    )  # fmt: skip


def _tolerance(length: float, config: ControllerConfig) -> tuple[float, float, float]:
    """At the end of a segment [m], [m], [rad]: a short one must not be over where it starts."""
    share = min(max(length / (config.size * WHOLE_TOLERANCE), LEAST_TOLERANCE), 1.0)
    along, across, heading = CUSP_TOLERANCE
    return config.size * share * along, config.size * share * across, share * heading
