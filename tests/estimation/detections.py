"""What the tests of the goal filter share: a goal near ±pi, a detector with faults, and states to compare."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import hypot

import numpy as np
from numpy.typing import NDArray

from estimation import GoalEstimate, GoalFilterConfig, GoalMeasurement, GoalPoseFilter, Judgement, Outcome
from geometry import Pose2, wrap

Array = NDArray[np.float64]

GOAL = Pose2(4.0, -2.0, 3.12)
"""Its heading is 0.02 rad before pi, less than a detection is off: both branches are seen."""
STD = np.array([0.05, 0.05, 0.035])
"""Of one detection at the default reference range [m, m, rad]."""


def seen(goal: Pose2, stamp: float, random: np.random.Generator | None = None) -> GoalMeasurement:
    """A detection in the world, heading in (-pi, pi]; exact without a generator."""
    off = random.normal(0.0, STD) if random else np.zeros(3)
    return GoalMeasurement(
        stamp=stamp, x=goal.x + off[0], y=goal.y + off[1], phi=float(wrap(goal.phi + off[2]))
    )


def shifted(goal: Pose2, *, aside: float = 0.0, along: float = 0.0, turn: float = 0.0) -> Pose2:
    return Pose2(goal.x + along, goal.y + aside, goal.phi + turn)


def stamps(rate: float, begin: float, end: float) -> list[float]:
    """Times of a detector at `rate` [1/s] from `begin` until before `end` [s]."""
    return [begin + k / rate for k in range(round((end - begin) * rate))]


def kept(times: Sequence[float], random: np.random.Generator, dropouts: float) -> list[float]:
    """Those of the times at which the detector did not drop out."""
    return [time for time in times if random.random() >= dropouts]


def told(
    goal_filter: GoalPoseFilter, measurements: Sequence[GoalMeasurement]
) -> Iterator[tuple[Judgement, GoalEstimate]]:
    """Each detection at once, the clock told before: judgement, and the estimate at its stamp."""
    for measurement in measurements:
        goal_filter.predict(measurement.stamp)
        judgement = goal_filter.update(measurement)
        yield judgement, goal_filter.estimate(measurement.stamp)


def tracking(
    config: GoalFilterConfig | None = None, *, until: float = 2.0, goal: Pose2 = GOAL
) -> GoalPoseFilter:
    """A filter that has seen the goal exactly at 10 Hz from 0 s, the last time at `until` [s]."""
    goal_filter = GoalPoseFilter(config)
    for _ in told(goal_filter, [seen(goal, 0.1 * k) for k in range(round(10.0 * until))]):
        pass
    goal_filter.predict(until)
    assert goal_filter.update(seen(goal, until)).outcome is Outcome.ACCEPTED
    return goal_filter


def pose(estimate: GoalEstimate) -> Pose2:
    assert estimate.pose is not None
    return estimate.pose


def covariance(estimate: GoalEstimate) -> Array:
    assert estimate.covariance is not None
    return estimate.covariance


def age(estimate: GoalEstimate) -> float:
    assert estimate.age is not None
    return estimate.age


def off_by(estimate: GoalEstimate, goal: Pose2) -> tuple[float, float]:
    """Distance [m] and heading [rad] from estimate to goal."""
    at = pose(estimate)
    return hypot(at.x - goal.x, at.y - goal.y), abs(float(wrap(at.phi - goal.phi)))


def numbers(estimate: GoalEstimate) -> Array:
    """All that an estimate says, in one array; what it does not say is 0, so compare the statuses too."""
    at = estimate.pose
    parts = [
        np.zeros(3) if at is None else np.array([at.x, at.y, at.phi]),
        np.zeros(9) if estimate.covariance is None else estimate.covariance.ravel(),
        np.zeros(3) if estimate.velocity is None else estimate.velocity,
        np.zeros(3) if estimate.innovation is None else estimate.innovation,
        np.array([estimate.age or 0.0, estimate.nis or 0.0]),
    ]
    return np.concatenate(parts)
