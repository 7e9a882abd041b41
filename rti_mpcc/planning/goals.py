"""What can be a goal: near the path's last part, turned with it, and with room for the body.

One rule for scenario files and for every cycle. A cycle looks only at what is new: see `checked_again`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import hypot, nan, radians

import numpy as np

from geometry import Area, Corridor, PathPart, Pose2, ReferencePath, wrap
from geometry.angles import degrees_hint
from rti_mpcc.config import ControllerConfig, GoalLimits, Vehicle
from rti_mpcc.model.footprint import clearances
from rti_mpcc.planning.surroundings import Surroundings

NOISE, NOISE_HEADING = 0.15, 0.1
"""So far a goal may be from the last ones to be the same with noise [m], [rad]: five times a deviation of
3 cm."""
NOISE_TIME = 0.5
"""Time constant of their mean [s]: a goal that moves by 0.3 m/s is followed 0.15 m behind."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GoalFit:
    """Whether a pose can be the goal.

    Attributes:
        pose: the one looked at.
        problem: why it cannot be, or "".
        remark: what there is to say of it although it can, or "".
        room: clearance of the body there [m]; negative: so deep it crosses something; NaN: not looked at.
        excess: so far the body has to move, at least, until that is otherwise [m]; 0: not known.
        beside: the path's pose nearest to it.
        changes: number of obstacle changes known then.
    """

    pose: Pose2
    problem: str = ""
    remark: str = ""
    room: float = nan
    excess: float = 0.0
    beside: Pose2
    changes: int = 0


def checked(
    goal: Pose2,
    path: ReferencePath,
    corridor: Corridor,
    vehicle: Vehicle,
    limits: GoalLimits,
    *,
    margin: float = 0.0,
) -> GoalFit:
    """The exact check.

    Args:
        limits: what can be a goal at all; margin: less room than this [m] is remarked.

    In an area a goal may be anywhere: the way there is planned.
    """
    if corridor.area is not None:
        if not _in_box(goal, corridor.area):
            return GoalFit(pose=goal, problem="it is beyond the boundary of the area", beside=goal)
        room = _room(goal, path, corridor, vehicle)
        problem = f"the body there {_crossing(room)}" if room < 0.0 else ""
        hint = degrees_hint("goal heading", goal.phi)
        excess, remark = max(-room, 0.0), "" if problem else _joined(_tight(room, margin), hint)
        problem = _joined(problem, hint) if problem else ""
        return GoalFit(pose=goal, problem=problem, remark=remark, room=room, excess=excess, beside=goal)
    part = path.parts[-1]
    beside, hint = _beside(goal, part), degrees_beside("goal heading", goal, part, limits)
    problem, excess = _misplaced(goal, beside, vehicle, limits)
    if problem:
        return GoalFit(pose=goal, problem=_joined(problem, hint), excess=excess, beside=beside)
    if corridor.cut_off(len(path.parts) - 1, (beside.x, beside.y), (goal.x, goal.y)):
        return GoalFit(pose=goal, problem="a boundary lies between it and the path", beside=beside)
    room = _room(goal, path, corridor, vehicle)
    if room < 0.0:
        problem = f"the body there {_crossing(room)}"
        return GoalFit(pose=goal, problem=problem, room=room, excess=-room, beside=beside)
    return GoalFit(pose=goal, remark=_joined(_tight(room, margin), hint), room=room, beside=beside)


def steadied(came: Pose2, before: Pose2 | None, planned: Pose2 | None, cycle: float) -> Pose2:
    """The goal to plan for, of one that came after the one `before`, while one was `planned`.

    A goal that is given anew in each cycle, with noise, is their mean over the last moments, so that neither
    a search nor a docked vehicle follows the noise. One that came twice is taken as it is, and so is one that
    has jumped.
    """
    if planned is None or came in (before, planned):
        return came
    off, share = came.relative_to(planned), min(cycle / NOISE_TIME, 1.0)
    if hypot(off.x, off.y) > NOISE or abs(off.phi) > NOISE_HEADING:
        return came
    x, y = planned.x + share * (came.x - planned.x), planned.y + share * (came.y - planned.y)
    return Pose2(x, y, planned.phi + share * off.phi)


def same_dock(dock: Pose2 | None, goal: Pose2, config: ControllerConfig) -> bool:
    """Whether a planned goal is that of a dock as it was given first, within the tolerance."""
    return dock is not None and goal.relative_to(dock).within(config.goal_tolerance)


def checked_again(
    last: GoalFit | None,
    goal: Pose2,
    path: ReferencePath,
    surroundings: Surroundings,
    config: ControllerConfig,
) -> GoalFit:
    """The check of a cycle, as far as the one before it does not answer it.

    Obstacles that came onto a goal that stays where it is are none of its: the vehicle waits before them. One
    that was refused because of an obstacle is free again once that has gone.

    Args:
        last: of the goal looked at last; None: there was none.
    """
    if last is not None and _answered(last, goal, surroundings.changes, config):
        return last
    corridor, margin = surroundings.corridor, config.clearance.wanted
    fit = checked(goal, path, corridor, config.vehicle, config.goal_limits, margin=margin)
    return replace(fit, changes=surroundings.changes)


def _answered(last: GoalFit, goal: Pose2, changes: int, config: ControllerConfig) -> bool:
    """Whether what was found of another goal holds for this one: no clearance changes by more than the body
    has moved."""
    vehicle, limits, known = config.vehicle, config.goal_limits, last.changes == changes
    moved = _moved(last.pose, goal, vehicle)
    if last.problem:
        within = max(min(last.excess, limits.still_refused), limits.unmoved)
        return (known or not last.room < 0.0) and moved <= within
    if moved <= limits.unmoved:
        return True
    if _misplaced(goal, last.beside, vehicle, limits)[0]:
        return False  # by that place of the path: another one may be nearer
    left = last.room - moved
    clear = known and left > config.clearance.wanted and not last.remark
    return clear or (moved <= limits.nearly_unmoved and left > 0.0)


def end_checked(path: ReferencePath, surroundings: Surroundings, config: ControllerConfig) -> GoalFit:
    """What there is to say of the path's last pose, which is the goal where none was told.

    Obstacles do not count: they come and go, and are waited for.
    """
    room = _room(path.end, path, surroundings.corridor.with_obstacles(()), config.vehicle)
    remark = (
        f"the body at the path's end {_crossing(room)}"
        if room < 0.0
        else _tight(room, config.clearance.wanted)
    )
    return GoalFit(pose=path.end, remark=remark, room=room, beside=path.end, changes=surroundings.changes)


def degrees_beside(what: str, pose: Pose2, part: PathPart, limits: GoalLimits) -> str:
    """What to say of a heading that is far from the path's beside it, but would be near it in degrees, or "".

    A heading may be on any branch. Up to a full turn, which is 6 degrees, it is taken for what it is.
    """
    hint = degrees_hint(what, pose.phi)
    if not hint:
        return ""
    read = replace(pose, phi=radians(pose.phi))
    off, in_degrees = (_turn(one, _beside(one, part)) for one in (pose, read))
    refused = off > limits.turn and in_degrees <= limits.in_degrees
    if refused or (off > limits.odd and in_degrees <= limits.surely_in_degrees):
        return hint
    return ""


def _misplaced(goal: Pose2, beside: Pose2, vehicle: Vehicle, limits: GoalLimits) -> tuple[str, float]:
    """Why a goal is out of reach of the path, `beside` which it is, whatever stands there, or "", and how far
    it is beyond that [m]."""
    distance, turn = hypot(goal.x - beside.x, goal.y - beside.y), _turn(goal, beside)
    if distance > limits.reach:
        said = f"{distance:.4g} m from the path's last part, at most {limits.reach:g} m"
        return said, distance - limits.reach
    if turn > limits.turn:
        said = f"turned by {turn:.4g} rad from the path beside it, at most {limits.turn:.4g} rad"
        return said, (turn - limits.turn) * _arm(vehicle)
    return "", 0.0


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


def _room(goal: Pose2, path: ReferencePath, corridor: Corridor, vehicle: Vehicle) -> float:
    """Clearance [m] of the body at the goal."""
    at = np.array([[goal.x, goal.y, goal.phi]])
    return float(clearances(at, corridor, len(path.parts) - 1, vehicle).min())


def _crossing(room: float) -> str:
    return f"crosses a boundary or obstacle by {-room:.3g} m"


def _tight(room: float, margin: float) -> str:
    if room >= margin:
        return ""
    return f"the goal leaves {room:.2f} m beside the body, less than the margin of {margin:.2f} m"


def _moved(before: Pose2, now: Pose2, vehicle: Vehicle) -> float:
    """No point of the body is farther than this [m] between two poses."""
    return hypot(now.x - before.x, now.y - before.y) + _arm(vehicle) * _turn(now, before)


def _arm(vehicle: Vehicle) -> float:
    """From the rear axle to the farthest point of the body [m]."""
    return hypot(max(vehicle.front, vehicle.rear), 0.5 * vehicle.width)


def _joined(*said: str) -> str:
    return "; ".join(filter(None, said))
