"""What is kept from what is in the way."""

from __future__ import annotations

from geometry.settings import NonNegative, Positive, Settings


class Caution(Settings):
    """What is kept from boundaries and obstacles, and when the vehicle stops for them.

    Attributes:
        hard_minimum: no plan is driven whose body comes nearer to an obstacle than this [m], or to a boundary
            than this less `contact_tolerance`. It is what lags, model errors and noise may take; the plans
            themselves keep `Footprint.margin`.
        contact_tolerance: a body that is over a boundary by no more than this only seems to be [m]: that is
            noise of a centimetre in place and of some milliradians in heading, at the corners. An obstacle
            that is overlapped by no more than this is stopped for in comfort, by more as hard as can be.
        stop_share: by this share more way is looked at for a stop than braking in comfort takes.
        clear_time: a vehicle that stops drives on after its way was clear for so long [s];
            clear_distance: and clear for so much more way than it needs to stop [m].
        moved: an obstacle whose middle has moved by more than this within `observation` moves [m];
            observation: its speed is what it did in so long [s]. It stands again after `clear_time`.
    """

    hard_minimum: NonNegative = 0.05
    contact_tolerance: NonNegative = 0.02
    stop_share: NonNegative = 0.25
    clear_time: NonNegative = 1.0
    clear_distance: NonNegative = 0.5
    moved: Positive = 0.05
    observation: Positive = 0.3
