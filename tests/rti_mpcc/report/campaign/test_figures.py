"""The figures of a campaign, against values reckoned by hand."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from scipy.stats import beta

from rti_mpcc.report.campaign.figures import overall, success_interval
from rti_mpcc.simulation.campaign import CaseOutcome
from tests.rti_mpcc.report.campaign.made_up import CALM, campaign, docked, figures, peak, raised, row, stalled


@pytest.mark.parametrize(
    ("docks", "cases", "low", "high"),
    [
        (9, 10, 0.5549839, 0.9974714),  # R: binom.test(9, 10)
        (0, 10, 0.0, 1.0 - 0.025**0.1),
        (10, 10, 0.025**0.1, 1.0),
        (1, 1, 0.025, 1.0),
    ],
)
def test_intervals_are_known_ones(docks: int, cases: int, low: float, high: float) -> None:
    assert success_interval(docks, cases) == pytest.approx((low, high), abs=1e-6)


def test_intervals_are_quantiles_of_the_beta_distribution() -> None:
    low, high = success_interval(990, 1000)
    assert low == pytest.approx(float(beta.ppf(0.025, 990, 11)))
    assert high == pytest.approx(float(beta.ppf(0.975, 991, 10)))


def test_figures_are_those_of_the_rows(tmp_path: Path) -> None:
    turned = figures(
        30.0,
        -0.1,
        direction_changes=3,
        solver={"failures": 4, "iteration_limit_cycles": 2},
        failures_driven=1,
        fallback_cycles=5,
    )
    read = campaign(
        tmp_path,
        docked(0, 20.0, 0.1),
        row(1, turned, course={"cusps": 1}),
        stalled(2, 0.4),
        docked(3, 22.0, 0.3),
        raised(5),
    )
    told = overall(read)
    assert (told["cases"], told["cases_asked"], told["finished"]) == (5, 4, True)
    assert told["outcomes"] == {
        "docked": 3,
        "unconfirmed": 0,
        "unfinished": 0,
        "stalled": 1,
        "failed": 0,
        "raised": 1,
        "worker_died": 0,
    }
    assert told["success_rate"] == 0.6
    assert told["success_interval"] == pytest.approx(success_interval(3, 5))
    assert (told["collisions"], told["collisions_unknown"]) == (1, 1)
    assert (told["time_to_dock_p50"], told["time_to_dock_max"]) == (22.0, 30.0)
    assert told["time_to_dock_p95"] == pytest.approx(29.2)
    assert told["time_to_tolerance_p50"] == 21.5
    assert told["time_over_yardstick_p50"] == pytest.approx(30.0 / (15.0 * 2.0**0.5))
    assert told["min_clearance_m"] == -0.1
    assert told["clearance_p50_m"] == pytest.approx(0.2)
    assert told["clearance_p5_m"] == pytest.approx(-0.07)
    assert told["final_error"]["lateral_m"] == {"p50": 0.002, "p95": 0.002, "max": 0.002}
    assert (told["solver_failures"], told["solver_failure_cases"], told["failures_driven"]) == (4, 1, 1)
    assert (told["fallback_cycles"], told["fallback_cases"]) == (5, 1)
    assert told["direction_changes_beyond_cusps"] == {"total": 2, "cases": 1, "most": 2}
    assert told["energy_to_dock"]["steering_rate"]["p50"] == 0.2
    assert told["cycles_by_status"] == {"arriving": 40, "docked": 8}
    json.dumps(told, allow_nan=False)


def test_comfort_is_told_of_the_worst_too(tmp_path: Path) -> None:
    rough = figures(36.0, 0.2, peak=peak(acceleration=1.2), energy_ratio=4.0)
    weak = replace(CALM, acceleration_gain=0.5)
    read = campaign(tmp_path, docked(0, 18.0), docked(1, 18.0), replace(row(2, rough), disturbances=weak))
    told = overall(read)
    assert told["told_docked"] == 1.0
    # 0.5 and 1.2 m/s² of a comfort of 0.4; a drive of half the strength was told 2.4.
    assert told["comfort"]["acceleration"]["p50"] == pytest.approx(1.25)
    assert told["comfort"]["acceleration"]["max"] == pytest.approx(3.0)
    assert told["comfort"]["acceleration_over_gain"]["max"] == pytest.approx(6.0)
    assert told["comfort"]["steering_rate"] == pytest.approx(dict.fromkeys(("p50", "p95", "p99", "max"), 0.5))
    assert told["energy_ratio"]["p50"] == pytest.approx(1.1)
    assert told["energy_ratio"]["max"] == 4.0
    assert (told["time_ratio"]["p50"], told["time_ratio"]["max"]) == (1.0, 2.0)
    assert told["hard_braking"] == {"contact ahead": 6}
    assert told["iteration_limit_cycles"] == 0


def test_what_nothing_is_known_of_is_null(tmp_path: Path) -> None:
    told = overall(campaign(tmp_path, raised(0, CaseOutcome.WORKER_DIED)))
    assert told["success_rate"] == 0.0
    assert told["success_interval"] == [0.0, pytest.approx(0.975)]
    assert not told["finished"]
    assert (told["collisions"], told["collisions_unknown"]) == (0, 1)
    for name in ("time_to_dock_p50", "min_clearance_m", "clearance_p5_m", "time_over_yardstick_max"):
        assert told[name] is None
    assert told["final_error"]["heading_rad"]["max"] is None
    assert told["solver_failures"] == 0
    json.dumps(told, allow_nan=False)


def test_one_row_is_enough(tmp_path: Path) -> None:
    told = overall(campaign(tmp_path, docked(0, 24.0, 0.25)))
    assert told["success_rate"] == 1.0
    assert told["time_to_dock_p50"] == told["time_to_dock_p95"] == 24.0
    assert told["min_clearance_m"] == told["clearance_p5_m"] == 0.25
