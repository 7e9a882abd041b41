"""What can be a goal: near the path's last part, turned with it, and with room for the body.

One rule for scenario files and for every cycle, which checks only what is new: see `checked_again`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import hypot, inf, pi, radians

import numpy as np

from geometry import Area, Corridor, PathPart, Pose2, ReferencePath, wrap
from geometry.pose import degrees_hint
from geometry.settings import replaced
from rti_mpcc.config import ControllerConfig, Vehicle
from rti_mpcc.model.footprint import clearances
from rti_mpcc.world.surroundings import GOAL_REACH, Surroundings

GOAL_TURN = 0.5 * pi  # [rad] from the path's heading beside it: the same
UNMOVED = (0.01, 0.03)  # [m] of any point of the body: the goal needs no other check, by its clearance
IN_DEGREES = pi / 6.0  # [rad] from the path's heading: a refused heading this near in degrees was meant so
ODD = 0.2  # [rad] from the path's heading: a heading that is not refused is suspected of it
SURELY_IN_DEGREES = 0.1  # [rad]: if it is within this, read in degrees

GOAL_MOVED = (1.0, 0.35)
"""A goal that moved farther than this from the one planned for is planned for again [m], [rad]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GoalFit:
    """Whether a pose can be the goal.

    Attributes:
        pose: that was checked; problem: why it cannot be the goal, or ""; remark: on one that can, or "".
        clearance: clearance of the body there [m], negative in an overlap; inf: not checked.
        changes: number of obstacle changes known then.
    """

    pose: Pose2
    problem: str = ""
    remark: str = ""
    clearance: float = inf
    changes: int = 0


def checked_goal(
    goal: Pose2, path: ReferencePath, corridor: Corridor, vehicle: Vehicle, *, margin: float = 0.0
) -> GoalFit:
    """The exact check; less room than `margin` [m] is remarked. In an area a goal may be anywhere."""
    if corridor.area is not None:
        problem, hint = "", degrees_hint("goal heading", goal.phi)
        if not _in_box(goal, corridor.area):
            return GoalFit(pose=goal, problem="outside the boundary of the area")
    else:
        part = path.parts[-1]
        beside, hint = _beside(goal, part), degrees_beside("goal heading", goal, part)
        problem = _misplaced(goal, beside)
        if not problem and corridor.cut_off(len(path.parts) - 1, (beside.x, beside.y), (goal.x, goal.y)):
            return GoalFit(pose=goal, problem="a boundary lies between it and the path")
    if problem:
        return GoalFit(pose=goal, problem=_joined(problem, hint))
    clearance = _clearance(goal, path, corridor, vehicle)
    if clearance < 0.0:
        problem = _joined(f"the body there {_crossing(clearance)}", hint)
        return GoalFit(pose=goal, problem=problem, clearance=clearance)
    return GoalFit(pose=goal, remark=_joined(_tight(clearance, margin), hint), clearance=clearance)


def checked_again(
    last: GoalFit | None, goal: Pose2, path: ReferencePath, area: Surroundings, config: ControllerConfig
) -> GoalFit:
    """The check of a cycle, unless the `last` one still holds.

    A new obstacle on a goal that stays does not count: the vehicle waits in front of it. A goal rejected
    because of an obstacle is free again once the obstacle has gone.
    """
    if last is not None and (last.changes == area.changes or last.clearance >= 0.0):
        least, most = UNMOVED
        if _moved(last.pose, goal, config.vehicle) <= min(max(abs(last.clearance), least), most):
            return last
    fit = checked_goal(goal, path, area.corridor, config.vehicle, margin=config.clearance.wanted)
    return replace(fit, changes=area.changes)


def end_checked(path: ReferencePath, surroundings: Surroundings, config: ControllerConfig) -> GoalFit:
    """A remark on the path's last pose, which is the goal where none was given. Obstacles are waited for."""
    clearance = _clearance(path.end, path, surroundings.corridor.with_obstacles(()), config.vehicle)
    crossed = f"the body at the path's end {_crossing(clearance)}"
    remark = crossed if clearance < 0.0 else _tight(clearance, config.clearance.wanted)
    return GoalFit(pose=path.end, remark=remark, clearance=clearance, changes=surroundings.changes)


def degrees_beside(what: str, pose: Pose2, part: PathPart) -> str:
    """A hint where a heading would be near the path's if read in degrees, or "".

    Up to a full turn, which is 6 degrees, a heading is taken for what it is.
    """
    hint = degrees_hint(what, pose.phi)
    if not hint:
        return ""
    read = replace(pose, phi=radians(pose.phi))
    off, in_degrees = (_turn(one, _beside(one, part)) for one in (pose, read))
    refused = off > GOAL_TURN and in_degrees <= IN_DEGREES
    return hint if refused or (off > ODD and in_degrees <= SURELY_IN_DEGREES) else ""


def _misplaced(goal: Pose2, beside: Pose2) -> str:
    """Why a goal is out of reach of the path, whatever stands there, or ""."""
    distance, turn = hypot(goal.x - beside.x, goal.y - beside.y), _turn(goal, beside)
    if distance > GOAL_REACH:
        return f"{distance:.4g} m from the path's end (at most {GOAL_REACH:g} m)"
    if turn > GOAL_TURN:
        return f"turned by {turn:.4g} rad from the path (at most {GOAL_TURN:.4g} rad)"
    return ""


def _beside(pose: Pose2, part: PathPart) -> Pose2:
    """The path's pose nearest to a pose, where that has about its heading if anywhere."""
    return part.pose(part.project(pose.x, pose.y, heading=pose.phi))


def _turn(one: Pose2, other: Pose2) -> float:
    return abs(float(wrap(one.phi - other.phi)))


def _in_box(goal: Pose2, area: Area) -> bool:
    """Whether it is in the box around the boundary: far outside of that nothing is solid any more."""
    if area.boundary is None:
        return True
    (left, bottom), (right, top) = area.boundary.min(axis=0), area.boundary.max(axis=0)
    return bool(left <= goal.x <= right and bottom <= goal.y <= top)


def _clearance(goal: Pose2, path: ReferencePath, corridor: Corridor, vehicle: Vehicle) -> float:
    """Clearance [m] of the body at the goal."""
    at = np.array([[goal.x, goal.y, goal.phi]])
    return float(clearances(at, corridor, len(path.parts) - 1, vehicle).min())


def _crossing(clearance: float) -> str:
    return f"crosses a boundary or obstacle by {-clearance:.3g} m"


def _tight(clearance: float, margin: float) -> str:
    if clearance >= margin:
        return ""
    return f"the goal leaves {clearance:.2f} m beside the body, less than the margin of {margin:.2f} m"


def _moved(before: Pose2, now: Pose2, vehicle: Vehicle) -> float:
    """No point of the body is farther than this [m] between two poses."""
    arm = hypot(max(vehicle.front, vehicle.rear), 0.5 * vehicle.width)
    return hypot(now.x - before.x, now.y - before.y) + arm * _turn(now, before)


def _joined(*said: str) -> str:
    return "; ".join(filter(None, said))


Outline = tuple[tuple[float, float], ...]  # corners x, y [m], of a value that can be compared


@dataclass(frozen=True, slots=True, kw_only=True)
class GoalTerms:
    """What is asked of one goal in place of the settings.

    Attributes:
        tolerance: longitudinal [m], lateral [m], heading [rad]; None: `ControllerConfig.goal_tolerance`.
        detected: whether the goal has to be seen to be docked at; None: `GoalTracking.required`.
        approach: length [m] and direction, +1 or -1, of the straight end of a planned route; None:
            `RoutePlanner.final_straight`.
        uncertainty: largest error of the planned goal in position [m] and heading [rad]; None: not known.
        keep_out: outlines [m] to keep out of before the straight end, until the goal is detected.
    """

    tolerance: tuple[float, float, float] | None = None
    detected: bool | None = None
    approach: tuple[float, int] | None = None
    uncertainty: tuple[float, float] | None = None
    keep_out: tuple[Outline, ...] = ()

    def on(self, config: ControllerConfig) -> ControllerConfig:
        """The settings with what is asked here."""
        changes: dict[str, object] = {}
        if self.tolerance is not None:
            changes["goal_tolerance"] = self.tolerance
        if self.detected is not None:
            changes["goal_tracking"] = replaced(config.goal_tracking, required=self.detected)
        if self.approach is not None:
            length, direction = self.approach
            changes["route"] = replaced(config.route, final_straight=length, final_direction=direction)
        return replaced(config, **changes) if changes else config


NO_TERMS = GoalTerms()
