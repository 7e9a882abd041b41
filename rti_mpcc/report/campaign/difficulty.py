"""Success and time against what makes a case hard: its course, and what disturbs it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rti_mpcc.report.campaign.columns import Campaign
from rti_mpcc.report.campaign.figures import spread, success_interval
from rti_mpcc.types import Array

BINS = 6
"""Most of them."""
CASES_IN_BIN = 5
"""At least so many, but where a value is one of a few."""


class Scale(NamedTuple):
    """Something that makes cases hard: a column, or its size without the sign.

    Attributes:
        column: its name; label: what it is, with its unit; digits: of its values.
        size: without the sign.
    """

    column: str
    label: str
    digits: int
    size: bool = False

    def of(self, campaign: Campaign) -> Array:
        """(n,) its values."""
        values = campaign[self.column]
        return np.abs(values) if self.size else values


COURSE = (
    Scale("goal_behind_m", "goal behind the end, − inside [m]", 1),
    Scale("goal_beside_m", "goal beside the end [m]", 1, True),
    Scale("goal_turned_rad", "goal turned [rad]", 2, True),
    Scale("curvature", "largest curvature [1/m]", 3),
    Scale("room_m", "least room beside the body [m]", 2),
    Scale("length_m", "length of the route [m]", 0),
    Scale("pieces", "arcs of the route", 0),
    Scale("cusps", "cusps", 0),
    Scale("direction", "last part, −1 reverse, 1 forward", 0),
    Scale("narrowings", "narrowings", 0),
    Scale("obstacles", "obstacles", 0),
)
DISTURBANCES = (
    Scale("position_std_m", "std of a detected position [m]", 3),
    Scale("heading_std_rad", "std of a detected heading [rad]", 3),
    Scale("dropout", "share of lost detections", 2),
    Scale("outlier", "share of wild detections", 3),
    Scale("delay_s", "delay of detections [s]", 2),
    Scale("initial_offset_m", "planned goal, off [m]", 2),
    Scale("initial_turned_rad", "planned goal, turned [rad]", 3),
    Scale("noise_x_m", "std of measured position [m]", 3),
    Scale("noise_y_m", "std of measured y [m]", 3),
    Scale("noise_phi_rad", "std of measured heading [rad]", 4),
    Scale("noise_v_m_s", "std of measured speed [m/s]", 3),
    Scale("noise_delta_rad", "std of measured steering [rad]", 4),
    Scale("wheelbase_error", "error of the wheelbase, relative", 3),
    Scale("steering_offset_rad", "offset of the steering [rad]", 3),
    Scale("acceleration_gain", "gain of the acceleration", 2),
    Scale("dead_time_s", "dead time [s]", 3),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Bin:
    """The cases between two values of a scale.

    Attributes:
        low, high: least and largest value in it.
        middle: median value in it.
        cases, docked, collisions: how many.
        rate, interval: share that docked, and its 95 % interval.
        time: time to dock of those that docked, p25, p50, p75 [s]; None where none did.
        over_yardstick: median of the time to dock over its yardstick.
    """

    low: float
    high: float
    middle: float
    cases: int
    docked: int
    collisions: int
    rate: float
    interval: tuple[float, float]
    time: dict[str, float | None]
    over_yardstick: float | None

    def told(self) -> dict[str, Any]:
        """For JSON."""
        return {name: getattr(self, name) for name in self.__slots__} | {"interval": list(self.interval)}


def varying(campaign: Campaign, scales: Sequence[Scale]) -> list[Scale]:
    """Those that are not the same in all cases, and not the same as one before."""
    found: dict[bytes, Scale] = {}
    for scale in scales:
        values = scale.of(campaign)
        if np.unique(values[np.isfinite(values)]).size > 1:
            found.setdefault(values.tobytes(), scale)
    return list(found.values())


def bins(campaign: Campaign, scale: Scale, over_yardstick: Array) -> list[Bin]:
    """One a value where there are few, else as many cases in each, but where values are equal.

    `over_yardstick`: (n,) as `time_over_yardstick` gives it.
    """
    values = scale.of(campaign)
    return [_bin(campaign, values, rows, over_yardstick) for rows in _parted(values)]


def _parted(values: Array) -> list[NDArray[np.int64]]:
    """Rows of each bin, in order of the values; rows without a value are in none."""
    known = np.flatnonzero(np.isfinite(values))
    distinct, place = np.unique(values[known], return_inverse=True)
    if distinct.size > BINS:
        count = max(1, min(BINS, known.size // CASES_IN_BIN))
        edges = np.unique(np.quantile(values[known], np.linspace(0.0, 1.0, count + 1)[1:-1]))
        place = np.searchsorted(edges, values[known], side="right")
    return [known[place == one] for one in np.unique(place)]


def _bin(campaign: Campaign, values: Array, rows: NDArray[np.int64], over_yardstick: Array) -> Bin:
    docked = rows[campaign.docked[rows]]
    return Bin(
        low=float(values[rows].min()),
        high=float(values[rows].max()),
        middle=float(np.median(values[rows])),
        cases=rows.size,
        docked=docked.size,
        collisions=int(campaign.crossed[rows].sum()),
        rate=docked.size / rows.size,
        interval=success_interval(docked.size, rows.size),
        time=spread(campaign["time_to_dock_s"][docked], (25, 50, 75), largest=False),
        over_yardstick=spread(over_yardstick[docked], (50,), largest=False)["p50"],
    )
