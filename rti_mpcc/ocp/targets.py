"""What a one-direction part is to end in: its own end, a stop on it, or a goal pose beside or behind it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property
from math import hypot

from geometry import PathPart, Pose2, lift

PROJECTION_REACH = 1.0
"""A goal that has moved by less than this is projected near its last projection [m]: noise makes no jumps."""
OVERRUN = 0.1
"""Of the progress past the stop of a goal pose [m] (published code)."""


class TargetKind(Enum):
    """What ends a part."""

    PATH_END = "path end"
    POSE = "pose"


@dataclass(frozen=True, kw_only=True)
class Target:
    """Where a one-direction part is to end at rest.

    Attributes:
        pose: rear axle pose, heading on the branch nearest the path's.
        theta: progress of its projection onto the part [m].
        theta_end: end of the part [m].
        kind: the path's own end (or cusp), or a goal pose beside or behind it.
        across: how far the pose is to the left of the path there [m].
        goal: that pose as it was given, with its heading on any branch; None for the path's end.
        wheels: angle that the wheels are to come to there [rad], or None; wheels_share: of its weight.
    """

    pose: Pose2
    theta: float
    theta_end: float
    kind: TargetKind
    across: float = 0.0
    goal: Pose2 | None = None
    wheels: float | None = None
    wheels_share: float = 0.0

    @cached_property
    def stop(self) -> float:
        """min(theta_e, theta_g): where the path stops to count [m]."""
        return min(self.theta, self.theta_end)

    @cached_property
    def farthest(self) -> float:
        """How far the progress may go [m]: at a path's end no farther than the stop, it would end there."""
        return self.stop + (OVERRUN if self.kind is TargetKind.POSE else 0.0)

    @property
    def behind(self) -> float:
        """How far a goal pose lies behind the part's end [m]; 0 where it does not."""
        return max(self.theta - self.theta_end, 0.0)


def goal_on(part: PathPart, goal: Pose2, last: Target | None = None) -> Target:
    """The goal as the target of a part; `last`: what the part was to end in before, or None."""
    if last is None or last.goal is None:
        near = None
    elif last.goal == goal:
        return last
    else:
        near = last.theta if apart(goal, last.pose) < PROJECTION_REACH else None
    theta = part.project(goal.x, goal.y, heading=goal.phi, near=near)
    if theta <= 0.5 * (part.start + part.end) and apart(goal, part.last) <= apart(goal, part.pose(theta)):
        theta = part.end  # of a path that comes back to where it began
    pose, progress = replace(goal, phi=lift(goal.phi, part.pose(theta).phi)), part.progress(goal, theta)
    return Target(
        pose=pose,
        theta=progress,
        theta_end=part.end,
        kind=TargetKind.POSE,
        across=pose.relative_to(part.pose(progress)).y,
        goal=goal,
    )


def apart(one: Pose2, other: Pose2) -> float:
    """Distance of two poses [m]."""
    return hypot(one.x - other.x, one.y - other.y)


def path_end(part: PathPart) -> Target:
    """The part's own end as its target."""
    return Target(pose=part.last, theta=part.end, theta_end=part.end, kind=TargetKind.PATH_END)


def ended_at(part: PathPart, pose: Pose2, wheels: float | None, share: float) -> Target:
    """A pose just beside the part's own end as its target, with the wheels at an angle [rad], for a share of
    the weight on that."""
    return Target(
        pose=Pose2(pose.x, pose.y, lift(pose.phi, part.last.phi)),
        theta=part.end,
        theta_end=part.end,
        kind=TargetKind.PATH_END,
        across=pose.relative_to(part.pose(part.end)).y,
        wheels=wheels,
        wheels_share=share,
    )


def stop_on(part: PathPart, theta: float) -> Target:
    """A stop on the path at progress `theta` [m], or at its end, as its target."""
    theta = min(theta, part.end)
    return Target(pose=part.pose(theta), theta=theta, theta_end=part.end, kind=TargetKind.PATH_END)
