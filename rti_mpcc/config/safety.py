"""What is kept from what is in the way."""

from __future__ import annotations

from geometry.settings import NonNegative, Settings

CONTACT_TOLERANCE = 0.02
"""A body that is over a boundary by no more than this only seems to be [m]: measurements tremble by a
centimetre in place and some milliradians in heading. An obstacle that is overlapped by no more than this is
braked for in comfort, by more as hard as can be."""


class Caution(Settings):
    """What is kept from boundaries and obstacles.

    Attributes:
        hard_minimum: no plan is driven whose body comes nearer to an obstacle than this [m], or to a boundary
            than this less `CONTACT_TOLERANCE`. It is what lags, model errors and noise may take; the plans
            themselves keep `Footprint.margin`.
    """

    hard_minimum: NonNegative = 0.05

    @property
    def planned_minimum(self) -> float:
        """What plans keep where there is no room for the margin [m]."""
        return self.hard_minimum + CONTACT_TOLERANCE
