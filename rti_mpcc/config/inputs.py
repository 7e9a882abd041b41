"""What comes in: goals from detections, and measured states that are doubted."""

from __future__ import annotations

from estimation import GoalFilterConfig
from geometry.settings import NonNegative, Positive, Settings


class GoalTracking(Settings):
    """How the controller makes for a goal that it knows from detections.

    Attributes:
        filter: of the detections, see `GoalFilterConfig`.
        speed, turn_rate: at most so fast the pose made for follows the estimate [m/s], [rad/s].
        certainty: a goal that is LOST may still be docked at while so many standard deviations of its
            estimate fit the goal tolerance.
        standoff: way left to a goal that is less certain, where the vehicle stops [m].
        required: the goal must have been detected; at a planned goal that was not, the vehicle waits, and is
            not docked. Also loads the filter at the start rather than with the first detection.
    """

    filter: GoalFilterConfig = GoalFilterConfig()
    speed: Positive = 3.0
    turn_rate: Positive = 1.5
    certainty: Positive = 2.0
    standoff: NonNegative = 1.0
    required: bool = False


class Plausibility(Settings):
    """Beyond what a measurement is doubted, and when it is trusted again.

    Attributes:
        position, heading, speed, steering: farthest from the state reckoned by the commands [m], [rad],
            [m/s], [rad]; what model errors explain in the time between two cycles comes on top.
        frozen_way, frozen_speed: a measurement that stays the same to the last bit is an old one once the
            vehicle must have moved so far [m], or be so much faster or slower [m/s].
        steering_gap: so far may the steering move otherwise than commanded [rad] within `steering_time` [s].
        blind: so long the last plan is driven on by reckoning before the vehicle brakes [s].
        confirmation: so long a standing vehicle has to be measured in the same place to be there [s].
    """

    position: Positive = 0.3
    heading: Positive = 0.3
    speed: Positive = 1.0
    steering: Positive = 0.3
    frozen_way: Positive = 0.2
    frozen_speed: Positive = 0.3
    steering_gap: Positive = 0.2
    steering_time: Positive = 1.0
    blind: NonNegative = 0.3
    confirmation: NonNegative = 3.0
