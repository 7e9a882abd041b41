"""What a cycle is told, checked: whatever comes in, only what can be planned with goes on.

Nothing here raises for a value. What is not fit to be used is left out, and said.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import hypot, isfinite
from typing import TypeGuard

import numpy as np
from numpy.typing import ArrayLike

from estimation import Frame, GoalMeasurement
from estimation.measurement import is_time
from geometry import Pose2, RtiMpccError
from rti_mpcc.config import Caution
from rti_mpcc.planning.memory import ControllerMemory, renewed
from rti_mpcc.planning.surroundings import Surroundings
from rti_mpcc.planning.trust import FAR, MANY_TURNS

GOAL_REACH = 1e3
"""A goal farther than this from the path's end [m] is not taken."""
STILL = 3
"""A clock that has not moved for so many cycles stands still."""
LEAP = 3600.0
"""A clock that leaps ahead by more than this [s] was set anew."""


def goal_in(goal: Pose2 | None, end: Pose2) -> tuple[Pose2 | None, str]:
    """The goal, and why it is not used (then None). `end` is the path's last pose."""
    if goal is None:
        return None, ""
    try:
        x, y, phi = goal.x, goal.y, goal.phi
    except AttributeError:
        return None, f"goal is no Pose2 but a {type(goal).__name__}, the last one stays"
    if not _all_finite(x, y, phi):
        return None, f"goal ({x}, {y}, {phi}) not finite, the last one stays"
    if abs(phi) > MANY_TURNS or max(abs(x), abs(y)) > FAR or hypot(x - end.x, y - end.y) > GOAL_REACH:
        return None, f"goal ({x:.6g}, {y:.6g}, {phi:.6g}) out of reach, the last one stays"
    return goal if isinstance(goal, Pose2) else Pose2(float(x), float(y), float(phi)), ""


def surroundings_in(
    known: Surroundings, obstacles: Sequence[ArrayLike] | None, now: float, caution: Caution
) -> tuple[Surroundings, str]:
    """The surroundings with these obstacles at `now` [s], and why they are not used (then as known)."""
    if obstacles is None:
        return known, ""
    try:
        outlines = [np.asarray(outline, dtype=np.float64) for outline in obstacles]
        if any(outline.size and not np.abs(outline).max() <= FAR for outline in outlines):
            return known, "obstacles not finite or not near"
        return known.told(outlines, now, caution), ""
    except (RtiMpccError, ValueError, TypeError, OverflowError) as error:
        return known, f"obstacles not readable: {' '.join(str(error).split())}"


def measurements_in(measurements: Sequence[GoalMeasurement]) -> tuple[tuple[GoalMeasurement, ...], str]:
    """Those that are detections, of whatever numbers, and what the first one is that is none, or ""."""
    try:
        told: tuple[object, ...] = () if measurements is None else tuple(measurements)
    except TypeError:
        return (), f"measurements are no sequence but {type(measurements).__name__}, left out"
    good = tuple(measurement for measurement in told if _is_detection(measurement))
    if len(good) == len(told):
        return good, ""
    k, odd = next((k, one) for k, one in enumerate(told) if not _is_detection(one))
    if isinstance(odd, GoalMeasurement):
        return good, f"measurements[{k}] holds what is no number, pose or frame, left out"
    return good, f"measurements[{k}] is no GoalMeasurement but a {type(odd).__name__}, left out"


def _is_detection(told: object) -> TypeGuard[GoalMeasurement]:
    if not isinstance(told, GoalMeasurement) or not isinstance(told.frame, Frame):
        return False
    v = told.vehicle
    try:
        for number in (told.stamp, told.x, told.y, told.phi, *((v.x, v.y, v.phi) if v is not None else ())):
            isfinite(number)
    except (AttributeError, TypeError, ValueError, OverflowError):
        return False
    return True


def measurement_in(measurement: GoalMeasurement, offset: float) -> GoalMeasurement:
    """A detection with its stamp on the controller's own clock, `offset` [s] ahead of the user's."""
    return replace(measurement, stamp=measurement.stamp + offset) if offset else measurement


def timed(memory: ControllerMemory, now: float, cycle: float) -> tuple[ControllerMemory, str]:
    """The memory at the time that the user's clock shows, and what is wrong with that clock, or "".

    The controller's own clock never runs back: where the user's does, or leaps ahead, or shows no number, one
    cycle is taken to have passed, and the two are `clock_offset` apart from then on.
    """
    last = memory.time
    if not _all_finite(now) or not is_time(now):
        return renewed(memory, time=0.0 if last is None else last + cycle), f"the clock shows {now}"
    stood = memory.clock_stood + 1 if now == memory.clock_at else 0
    own, offset, word = now + memory.clock_offset, memory.clock_offset, ""
    if stood >= STILL:
        word = "the clock stands still"
    elif last is not None and not last <= own <= last + LEAP:
        word = f"the clock went {'back' if own < last else 'ahead'} by {abs(own - last):.3f} s"
    if word:
        own = cycle if last is None else last + cycle
        offset = own - now
    memory = renewed(memory, time=own, clock_offset=offset, clock_at=float(now), clock_stood=stood)
    return memory, word


def _all_finite(*values: float) -> bool:
    try:
        return all(isfinite(value) for value in values)
    except (TypeError, ValueError, OverflowError):
        return False
