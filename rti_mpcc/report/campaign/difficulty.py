"""Success and time against what makes a case hard: its course or scene, and what disturbs it."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from rti_mpcc.report.campaign.figures import known, spread, success_interval

BINS = 6
"""Most of them."""
QUARTILES = (25, 50, 75)
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

    def of(self, rows: pd.DataFrame) -> pd.Series[float]:
        """Its values."""
        return rows[self.column].abs() if self.size else rows[self.column]


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
SCENE = (
    Scale("apart_m", "start to goal [m]", 1),
    Scale("turned_rad", "start to goal, turned [rad]", 2),
    Scale("room_at_goal_m", "room around the body at the goal [m]", 2),
    Scale("room_at_start_m", "room around the body at the start [m]", 2),
    Scale("radius_m", "sharpest bend, radius [m]", 2),
    Scale("wheelbase_m", "wheelbase [m]", 2),
    Scale("obstacles", "obstacles", 0),
    Scale("bounded", "with a boundary", 0),
    Scale("comfort_acceleration", "comfort acceleration [m/s²]", 2),
    Scale("length_m", "length of the first way [m]", 1),
    Scale("cusps", "cusps of the first way", 0),
    Scale("planning.replans", "further ways", 0),
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


def varying(rows: pd.DataFrame, scales: Sequence[Scale]) -> list[Scale]:
    """Those that are not the same in all cases, and not the same as one before."""
    values = pd.DataFrame({scale.column: scale.of(rows) for scale in scales}).T.drop_duplicates().T
    return [scale for scale in scales if scale.column in values and values[scale.column].nunique() > 1]


def bins(rows: pd.DataFrame, scale: Scale) -> pd.DataFrame:
    """One a value where there are few, else as many cases in each, but where values are equal.

    Columns: least, largest and median value (low, high, middle); how many are in it, docked, collided (cases,
    docked, collisions); the share that docked and its 95 % interval (rate, rate_low, rate_high); time to dock
    of those that docked [s] (p25, p50, p75), and its median over the yardstick (over_yardstick); NaN where
    none did. Rows without a value are in no bin.
    """
    rows = rows.assign(value=scale.of(rows)).dropna(subset="value")
    groups = rows.groupby(_places(rows["value"]), observed=True)
    table = groups.agg(
        low=("value", "min"),
        high=("value", "max"),
        middle=("value", "median"),
        cases=("value", "size"),
        docked=("docked", "sum"),
        collisions=("crossed", "sum"),
        over_yardstick=("over_yardstick", "median"),
    )
    table["rate"] = table["docked"] / table["cases"]
    intervals = [success_interval(*counts) for counts in zip(table["docked"], table["cases"], strict=True)]
    table["rate_low"], table["rate_high"] = zip(*intervals, strict=True)
    for percent in QUARTILES:
        table[f"p{percent}"] = groups["time_to_dock_s"].quantile(percent / 100.0)
    return table


def kinds(rows: pd.DataFrame) -> list[dict[str, Any]]:
    """What became of the scenes of each kind; times and planning in seconds, ways in metres."""
    return [
        {
            "kind": kind,
            "cases": len(some),
            "docked": int(some["docked"].sum()),
            "collisions": int(some["crossed"].sum()),
            "time_to_dock_s": spread(some["time_to_dock_s"], 50, 95),
            "over_yardstick": spread(some["over_yardstick"], 50, 95),
            "length_m": spread(some["length_m"], 50, 95),
            "cusps": spread(some["cusps"], 50, 95),
            "replans": int(some["planning.replans"].sum()),
            "planning_s": spread(some["timed.planning_s"], 50, 95),
        }
        for kind, some in rows[rows["kind"] != ""].groupby("kind")
    ]


def _places(values: pd.Series[float]) -> pd.Series[Any]:
    """What is equal in the rows of a bin, and in order of the values."""
    if values.nunique() <= BINS:
        return values
    count = max(1, min(BINS, len(values) // CASES_IN_BIN))
    edges = values.quantile(np.linspace(0.0, 1.0, count + 1)[1:-1]).unique()
    return pd.cut(values, [-inf, *edges, inf], right=False)


def told(table: pd.DataFrame) -> list[dict[str, Any]]:
    """Bins for JSON."""
    return [
        {
            **{name: known(one[name]) for name in ("low", "high", "middle")},
            **{name: int(one[name]) for name in ("cases", "docked", "collisions")},
            "rate": one["rate"],
            "interval": [one["rate_low"], one["rate_high"]],
            "time": {name: known(one[name]) for name in ("p25", "p50", "p75")},
            "over_yardstick": known(one["over_yardstick"]),
        }
        for one in table.to_dict("records")
    ]
