"""Comfort asked for is comfort driven, a time asked for is the time taken; what `default` set out for."""

from __future__ import annotations

import pytest

from benchmarks.reproduction.comfort import aims
from rti_mpcc.errors import ConfigError, ScenarioError
from rti_mpcc.simulation import changed, load_scenario, simulate, summary
from tests.lists import some_of
from tests.rti_mpcc.docking_runs import short

OVER = 1.1
"""So many times comfort a peak may be: the penalty on what goes beyond it is soft."""


@pytest.mark.acceptance
@pytest.mark.parametrize("name", ["docking_inside", "docking_behind"])
def test_default_keeps_to_all_that_it_set_out_for_beside_the_published_code(name: str) -> None:
    missed = [aim for aim in aims(summary(simulate(load_scenario(name))), name) if not aim.met]
    assert missed == []


@pytest.mark.acceptance
@pytest.mark.parametrize(
    ("comfort", "value"),
    [("acceleration", 0.15), ("lateral_acceleration", 0.06), ("steering_rate", 0.12)],
)
def test_what_is_driven_keeps_to_comfort_and_takes_the_time_expected(comfort: str, value: float) -> None:
    usual, gentle = (
        summary(simulate(changed(short(), changes)))
        for changes in ({}, {f"controller.comfort_{comfort}": value})
    )
    assert usual["peak"][comfort] > 1.2 * value
    assert gentle["docked"]
    for name, most in gentle["comfort"].items():
        assert gentle["peak"][name] <= OVER * most
    assert gentle["time_to_dock_s"] > usual["time_to_dock_s"]
    assert gentle["time_to_dock_s"] == pytest.approx(gentle["expected_time_s"], rel=0.05)


@pytest.mark.parametrize("seconds", some_of([11.0, 25.0]))
def test_the_time_asked_for_is_taken(seconds: float) -> None:
    found = summary(simulate(changed(short(), {"controller.docking_time": seconds})))
    assert found["docked"]
    assert found["expected_time_s"] == pytest.approx(seconds, rel=1e-3)
    assert found["time_to_dock_s"] == pytest.approx(seconds, rel=0.05)


def test_a_time_that_cannot_be_is_told_before_the_run() -> None:
    with pytest.raises(ScenarioError, match=r"docking_time = 1\.0 s: within the limits docking here takes"):
        changed(short(), {"controller.docking_time": 1.0})
    with pytest.raises(ConfigError, match="only planned arrivals have a time"):
        simulate(changed(short(), {"controller.docking_time": 20.0}), preset="paper")


@pytest.mark.parametrize("ride", some_of(["smooth", "brisk"]))
@pytest.mark.parametrize("name", some_of(["docking_inside", "docking_behind"]))
def test_the_acceleration_changes_by_the_comfort_jerk_from_the_begin_to_the_dock(
    name: str, ride: str
) -> None:
    found = summary(simulate(changed(load_scenario(name), {"controller.ride": ride})))
    assert found["docked"]
    for what, most in found["comfort"].items():
        assert found["peak"][what] <= OVER * most
    assert found["hard_braking"] == {}
