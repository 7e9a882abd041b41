"""What comes in: detected goals, and measured states that are doubted."""

from __future__ import annotations

from estimation import GoalFilterConfig
from geometry.settings import NonNegative, Positive, Settings


class GoalTracking(Settings):
    """How the controller drives to a goal that it knows from detections.

    Attributes:
        filter: of the detections, see `GoalFilterConfig`.
        standoff: distance along the path to a goal that is not certain enough, where the vehicle stops [m].
        required: the goal must have been detected; at a planned goal that was not, the vehicle waits, and is
            not docked. Also loads the filter at the start rather than with the first detection.
    """

    filter: GoalFilterConfig = GoalFilterConfig()
    standoff: NonNegative = 1.0
    required: bool = False


class Plausibility(Settings):
    """How far a measurement may be from what the commands have made of the vehicle before it is doubted.

    Attributes:
        position, heading, speed, steering: at most so far [m], [rad], [m/s], [rad]; what model errors explain
            in the time between two cycles comes on top.
        blind: so long the last plan is driven on by reckoning before the vehicle brakes [s].
    """

    position: Positive = 0.3
    heading: Positive = 0.3
    speed: Positive = 1.0
    steering: Positive = 0.3
    blind: NonNegative = 0.3
