"""What is kept from what is in the way."""

from __future__ import annotations

from typing import Annotated, ClassVar

from pydantic import Field

from geometry.settings import NonNegative, Positive, Settings, Short

Shares = Annotated[tuple[Annotated[float, Field(ge=-1.0, le=1.0)], ...], Field(min_length=1)]


class Caution(Settings):
    """When the vehicle stops for boundaries and obstacles; how near it comes to them is in `Clearance`.

    Attributes:
        contact_tolerance: a body that is over a boundary by no more than this only seems to be [m]: that is
            noise of a centimetre in place and of some milliradians in heading, at the corners. An obstacle
            that is overlapped by no more than this is stopped for in comfort, by more as hard as can be.
        stop_share: by this share more way is looked at for a stop than braking in comfort takes.
        clear_time: a vehicle that stops drives on after its way was clear for so long [s];
            clear_distance: and clear for so much more way than it needs to stop [m].
        moved: an obstacle whose middle has moved by more than this within `observation` moves [m];
            observation: its speed is what it did in so long [s]. It stands again after `clear_time`. What
            obstacles cover has changed for a stalled vehicle where it is elsewhere by more than `moved`.
        check_spacing: way between two bodies of a motion that are checked [m]; also left on top of the margin
            before a stop.
        swing_room: share of the body's width that is left besides, to swing out past what fills the way.
        overlap_growth: a plan that begins where the body seems to touch something may go so much deeper [m]:
            rounding.
        authority_reserve: share of a limit that must be left to drive with, beyond what it takes to hold the
            vehicle on a slope, or straight: with a fifth of the acceleration it still docks, with a tenth it
            no longer does.
    """

    former: ClassVar = {"hard_minimum": "clearance.least"}

    contact_tolerance: NonNegative = 0.02
    stop_share: NonNegative = 0.25
    clear_time: NonNegative = 1.0
    clear_distance: NonNegative = 0.5
    moved: Positive = 0.05
    observation: Positive = 0.3
    check_spacing: Annotated[float, Field(ge=0.01, le=10.0)] = 0.2
    swing_room: NonNegative = 0.33
    overlap_growth: NonNegative = 0.01
    authority_reserve: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.15


class Fallback(Settings):
    """What is driven where there is no plan of the cycle's own, and how it is braked.

    Attributes:
        plan_life: how long the last plan that was driven may be driven on [s].
        plan_offset: a plan that begins farther than this from the vehicle is not driven on [m], [rad].
        braking_offset: a plan whose way passes farther than this from the vehicle is not braked along [m],
            [rad].
        firmness: so many times the comfort acceleration is braked before something that blocks the way, or
            without a plan: firm, not an emergency.
        settling_factor: a stop at the target's length takes no more than so many times the comfort
            acceleration, some millimetres more of way are better than that; settling_least: and no less than
            this share of it.
        settling_time: time constant with which the last of the speed is taken out [s];
            holding_time: the same while standing [s], so that noise hardly shows.
        stop_distance: distance to a contact at which a blocked vehicle means to stand [m].
        steering_speed: below this speed the steering is not turned while braking [m/s].
        least_deceleration: of a motion that is looked at [m/s²].
    """

    plan_life: NonNegative = 1.0
    plan_offset: tuple[Positive, Positive] = (0.5, 0.2)
    braking_offset: tuple[Positive, Positive] = (0.2, 0.1)
    firmness: Annotated[float, Field(ge=1.0, le=1e3)] = 4.0
    settling_factor: Annotated[float, Field(ge=1.0, le=1e3)] = 1.05
    settling_least: Annotated[float, Field(gt=0.0, le=1.0)] = 0.5
    settling_time: Positive = 0.15
    holding_time: Positive = 0.5
    stop_distance: NonNegative = 0.3
    steering_speed: NonNegative = 0.1
    least_deceleration: Positive = 1e-3


class Escape(Settings):
    """How a way out of an overlap is sought and crept, where `ControllerConfig.escape_speed` allows it.

    Attributes:
        spacing: way between two bodies that are checked [m].
        reach: longest way out [m].
        steering_shares: steering angles that are tried, as shares of the largest.
        steering_tolerance: wheels this near to where they are to be are there [rad].
        rise_time: time constant with which the speed is set [s].
    """

    spacing: Annotated[float, Field(ge=0.001, le=1.0)] = 0.04
    reach: Annotated[Short, Field(gt=0.0)] = 2.0
    steering_shares: Shares = (0.0, 0.25, -0.25, 0.5, -0.5, 1.0, -1.0)
    steering_tolerance: Positive = 0.02
    rise_time: Positive = 0.3
