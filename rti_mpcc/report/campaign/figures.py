"""What a whole campaign comes to, as values for JSON and tables."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binomtest

from rti_mpcc.report.campaign.columns import SEVERITY, Campaign
from rti_mpcc.types import Array

INTERVAL = "Clopper-Pearson"
"""Exact: whatever the true rate, at least 95 of 100 such intervals hold it."""
CONFIDENCE = 0.95
ERRORS = ("longitudinal_m", "lateral_m", "heading_rad")
ENERGIES = ("acceleration", "steering_rate", "lateral_acceleration")


def success_interval(docked: int, cases: int) -> tuple[float, float]:
    """Between which the true rate lies, by Clopper and Pearson."""
    interval = binomtest(docked, cases).proportion_ci(confidence_level=CONFIDENCE, method="exact")
    return float(interval.low), float(interval.high)


def overall(campaign: Campaign) -> dict[str, Any]:
    """All figures of a campaign that are not of single cases. None where there is nothing to take one of."""
    docked = int(campaign.docked.sum())
    counts = np.bincount(campaign.outcome, minlength=len(SEVERITY))
    known = int(np.count_nonzero(np.isfinite(campaign["min_clearance_m"])))
    return {
        "cases": len(campaign),
        "cases_asked": campaign.asked.count,
        "finished": len(campaign) >= campaign.asked.count,
        "torn_line": campaign.torn,
        "repeated_lines": campaign.repeated,
        "outcomes": {
            outcome.value: int(counts[place]) for place, outcome in reversed(list(enumerate(SEVERITY)))
        },
        "success_rate": docked / len(campaign),
        "success_interval": list(success_interval(docked, len(campaign))),
        "success_interval_method": f"{INTERVAL}, {CONFIDENCE:.0%}",
        "collisions": int(campaign.crossed.sum()),
        "collisions_unknown": len(campaign) - known,
        **_times(campaign),
        **_clearance(campaign["min_clearance_m"]),
        "final_error": _final_errors(campaign),
        "energy_to_dock": {
            name: spread(campaign[f"energy_to_dock.{name}"][campaign.docked], (50, 95)) for name in ENERGIES
        },
        **_solver(campaign),
        "direction_changes_beyond_cusps": _turns(campaign),
        "cycles_by_status": dict(campaign.statuses),
    }


def yardstick_time(campaign: Campaign) -> Array:
    """(n,) time [s] for the way D [m] at the comfort acceleration a [m/s²], without a limit on speed.

    Full acceleration over one half of each part, full braking over the other, straight, with the c cusps as
    if they cut the way into equal parts:

        T = 2 sqrt((c + 1) D / a),   D = length of the route + goal behind its end                        (1)

    It makes long and short ways comparable; it is no bound: cusps cut in unequal parts, corners are cut.
    """
    way = np.maximum(campaign["length_m"] + campaign["goal_behind_m"], 0.0)
    time: Array = 2.0 * np.sqrt((campaign["cusps"] + 1.0) * way / campaign["comfort.acceleration"])
    return time


def time_over_yardstick(campaign: Campaign) -> Array:
    """(n,) time to dock as a multiple of (1); NaN where a case did not dock."""
    with np.errstate(divide="ignore", invalid="ignore"):
        times: Array = np.where(campaign.docked, campaign["time_to_dock_s"], np.nan) / yardstick_time(
            campaign
        )
    return times


def spread(values: Array, percents: Sequence[int], *, largest: bool = True) -> dict[str, float | None]:
    """Percentiles as p50, ..., and the largest as max, of what is finite; None where nothing is."""
    finite = values[np.isfinite(values)]
    found = {f"p{percent}": _percentile(finite, percent) for percent in percents}
    return {**found, **({"max": float(finite.max()) if finite.size else None} if largest else {})}


def _percentile(finite: Array, percent: float) -> float | None:
    return float(np.percentile(finite, percent)) if finite.size else None


def _times(campaign: Campaign) -> dict[str, float | None]:
    """Of the cases that docked."""
    found: dict[str, float | None] = {}
    for name, values in (
        ("time_to_tolerance", campaign["time_to_tolerance_s"]),
        ("time_to_dock", campaign["time_to_dock_s"]),
        ("time_over_yardstick", time_over_yardstick(campaign)),
    ):
        told = spread(values[campaign.docked], (50, 95))
        found |= {f"{name}_{key}": value for key, value in told.items()}
    return found


def _clearance(clearance: Array) -> dict[str, float | None]:
    finite = clearance[np.isfinite(clearance)]
    return {
        "min_clearance_m": float(finite.min()) if finite.size else None,
        "clearance_p5_m": _percentile(finite, 5),
        "clearance_p50_m": _percentile(finite, 50),
    }


def _final_errors(campaign: Campaign) -> dict[str, dict[str, float | None]]:
    """Of the cases that docked, without sign."""
    return {
        name: spread(np.abs(campaign[f"final_error.{name}"][campaign.docked]), (50, 95)) for name in ERRORS
    }


def _solver(campaign: Campaign) -> dict[str, int]:
    return {
        "solver_failures": _total(campaign["solver.failures"]),
        "solver_failure_cases": _some(campaign["solver.failures"]),
        "failures_driven": _total(campaign["failures_driven"]),
        "fallback_cycles": _total(campaign["fallback_cycles"]),
        "fallback_cases": _some(campaign["fallback_cycles"]),
    }


def _turns(campaign: Campaign) -> dict[str, int]:
    beyond = turns_beyond(campaign)
    return {"total": _total(beyond), "cases": _some(beyond), "most": int(np.nanmax([*beyond, 0.0]))}


def turns_beyond(campaign: Campaign) -> Array:
    """(n,) changes of direction that the route does not ask for; NaN where a case was not driven."""
    beyond: Array = np.maximum(campaign["direction_changes"] - campaign["cusps"], 0.0)
    return beyond


def _total(values: Array) -> int:
    return int(np.nansum(values))


def _some(values: Array) -> int:
    found: NDArray[np.bool_] = values > 0.0
    return int(np.count_nonzero(found))
