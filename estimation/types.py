"""What comes out of the goal filter."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np

from geometry import Pose2
from geometry.arrays import Array as Array
from geometry.errors import InputError
from geometry.validation import validated


class GoalStatus(Enum):
    """How well the goal is known."""

    SEARCHING = "searching"
    """Not seen yet."""
    TRACKING = "tracking"
    """Seen a moment ago."""
    COASTING = "coasting"
    """Not seen for a while; the estimate is carried on."""
    LOST = "lost"
    """Not seen for so long that the estimate is only as good as its covariance says."""


class Outcome(Enum):
    """What became of a detection."""

    ACCEPTED = "accepted"
    """Passed the gate and moved the estimate."""
    ACQUIRED = "acquired"
    """Agreed with others before it: the estimate begins afresh from these."""
    REJECTED = "rejected"
    """Did not pass the gate, or waits for others that agree with it."""
    REFUSED = "refused"
    """Not usable: not finite, no covariance, too late, from the future, or told already."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Judgement:
    """What became of one detection, and why.

    Attributes:
        stamp: of the detection [s].
        outcome: see there; reason: one line for humans, "" where accepted.
        pose, covariance: of the goal in the world by this detection alone, (3, 3) of x, y [m], heading [rad];
            None where refused.
        innovation: (3,) detection minus prediction x, y [m], heading [rad], world axes; None without one.
        nis: normalised innovation squared against the gate's chi-square law of 3; None without one.
    """

    stamp: float
    outcome: Outcome
    reason: str = ""
    pose: Pose2 | None = None
    covariance: Array | None = None
    innovation: Array | None = None
    nis: float | None = None

    @property
    def accepted(self) -> bool:
        """Whether the estimate took it in."""
        return self.outcome in (Outcome.ACCEPTED, Outcome.ACQUIRED)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GoalEstimate:
    """What is known of the goal at one time. Arrays are read-only.

    Attributes:
        status: see there.
        pose: in the world, heading on one branch while tracked; None while SEARCHING.
        covariance: (3, 3) of x, y, heading, world axes [m², m rad, rad²]; None while SEARCHING.
        velocity: (3,) of a moving goal [m/s, m/s, rad/s]; None if it is not estimated.
        moves: the goal is seen to move.
        elsewhere: where the detections of the last moment agree that the goal is, if not at `pose`; or None.
        age: time since the last accepted detection's stamp [s]; None while SEARCHING.
        innovation, nis: of the last detection that was set against a prediction, see `Judgement`.
    """

    status: GoalStatus
    pose: Pose2 | None = None
    covariance: Array | None = None
    velocity: Array | None = None
    moves: bool = False
    elsewhere: Pose2 | None = None
    age: float | None = None
    innovation: Array | None = None
    nis: float | None = None


@validated()
def stds_in(goals: Array, covariances: Array) -> Array:
    """(n, 3) standard deviations along, across [m] and of the heading [rad], in the frames of goals (n, 3).

    Args:
        covariances: (n, 3, 3) of x, y, heading in world axes; what is not finite gives NaN.
    """
    if goals.ndim != 2 or covariances.shape != (len(goals), 3, 3) or goals.shape[1] != 3:
        shapes = goals.shape, covariances.shape
        raise InputError(f"goals, covariances have the shapes {shapes}, they must be (n, 3), (n, 3, 3).")
    turn = np.zeros((len(goals), 3, 3))
    with np.errstate(invalid="ignore"):
        turn[:, 0, 0] = turn[:, 1, 1] = np.cos(goals[:, 2])
        turn[:, 0, 1] = np.sin(goals[:, 2])
        turn[:, 1, 0] = -turn[:, 0, 1]
        turn[:, 2, 2] = 1.0
        variances = np.einsum("nij,njk,nik->ni", turn, covariances, turn)
        return np.asarray(np.sqrt(np.maximum(variances, 0.0)))
