"""The detector's laws by statistics with a fixed seed, its clock, and the goal given to the controller."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from estimation import Frame
from geometry import Pose2
from rti_mpcc.simulation import GoalSource, Scenario, SimulatedDetector, scenario_from_dict, simulate
from rti_mpcc.simulation.sections.goal import MeasurementSection
from rti_mpcc.types import Array
from tests.rti_mpcc.simulation.conftest import Scripted, forward, still

VEHICLE = Pose2(3.0, -1.0, 2.5)
PLANNED, TRUE = Pose2(10.5, 0.2, 0.1), Pose2(10.0, 0.0, 0.0)
STDS = ("position_std", "heading_std", "position_floor", "heading_floor")
EXACT: dict[str, Any] = dict.fromkeys(STDS, 1e-9)
SURE: dict[str, Any] = {"dropout": 0.0, "outlier": 0.0}


def detector(seed: int = 1, **section: Any) -> SimulatedDetector:
    return SimulatedDetector(section=MeasurementSection(**section), random=np.random.default_rng(seed))


def goal_at(distance: float) -> Pose2:
    """A goal so far from VEHICLE [m], aside and turned."""
    return VEHICLE.compose(Pose2(-0.8 * distance, 0.6 * distance, 0.3))


def errors(watching: SimulatedDetector, distance: float, count: int, *, last_part: bool = True) -> Array:
    """(k, 3) detections in `count` exposures minus the true goal, in the vehicle's frame."""
    goal = goal_at(distance)
    seen = goal.relative_to(VEHICLE)
    found = [watching.expose(0.1 * k, VEHICLE, goal, last_part=last_part) for k in range(count)]
    detected = [one for one in found if one is not None]
    assert {one.frame for one in detected} <= {Frame.VEHICLE}
    return np.array([(one.x - seen.x, one.y - seen.y, one.phi - seen.phi) for one in detected]).reshape(-1, 3)


@pytest.mark.parametrize(
    ("distance", "reference", "position", "heading"),
    [(10.0, 10.0, 0.05, 0.035), (2.0, 10.0, 0.01, 0.007), (0.1, 10.0, 0.002, 0.001), (10.0, 5.0, 0.1, 0.07)],
)
def test_noise_grows_with_range_above_a_floor(
    distance: float, reference: float, position: float, heading: float
) -> None:
    found = errors(detector(**SURE, reference_range=reference), distance, 4000)
    assert len(found) == 4000
    assert found.std(axis=0) == pytest.approx((position, position, heading), rel=0.05)
    assert np.abs(found.mean(axis=0)) == pytest.approx(np.zeros(3), abs=4.0 * position / np.sqrt(4000))
    assert np.corrcoef(found.T) == pytest.approx(np.eye(3), abs=0.06)


@pytest.mark.parametrize(("distance", "seen"), [(15.01, 0), (14.99, 5), (4.01, 5), (3.99, 0)])
def test_nothing_is_seen_too_far_or_too_near(distance: float, seen: int) -> None:
    assert len(errors(detector(**SURE, blind_range=4.0), distance, 5)) == seen


@pytest.mark.parametrize(("dropout", "outlier"), [(0.0, 0.02), (0.5, 0.3), (0.1, 1.0), (1.0, 0.0)])
def test_shares_of_dropouts_and_of_outliers_in_any_direction(dropout: float, outlier: float) -> None:
    found = errors(detector(dropout=dropout, outlier=outlier, outlier_size=0.7, **EXACT), 5.0, 5000)
    assert 1.0 - len(found) / 5000 == pytest.approx(dropout, abs=0.02)
    off = np.hypot(found[:, 0], found[:, 1])
    wrong = off > 1e-6
    assert np.count_nonzero(wrong) == pytest.approx(outlier * len(found), abs=0.03 * len(found))
    assert off[wrong] == pytest.approx(np.full(wrong.sum(), 0.7), abs=1e-6)
    if wrong.any():
        directions = np.arctan2(found[wrong, 1], found[wrong, 0])
        quarters = np.histogram(directions, bins=4, range=(-np.pi, np.pi))[0] / wrong.sum()
        assert quarters == pytest.approx(np.full(4, 0.25), abs=0.12)


@pytest.mark.parametrize("source", list(GoalSource))
def test_run_keeps_its_source_and_gives_measurements_to_a_filter_only(
    tables: dict[str, Any], source: GoalSource
) -> None:
    controller = Scripted(script=still)
    scenario = watched(tables, 0.5, initial_offset=[0.4, 0.0, 0.0])
    result = simulate(scenario, controller=controller, goal_source=source)
    assert result.goal_source is source
    assert sum(map(len, controller.detections)) == (6 if source is GoalSource.DETECTED else 0)
    given, first = {one[2] for one in controller.given}, Pose2(10.4, 0.0, 0.0)
    if source is GoalSource.RAW:
        assert len(given - {first}) == 6
    else:
        assert given == {first if source is GoalSource.DETECTED else TRUE}


def watched(tables: dict[str, Any], duration: float = 2.0, **measurement: Any) -> Scenario:
    """The straight scenario with a detector; its goal is at (10, 0, 0)."""
    simulation = {"duration": duration, "state_noise": [0.01, 0.01, 0.002, 0.01, 0.002]}
    return scenario_from_dict(
        {**tables, "goal": {"measurement": {**SURE, **measurement}}, "simulation": simulation}
    )


@pytest.mark.parametrize(("rate", "delay"), [(10.0, 0.0), (7.0, 0.13), (60.0, 0.1), (60.0, 0.13)])
def test_loop_exposes_between_cycles_and_gives_at_the_first_cycle_after_the_delay(
    tables: dict[str, Any], rate: float, delay: float
) -> None:
    controller = Scripted(script=forward)
    simulate(watched(tables, rate=rate, delay=delay, **EXACT), controller=controller)
    cycles = zip(controller.given, controller.detections, strict=True)
    arrived = [(given[0], one) for given, ones in cycles for one in ones]
    stamps = np.array([one.stamp for _, one in arrived])
    assert stamps == pytest.approx(np.arange(len(stamps)) / rate, abs=1e-9)
    assert len(stamps) == int((2.0 - delay) * rate + 1e-6) + 1
    expected = np.ceil((stamps + delay) / 0.05 - 1e-6) * 0.05
    assert np.array([time for time, _ in arrived]) == pytest.approx(expected, abs=1e-9)
    # Seen from where the vehicle truly was at the stamp.
    assert [one.x for _, one in arrived] == pytest.approx(10.0 - 0.5 * stamps**2, abs=1e-6)


def test_noise_is_the_same_whatever_the_controller_does(tables: dict[str, Any]) -> None:
    found, states = [], []
    for script, seed in ((still, 4), (forward, 4), (still, 5)):
        controller = Scripted(script=script)
        simulate(watched(tables, dropout=0.3), controller=controller, seed=seed)
        rows = []
        for one in [one for ones in controller.detections for one in ones]:
            way = 10.0 - (0.5 * one.stamp**2 if script is forward else 0.0)
            rows.append((one.stamp, (one.x - way) / way, one.y / way, one.phi / way))
        found.append(np.array(rows))
        states.append([given[1] for given in controller.given])
    assert found[0] == pytest.approx(found[1], abs=1e-9)
    assert found[0][:4, 1].tolist() != found[2][:4, 1].tolist()
    # That of the state has a stream of its own.
    for other in (watched(tables, rate=60.0, dropout=0.5), watched(tables)):
        controller = Scripted(script=still)
        simulate(other, controller=controller, seed=4)
        assert [given[1] for given in controller.given] == states[0]
