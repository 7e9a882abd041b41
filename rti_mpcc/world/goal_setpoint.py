"""The goal setpoint: a noisy given goal is averaged, detections are followed at a bounded rate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import degrees, hypot, pi

import numpy as np

from estimation import GoalEstimate, GoalPrior, GoalStatus, Judgement, stds_in
from geometry import Pose2, lift, wrap
from rti_mpcc.config import ControllerConfig
from rti_mpcc.world.goals import GOAL_MOVED, GoalFit
from rti_mpcc.world.world import GoalState, World

_SPEED, _TURN_RATE = 3.0, 1.5  # at most, of the goal setpoint towards the estimate [m/s], [rad/s]
_LONGEST_STEP = 0.5  # after a longer gap between two cycles [s] it moves no farther than in this time
_CERTAINTY = 2.0  # standard deviations that fit the goal tolerance: a goal that is LOST may be docked at
NOISE, NOISE_HEADING = 0.15, 0.1  # [m], [rad] from the present goal: noise; five times a deviation of 3 cm
NOISE_TIME = 0.5  # [s] of their mean: a goal that moves by 0.3 m/s is followed 0.15 m behind
_TURNING = 0.02  # [rad/s], of a dock that is said to turn


def steadied(came: Pose2, before: Pose2 | None, planned: Pose2 | None, cycle: float) -> Pose2:
    """The goal to plan for, where `came` was given after `before` and `planned` is the present one.

    A noisy goal, given in each cycle, is averaged; one given twice, or one that has jumped, is not.
    """
    if planned is None or came in (before, planned):
        return came
    off, share = came.relative_to(planned), min(cycle / NOISE_TIME, 1.0)
    if hypot(off.x, off.y) > NOISE or abs(off.phi) > NOISE_HEADING:
        return came
    x, y = planned.x + share * (came.x - planned.x), planned.y + share * (came.y - planned.y)
    return Pose2(x, y, planned.phi + share * off.phi)


def prior(goal: GoalState, end: Pose2 | None) -> GoalPrior | None:
    """What is known of the goal before any detection; None: nothing. `end`: of a path without another goal.

    A dock says itself how wrong its planned pose may be. Another goal that was given is usually right to
    within what the same route is good for.
    """
    if goal.planned is None:
        return None if end is None else GoalPrior(pose=end)
    position, heading = goal.terms.uncertainty or GOAL_MOVED
    known = GoalPrior(pose=goal.planned, expected_position=position, expected_heading=heading)
    if goal.terms.uncertainty is None:
        return known
    return replace(known, position=position, heading=min(heading, 0.5 * pi))


def rate_limited_goal(
    s: World, estimate: GoalEstimate, fit: GoalFit | None, end: Pose2 | None, cycle: float
) -> GoalState:
    """With the setpoint moved towards the last estimate that passed its check, `fit`; before the first one it
    is the planned goal, or the path's `end`. `cycle`: [s]."""
    known, now = s.goal, s.clock.now
    last, pose, detected = known.estimated_at, known.planned, known.detected
    if estimate.pose is None or not (fit and fit.problem):
        detected = estimate.pose
    if detected is not None:
        seconds = cycle if last is None else min(max(now - last, 0.0), _LONGEST_STEP)
        before = known.pose or end or detected
        pose = _towards(before, detected, _SPEED * seconds, _TURN_RATE * seconds)
    return replace(known, estimate=estimate, estimated_at=now, estimate_fit=fit, detected=detected, pose=pose)


STAYS = "; keeping the previous goal"
NOT_THE_ONE = "standing at the previous goal, as the given goal was rejected"


def goal_remarks(goal: GoalState) -> tuple[str, ...]:
    """Remarks on the goal that was given, on the detected one, and on the setpoint."""
    fit, found = goal.estimate_fit, []
    if goal.refusal:
        found.append(goal.refusal + STAYS * goal.accepted)
    if fit is not None and fit.problem:
        where = f"({fit.pose.x:.6g}, {fit.pose.y:.6g}, {fit.pose.phi:.6g})"
        found.append(f"goal detected at {where} rejected: {fit.problem}{STAYS}")
    if goal.estimate is not None and goal.estimate.moves and goal.estimate.velocity is not None:
        x, y, turn = goal.estimate.velocity.tolist()
        turning = f", turning by {degrees(turn):.1f} deg/s" if abs(turn) > _TURNING else ""
        found.append(f"the dock moves at {hypot(x, y):.2f} m/s{turning}")
    if goal.undetected:
        found.append(f"goal not detected, the last detection: {goal.undetected}")
    made_for = goal.fit if goal.detected is None else fit
    if made_for is not None and made_for.remark and not goal.rejected:
        found.append(made_for.remark)
    return tuple(found)


def doubt(s: World, arrives_at: float | None, config: ControllerConfig) -> str:
    """Why the estimate is not good enough to dock by if the goal is not seen again, or ""."""
    estimate = s.goal.estimate
    if s.goal.terms.keep_out and never_seen(s.goal, config):
        return "goal not seen yet, and not certain to be where it is expected"
    tracking = config.goal_tracking
    if estimate is not None and waits_for_dock(s.goal, config):
        return "waiting until the dock stands"
    if estimate is None or estimate.status is not GoalStatus.LOST:
        return ""
    left = 0.0 if arrives_at is None else max(arrives_at - s.clock.now, 0.0)
    pose, covariance = estimate.pose, estimate.covariance
    assert pose is not None
    assert covariance is not None
    there = np.array([[pose.x, pose.y, pose.phi]])
    (stds,) = stds_in(there, (covariance + tracking.filter.drift(left))[None]).tolist()
    tolerance = s.goal.terms.on(config).goal_tolerance
    if all(_CERTAINTY * std <= most for std, most in zip(stds, tolerance, strict=True)):
        return ""
    along, across, heading = stds
    return (
        f"goal not seen for {estimate.age:.1f} s, on arrival known to {along:.3f} m along, {across:.3f} m "
        f"across, {degrees(heading):.2f} deg (one sigma)"
    )


def remark(goal: GoalState) -> str:
    """The remark on a goal that is driven to without being seen, or ""."""
    if goal.estimate is None or goal.estimate.status is not GoalStatus.LOST:
        return ""
    return f"goal not seen for {goal.estimate.age:.1f} s; continuing to its last estimate"


def never_seen(goal: GoalState, config: ControllerConfig) -> bool:
    """Whether the goal has to be seen, or was detected, and no detection was accepted."""
    seen = goal.estimate is not None and goal.estimate.status is not GoalStatus.SEARCHING
    elsewhere = goal.estimate_fit is not None and goal.detected is None  # detected where it cannot be
    told = goal.terms.on(config).goal_tracking.required or goal.undetected != ""
    return elsewhere or (told and not seen)


def undetected(goal: GoalState, judgements: Sequence[Judgement], unfit: str) -> str:
    """Why the last detection was rejected, while none is accepted; `unfit`: why an input is no detection."""
    if goal.estimate is not None and goal.estimate.status in (GoalStatus.TRACKING, GoalStatus.COASTING):
        return ""
    refused = [each.reason for each in judgements if not each.accepted]
    return (refused[-1] if refused else unfit) or goal.undetected


def is_elsewhere(goal: GoalState, here: Pose2, config: ControllerConfig) -> bool:
    """Whether the last given or detected goal was rejected, and a vehicle `here` is outside its tolerance."""
    tolerance, fit = goal.terms.on(config).goal_tolerance, goal.estimate_fit
    refused = [goal.given] if goal.refusal else []
    if fit is not None and fit.problem:
        refused.append(fit.pose)
    return not all(pose is not None and here.relative_to(pose).within(tolerance) for pose in refused)


def dock_has_moved(goal: GoalState, config: ControllerConfig) -> str:
    """Why a vehicle that stands at the goal is not docked: the dock moves, or is elsewhere; or "".

    The detections of the last moment decide, also where the estimate does not follow them yet.
    """
    estimate = goal.estimate
    if estimate is None:
        return ""
    if estimate.moves:
        return "standing at a dock that moves"
    if estimate.elsewhere is None or goal.pose is None:
        return ""
    off = estimate.elsewhere.relative_to(goal.pose)
    if off.within(goal.terms.on(config).goal_tolerance):
        return ""
    far, turn = hypot(off.x, off.y), degrees(off.phi)
    return f"the last detections agree on a dock {far:.3f} m and {turn:.1f} deg from the goal"


def waits_for_dock(goal: GoalState, config: ControllerConfig) -> bool:
    """Whether the dock moves, and is waited for rather than followed."""
    return goal.estimate is not None and goal.estimate.moves and not config.goal_tracking.filter.moving


def _towards(before: Pose2, wanted: Pose2, distance: float, angle: float) -> Pose2:
    """From one pose towards another by at most `distance` [m] and `angle` [rad]."""
    x, y = wanted.x - before.x, wanted.y - before.y
    far = hypot(x, y)
    share = 1.0 if far <= distance else distance / far
    turn = max(min(wrap(wanted.phi - before.phi), angle), -angle)
    phi = lift(wanted.phi, before.phi) if abs(turn) < angle else before.phi + turn
    return Pose2(before.x + share * x, before.y + share * y, phi)
