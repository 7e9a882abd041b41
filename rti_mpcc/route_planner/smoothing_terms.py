"""What smoothing keeps to, and what it knows of a way: limits, weights, and the terms of (R2) linearised."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geometry.arrays import Array
from rti_mpcc.route_planner.stretches import Stretches


@dataclass(frozen=True, slots=True, kw_only=True)
class SmoothingTerms:
    """What smoothing keeps to.

    Attributes:
        curvature: at most [1/m]; slope: change of the steering, at most [rad/m]; wheelbase: [m].
        margin: of the body, wanted [m]; spacing: of knots [m]; piece: length of an arc [m].
        look: distance of the poses whose surroundings are looked at [m].
        slopes, jump, length, lack, beside: weights w_k, w_c, w_S, w_m, w_b of (R2); damping: on all changes;
            goal: on slopes beyond the limit, and where steps are judged on the error at the goal; trust:
            largest change in one iteration, of a curvature as a share of the largest one, of a length in its
            radius.
    """

    curvature: float
    slope: float
    wheelbase: float
    margin: float
    spacing: float
    piece: float
    look: float
    slopes: float = 0.05
    jump: float = 0.05
    length: float = 0.02
    lack: float = 10.0
    beside: float = 1.0
    damping: float = 0.05
    goal: float = 10.0
    trust: float = 0.25


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Slopes:
    """The slopes dkappa/ds between knots, in the units of the QP.

    Attributes:
        changes: (i, k) rows of each, weighted by its stretch.
        rises: (2 i, k + m) rows of its limits, both ways; limits: (2 i,) what is left of them.
    """

    changes: Array
    rises: Array
    limits: Array

    @classmethod
    def of(cls, now: Stretches, terms: SmoothingTerms) -> Slopes:
        """Those of stretches as they are now."""
        radius, knots = 1.0 / terms.curvature, len(now.knots)
        counts = np.diff(now.first) - 1
        stretch = np.repeat(np.arange(len(counts)), counts)
        first = np.delete(np.arange(knots), now.first[1:] - 1)
        step, place = (now.length / counts)[stretch], np.arange(len(first))
        rise = np.zeros((len(first), now.variables))
        rise[place, first], rise[place, first + 1] = -1.0, 1.0
        middle = 0.5 * (now.knots[first] + now.knots[first + 1])
        # Change of kappa in units per metre.
        most = terms.slope * (1.0 + (terms.wheelbase * middle) ** 2) / terms.wheelbase * radius
        present = (now.knots[first + 1] - now.knots[first]) * radius
        longer = np.zeros_like(rise)
        longer[place, knots + stretch] = most * radius / counts[stretch]
        return cls(
            changes=rise[:, :knots] / np.sqrt(step / radius)[:, None],
            rises=np.vstack((rise - longer, -rise - longer)),
            limits=np.concatenate((most * step - present, most * step + present)),
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Linearised:
    """What stretches lead to, and how that changes with their variables.

    Attributes:
        error: (3,) at the goal; goal: (3, many) how the last pose changes.
        lacking: (n,) what is lacking of the margin [m]; normals: (n, many) how variables make up for it.
        beside: (k,) how far poses are beside the line [m]; across: (k, many) how that changes.
        slopes: see there.
    """

    error: Array
    goal: Array
    lacking: Array
    normals: Array
    beside: Array
    across: Array
    slopes: Slopes
