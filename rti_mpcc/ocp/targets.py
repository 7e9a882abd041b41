"""What a one-direction part is to end in: its own end, a stop on it, or a goal pose beside or behind it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum

from geometry import PathPart, Pose2, lift


class TargetKind(Enum):
    """What ends a part."""

    PATH_END = "path end"
    POSE = "pose"


@dataclass(frozen=True, slots=True, kw_only=True)
class Target:
    """Where a one-direction part is to end at rest.

    Attributes:
        pose: rear axle pose, heading on the branch nearest the path's.
        theta: progress of its projection onto the part [m].
        theta_end: end of the part [m].
        kind: the path's own end (or cusp), or a goal pose beside or behind it.
    """

    pose: Pose2
    theta: float
    theta_end: float
    kind: TargetKind

    @property
    def stop(self) -> float:
        """min(theta_e, theta_g): where the path stops to count [m]."""
        return min(self.theta, self.theta_end)

    @property
    def behind(self) -> float:
        """How far a goal pose lies behind the part's end [m]; 0 where it does not."""
        return max(self.theta - self.theta_end, 0.0)


def goal_on(part: PathPart, goal: Pose2, *, near: float | None = None) -> Target:
    """The goal as the target of a part.

    Args:
        near: where its last projection was, if it has hardly moved, so that noise makes no jumps [m].
    """
    theta = part.project(goal.x, goal.y, heading=goal.phi, near=near)
    return Target(
        pose=replace(goal, phi=lift(goal.phi, part.pose(theta).phi)),
        theta=part.progress(goal, theta),
        theta_end=part.end,
        kind=TargetKind.POSE,
    )


def path_end(part: PathPart) -> Target:
    """The part's own end as its target."""
    return Target(pose=part.last, theta=part.end, theta_end=part.end, kind=TargetKind.PATH_END)


def stop_on(part: PathPart, theta: float) -> Target:
    """A stop on the path at progress `theta` [m] as its target."""
    return Target(pose=part.pose(theta), theta=theta, theta_end=part.end, kind=TargetKind.PATH_END)
