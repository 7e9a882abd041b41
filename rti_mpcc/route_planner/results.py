"""What comes of planning: a manoeuvre in the world, or why there is none."""

from __future__ import annotations

from dataclasses import replace
from math import atan, inf

import numpy as np

from geometry import Pose2, ReferencePath
from rti_mpcc.config import ControllerConfig
from rti_mpcc.manoeuvre import CUSP_TOLERANCE, WHOLE_TOLERANCE, Manoeuvre, PlanOutcome, Segment, SegmentEnd
from rti_mpcc.route_planner.drivable import Drivable
from rti_mpcc.route_planner.problem import Problem

LEAST_TOLERANCE = 0.5
"""Share of the tolerance at the end of the shortest stretch."""
_STANDING = 1.0
"""Length of the straight way that a vehicle stands at the end of which is in its goal already [m]."""
_SAME = 1e-6  # [m], [rad] poses that are nearer to one another are the same, whatever the tolerance


def failed(
    problem: Problem, outcome: PlanOutcome, reason: str, nodes: int = 0, nearest: float = inf
) -> Manoeuvre:
    """No manoeuvre, and why; after so many nodes, the nearest one so far from the goal [m]."""
    start, goal = problem.given
    nearest = min(nearest, problem.distance)
    return Manoeuvre(start=start, goal=goal, outcome=outcome, reason=reason, nodes=nodes, nearest=nearest)


def is_there(problem: Problem, share: float) -> bool:
    """Whether the start is within a share of the goal tolerance of the goal."""
    start, goal = problem.given
    along, across, heading = (max(share * most, _SAME) for most in problem.config.goal_tolerance)
    return start.relative_to(goal).within((along, across, heading))


def standing(problem: Problem, clearance: float) -> Manoeuvre:
    """The manoeuvre of a vehicle that stands in its goal: a straight way up to it, with nothing to drive."""
    start, goal = problem.given
    begin = goal.compose(Pose2(-_STANDING, 0.0, 0.0))
    (part,) = ReferencePath.from_segments(start=begin, segments=[(1, 0.0, _STANDING)]).parts
    segment = Segment(part=part, index=0, end=SegmentEnd.GOAL, tolerance=problem.config.goal_tolerance)
    return Manoeuvre(
        start=start, goal=goal, outcome=PlanOutcome.FOUND, segments=(segment,), clearance=clearance,
        nearest=0.0,
    )  # fmt: skip


def found(problem: Problem, driven: Drivable, nodes: int) -> Manoeuvre:
    """The manoeuvre of a way: a segment for each stretch, at the ends of which the wheels may be turned."""
    # From the start, and then put in place: so no coordinate is rounded more than once.
    start, goal = problem.given
    place = np.array([start.x, start.y])
    config, pose, theta = problem.config, Pose2(0.0, 0.0, start.phi), 0.0
    segments: list[Segment] = []
    stretches = driven.stretches
    for index, (way, room) in enumerate(stretches):
        pieces = [(1 if length > 0.0 else -1, curvature, abs(length)) for length, curvature in way.tolist()]
        (part,) = ReferencePath.from_segments(start=pose, segments=pieces).parts
        pose = part.last
        part = replace(part, knots=part.knots + theta, x=part.x + place[0], y=part.y + place[1])
        last = index == len(stretches) - 1
        segments.append(
            Segment(
                part=part,
                index=index,
                end=SegmentEnd.GOAL if last else SegmentEnd.CUSP,
                tolerance=config.goal_tolerance if last else _tolerance(part.end - part.start, config),
                wheels=atan(config.vehicle.wheelbase * float(part.curvatures[0])),
                margin=room,
            )
        )
        theta = part.end
    return Manoeuvre(
        start=start,
        goal=goal,
        outcome=PlanOutcome.FOUND,
        segments=tuple(segments),
        clearance=driven.clearance,
        nearest=0.0,
        nodes=nodes,
    )


def _tolerance(length: float, config: ControllerConfig) -> tuple[float, float, float]:
    """At the end of a stretch [m], [m], [rad]: a short one must not be over where it begins."""
    share = min(max(length / WHOLE_TOLERANCE, LEAST_TOLERANCE), 1.0)
    along, across, heading = CUSP_TOLERANCE
    return share * along, share * across, share * heading
