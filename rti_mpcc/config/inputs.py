"""What comes in: detected goals, and measured states that are doubted."""

from __future__ import annotations

from estimation import GoalFilterConfig
from geometry.settings import NonNegative, Positive, Settings


class GoalTracking(Settings):
    """How the controller makes for a goal that it knows from detections.

    Attributes:
        filter: of the detections, see `GoalFilterConfig`.
        speed, turn_rate: at most so fast the pose made for follows the estimate [m/s], [rad/s].
        longest_step: after a longer gap between two cycles [s] it moves no farther than in this time.
        certainty: a goal that is LOST may still be docked at while so many standard deviations of its
            estimate fit the goal tolerance.
        standoff: way left to a goal that is less certain, where the vehicle stops [m];
            standoff_tolerance: one that stands so much farther off waits there [m].
        required: the goal must have been detected; at a planned goal that was not, the vehicle waits, and is
            not docked. Also loads the filter at the start rather than with the first detection.
    """

    filter: GoalFilterConfig = GoalFilterConfig()
    speed: Positive = 3.0
    turn_rate: Positive = 1.5
    longest_step: NonNegative = 0.5
    certainty: Positive = 2.0
    standoff: NonNegative = 1.0
    standoff_tolerance: NonNegative = 0.3
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
