"""What comes in: goals, measured states that are doubted, obstacles, and the user's clock."""

from __future__ import annotations

from math import pi
from typing import Annotated

from pydantic import Field

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
    """Beyond what a measurement is doubted, and when it is trusted again.

    Attributes:
        position, heading, speed, steering: farthest from the state reckoned by the commands [m], [rad],
            [m/s], [rad]; what model errors explain in the time between two cycles comes on top.
        frozen_distance, frozen_speed: a measurement that stays the same to the last bit is an old one once
            the vehicle must have moved so far [m], or be so much faster or slower [m/s].
        steering_gap: so far may the steering move otherwise than commanded [rad] within `steering_time` [s].
        blind: so long the last plan is driven on by reckoning before the vehicle brakes [s].
        confirmation: so long a standing vehicle has to be measured in the same place to be there [s].
        frozen_tries: so often a frozen measurement of a standing vehicle is trusted once more, each time
            after twice the time: what the vehicle does then it may do blindly.
        rest_speed: a vehicle measured slower than this [m/s] stands, as far as a doubted measurement can say.
        model_mismatch: share of what a vehicle can do in the meantime by which its model may be wrong.
        longest_gap: after so long without a cycle [s] a measurement is taken as it is: too much may have
            happened.
        farthest: coordinates beyond this [m] are no places on earth, whoever tells them;
            largest_heading: headings beyond this [rad] have lost their precision.
        largest_steering: no steering angle is beyond this [rad].
        speed_share: no speed is beyond so many times its limit.
        off_path: a vehicle farther than this from its path [m] is taken to be on another one.
        progress_step: how far the progress may move from one cycle to the next [m].
    """

    position: Positive = 0.3
    heading: Positive = 0.3
    speed: Positive = 1.0
    steering: Positive = 0.3
    frozen_distance: Positive = 0.2
    frozen_speed: Positive = 0.3
    steering_gap: Positive = 0.2
    steering_time: Positive = 1.0
    blind: NonNegative = 0.3
    confirmation: NonNegative = 3.0
    frozen_tries: Annotated[int, Field(ge=0, le=1000)] = 3
    rest_speed: NonNegative = 0.05
    model_mismatch: NonNegative = 0.3
    longest_gap: Positive = 1.0
    farthest: Positive = 1e10
    largest_heading: Positive = 1e4
    largest_steering: Positive = 1.5
    speed_share: Positive = 3.0
    off_path: Positive = 100.0
    progress_step: Positive = 2.0


class GoalLimits(Settings):
    """What can be a goal, when its check is still good, and what looks like degrees.

    Attributes:
        reach: farthest goal from the path's last part [m]: beyond it a goal is taken for a mistake;
            turn: the same for its heading, from the path's beside it [rad].
        unmoved: a goal at which no point of the body has moved farther than this [m] needs no other check;
            nearly_unmoved: the same where there was more room than that [m]; still_refused: the same for one
            that is farther out of reach than that [m].
        in_degrees: so near the path's heading [rad] one that is refused is, read in degrees, where it was
            meant in degrees.
        odd, surely_in_degrees: one that is not refused is suspected of it if it is farther than `odd` from
            the path's heading [rad], and within the other in degrees [rad].
    """

    reach: Positive = 20.0
    turn: Annotated[float, Field(gt=0.0, le=pi)] = 0.5 * pi
    unmoved: NonNegative = 0.01
    nearly_unmoved: NonNegative = 0.03
    still_refused: NonNegative = 0.1
    in_degrees: NonNegative = pi / 6.0
    odd: NonNegative = 0.2
    surely_in_degrees: NonNegative = 0.1


class ObstacleTracking(Settings):
    """Which obstacle of one cycle is taken to be which of the last one; when it moves is in `Caution`.

    Attributes:
        fastest: what seems to move faster than this is another obstacle [m/s].
        jump: so far may a middle be told elsewhere, by noise, besides [m].
        forgotten: an obstacle that has not been told for so long [s] is where it was, and stands.
    """

    fastest: Positive = 10.0
    jump: NonNegative = 0.2
    forgotten: Positive = 1.0


class UserClock(Settings):
    """When the clock that the user shows is not believed.

    Attributes:
        stood_cycles: one that has not moved for so many cycles stands still.
        leap: one that leaps ahead by more than this [s] was set anew.
    """

    stood_cycles: Annotated[int, Field(ge=1, le=1_000_000)] = 3
    leap: Positive = 3600.0
