"""Situations to decide in."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from geometry import Pose2
from rti_mpcc.ocp.targets import Target, TargetKind
from rti_mpcc.planning.memory import PlanningContext
from rti_mpcc.planning.pace import Pace


def target_at(x: float) -> Target:
    """A goal pose `x` [m] along a straight path of 20 m."""
    return Target(pose=Pose2(x, 0.0, 0.0), theta=x, theta_end=20.0, kind=TargetKind.POSE)


class Situations:
    """Makes situations on a straight path; default: cruising forwards at 1 m/s, 10 m before the goal."""

    def __call__(self, **changes: Any) -> PlanningContext:
        usual: dict[str, Any] = {
            "now": 10.0,
            "begin": 10.2,
            "state": np.array([10.0, 0.0, 0.0, 1.0, 0.0, 10.0]),
            "doubt": "",
            "measured_speed": 1.0,
            "target": target_at(20.0),
            "direction": 1,
            "last_part": True,
            "free": True,
            "way": 10.0,
            "speed": 1.0,
            "pace": Pace(theta=np.array([0.0, 20.0]), speed=np.array([10.0, 10.0])),
            "error": Pose2(-10.0, 0.0, 0.0),
            "stop_error": Pose2(-8.75, 0.0, 0.0),
            "tolerance": (0.05, 0.05, 0.035),
        }
        return PlanningContext(**{**usual, **changes})

    def standing(self, x: float = 20.0, **changes: Any) -> PlanningContext:
        """At rest `x` [m] along."""
        error = Pose2(x - 20.0, 0.0, 0.0)
        usual: dict[str, Any] = {
            "state": np.array([x, 0.0, 0.0, 0.0, 0.0, x]),
            "measured_speed": 0.0,
            "way": 20.0 - x,
            "speed": 0.0,
            "error": error,
            "stop_error": error,
        }
        return self(**{**usual, **changes})


@pytest.fixture
def situations() -> Situations:
    return Situations()
