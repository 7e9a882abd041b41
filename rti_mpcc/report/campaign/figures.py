"""What a whole campaign comes to, as values for JSON and tables."""

from __future__ import annotations

from typing import Any

import pandas as pd
from scipy.stats import binomtest

from rti_mpcc.report.campaign.rows import COMFORT, OVER_GAIN, SEVERITY, Campaign
from rti_mpcc.simulation.campaign import CaseOutcome

INTERVAL = "Clopper-Pearson"
"""Exact: whatever the true rate, at least 95 of 100 such intervals hold it."""
CONFIDENCE = 0.95
ERRORS = ("longitudinal_m", "lateral_m", "heading_rad")
TAIL = (50, 95, 99)
"""Percentiles of what is told of the worst cases, too."""
ENERGIES = ("acceleration", "steering_rate", "lateral_acceleration")


def success_interval(docked: int, cases: int) -> tuple[float, float]:
    """Between which the true rate lies, by Clopper and Pearson."""
    interval = binomtest(docked, cases).proportion_ci(confidence_level=CONFIDENCE, method="exact")
    return float(interval.low), float(interval.high)


def overall(campaign: Campaign) -> dict[str, Any]:
    """All figures of a campaign that are not of single cases. None where there is nothing to take one of."""
    rows = campaign.rows
    docked, clearance, turns = rows[rows["docked"]], rows["min_clearance_m"], rows["turns_beyond"]
    outcomes = rows["outcome"].value_counts()
    times = {
        "time_to_tolerance": docked["time_to_tolerance_s"],
        "time_to_dock": docked["time_to_dock_s"],
        "time_over_yardstick": docked["over_yardstick"],
    }
    return {
        "cases": len(rows),
        "cases_asked": campaign.asked.count,
        "finished": len(rows) >= campaign.asked.count,
        "torn_line": campaign.torn,
        "repeated_lines": campaign.repeated,
        "outcomes": {outcome.value: int(outcomes[outcome.value]) for outcome in reversed(SEVERITY)},
        "success_rate": len(docked) / len(rows),
        "success_interval": list(success_interval(len(docked), len(rows))),
        "success_interval_method": f"{INTERVAL}, {CONFIDENCE:.0%}",
        "told_docked": int(outcomes[CaseOutcome.DOCKED.value]) / len(rows),
        "collisions": int(rows["crossed"].sum()),
        "collisions_unknown": int(clearance.isna().sum()),
        **{f"{name}_{key}": one for name, of in times.items() for key, one in spread(of, 50, 95).items()},
        "min_clearance_m": known(clearance.min()),
        "clearance_p5_m": known(clearance.quantile(0.05)),
        "clearance_p50_m": known(clearance.quantile(0.5)),
        "final_error": {name: spread(docked[f"final_error.{name}"].abs(), 50, 95) for name in ERRORS},
        "energy_to_dock": {name: spread(docked[f"energy_to_dock.{name}"], 50, 95) for name in ENERGIES},
        "comfort": {name: spread(rows[f"over_comfort.{name}"], *TAIL) for name in (*COMFORT, OVER_GAIN)},
        "energy_ratio": spread(docked["energy_ratio"], *TAIL),
        "time_ratio": spread(docked["over_expected"], *TAIL),
        "hard_braking": dict(campaign.hard_braking),
        "iteration_limit_cycles": int(rows["solver.iteration_limit_cycles"].sum()),
        "solver_failures": int(rows["solver.failures"].sum()),
        "solver_failure_cases": int((rows["solver.failures"] > 0.0).sum()),
        "failures_driven": int(rows["failures_driven"].sum()),
        "fallback_cycles": int(rows["fallback_cycles"].sum()),
        "fallback_cases": int((rows["fallback_cycles"] > 0.0).sum()),
        "direction_changes_beyond_cusps": {
            "total": int(turns.sum()),
            "cases": int((turns > 0.0).sum()),
            "most": int(turns.fillna(0.0).max()),
        },
        "cycles_by_status": dict(campaign.statuses),
        "planning": _planning(campaign),
        **_computing(campaign),
    }


def _planning(campaign: Campaign) -> dict[str, Any] | None:
    """How ways were planned; None where they were given."""
    if not campaign.of_scenes:
        return None
    rows = campaign.rows
    replans = rows["planning.replans"]
    return {
        "seconds": spread(rows["timed.planning_s"], 50, 95),
        "length_m": spread(rows["planning.length_m"], 50, 95),
        "cusps": spread(rows["planning.cusps"], 50, 95),
        "replans": {"total": int(replans.sum()), "cases": int((replans > 0.0).sum()), **spread(replans)},
    }


def _computing(campaign: Campaign) -> dict[str, Any]:
    """Times of cycles, p50 and p99 those of the median case, max of all; None where none are kept."""
    rows = campaign.rows
    if rows["timed.cycle_ms.p50"].isna().all():
        return {"cycle_ms": None, "deadline_misses": None, "deadline_miss_cases": None}
    misses = rows["timed.deadline_misses"]
    return {
        "cycle_ms": {
            "p50": known(rows["timed.cycle_ms.p50"].median()),
            "p99": known(rows["timed.cycle_ms.p99"].median()),
            "max": known(rows["timed.cycle_ms.max"].max()),
        },
        "deadline_misses": int(misses.sum()),
        "deadline_miss_cases": int((misses > 0.0).sum()),
    }


def spread(values: pd.Series[Any], *percents: int, largest: bool = True) -> dict[str, float | None]:
    """Percentiles as p50, ..., and the largest as max, of what is known; None where nothing is."""
    found = {f"p{percent}": known(values.quantile(percent / 100.0)) for percent in percents}
    return found | ({"max": known(values.max())} if largest else {})


def known(value: Any) -> float | None:
    """A number for JSON, which has no NaN."""
    return None if pd.isna(value) else float(value)
