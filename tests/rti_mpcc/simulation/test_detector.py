"""The detector's laws by statistics with a fixed seed, and its clock."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import pi
from typing import Any

import numpy as np
import pytest

from estimation import Frame, GoalMeasurement
from geometry import Pose2
from rti_mpcc.simulation import Scenario, SimulatedDetector, scenario_from_dict, simulate
from rti_mpcc.simulation.detector import Lookout
from rti_mpcc.simulation.scenario import MeasurementSection
from rti_mpcc.types import Array, VehicleState

VEHICLE = Pose2(3.0, -1.0, 2.5)
EXACT: dict[str, Any] = {
    "position_std": 1e-9,
    "heading_std": 1e-9,
    "position_floor": 1e-9,
    "heading_floor": 1e-9,
}
SURE: dict[str, Any] = {"dropout": 0.0, "outlier": 0.0}


def detector(seed: int = 1, **section: Any) -> SimulatedDetector:
    return SimulatedDetector(section=MeasurementSection(**section), random=np.random.default_rng(seed))


def goal_at(distance: float) -> Pose2:
    """A goal so far from VEHICLE [m], aside and turned."""
    return VEHICLE.compose(Pose2(-0.8 * distance, 0.6 * distance, 0.3))


def errors(watching: SimulatedDetector, distance: float, count: int, *, last_part: bool = True) -> Array:
    """(k, 3) what was detected in `count` exposures minus what was to be seen, in the vehicle's frame."""
    goal = goal_at(distance)
    seen = goal.relative_to(VEHICLE)
    found = [watching.expose(0.1 * k, VEHICLE, goal, last_part=last_part) for k in range(count)]
    told = [one for one in found if one is not None]
    assert {one.frame for one in told} <= {Frame.VEHICLE}
    return np.array([(one.x - seen.x, one.y - seen.y, one.phi - seen.phi) for one in told]).reshape(-1, 3)


@pytest.mark.parametrize(
    ("distance", "position", "heading"),
    [
        (10.0, 0.05, 0.035),
        (14.0, 0.07, 0.049),
        (2.0, 0.01, 0.007),
        (0.35, 0.002, 0.001225),
        (0.1, 0.002, 0.001),
    ],
)
def test_noise_grows_with_range_above_a_floor(distance: float, position: float, heading: float) -> None:
    found = errors(detector(**SURE), distance, 4000)
    assert len(found) == 4000
    assert found.std(axis=0) == pytest.approx((position, position, heading), rel=0.05)
    assert np.abs(found.mean(axis=0)) == pytest.approx(np.zeros(3), abs=4.0 * position / np.sqrt(4000))
    assert np.corrcoef(found.T) == pytest.approx(np.eye(3), abs=0.06)


def test_noise_scales_with_the_reference_range() -> None:
    found = errors(detector(**SURE, reference_range=5.0, position_std=0.2, heading_std=0.01), 10.0, 4000)
    assert found.std(axis=0) == pytest.approx((0.4, 0.4, 0.02), rel=0.05)


def test_detection_is_what_the_vehicle_sees() -> None:
    goal = goal_at(9.0)
    found = detector(**SURE, **EXACT).expose(1.25, VEHICLE, goal, last_part=True)
    assert found is not None
    assert (found.stamp, found.covariance, found.vehicle) == (1.25, None, None)
    placed = VEHICLE.compose(Pose2(found.x, found.y, found.phi))
    assert (placed.x, placed.y, placed.phi) == pytest.approx((goal.x, goal.y, goal.phi), abs=1e-6)


@pytest.mark.parametrize(
    ("distance", "seen"), [(15.01, 0), (14.99, 5), (4.01, 5), (3.99, 0), (0.0, 0), (400.0, 0)]
)
def test_nothing_is_seen_too_far_or_too_near(distance: float, seen: int) -> None:
    assert len(errors(detector(**SURE, blind_range=4.0), distance, 5)) == seen


@pytest.mark.parametrize(
    ("after_cusp", "last_part", "seen"), [(True, False, 0), (True, True, 5), (False, False, 5)]
)
def test_visible_after_the_cusp_only(after_cusp: bool, last_part: bool, seen: int) -> None:
    watching = detector(**SURE, visible_after_cusp=after_cusp)
    assert len(errors(watching, 5.0, 5, last_part=last_part)) == seen


@pytest.mark.parametrize("share", [0.0, 0.1, 0.6, 1.0])
def test_so_many_exposures_see_nothing(share: float) -> None:
    found = errors(detector(dropout=share, outlier=0.0), 5.0, 5000)
    assert 1.0 - len(found) / 5000 == pytest.approx(share, abs=0.02)


@pytest.mark.parametrize("share", [0.0, 0.02, 0.3, 1.0])
def test_so_many_detections_are_wrong_by_so_much_in_any_direction(share: float) -> None:
    found = errors(detector(dropout=0.0, outlier=share, outlier_size=0.7, **EXACT), 5.0, 5000)
    off = np.hypot(found[:, 0], found[:, 1])
    wrong = off > 1e-6
    assert wrong.mean() == pytest.approx(share, abs=0.02)
    assert off[wrong] == pytest.approx(np.full(wrong.sum(), 0.7), abs=1e-6)
    assert np.abs(found[:, 2]).max() < 1e-6
    if wrong.any():
        directions = np.arctan2(found[wrong, 1], found[wrong, 0])
        quarters = np.histogram(directions, bins=4, range=(-pi, pi))[0] / wrong.sum()
        assert quarters == pytest.approx(np.full(4, 0.25), abs=0.12)


def test_dropouts_and_outliers_are_independent() -> None:
    found = errors(detector(dropout=0.5, outlier=0.3, outlier_size=1.0, **EXACT), 5.0, 5000)
    assert np.mean(np.hypot(found[:, 0], found[:, 1]) > 0.5) == pytest.approx(0.3, abs=0.03)


def test_what_is_not_seen_uses_up_its_noise() -> None:
    watching, other = detector(7, **SURE), detector(7, **SURE)
    errors(watching, 5.0, 10)
    errors(other, 99.0, 4)
    errors(other, 5.0, 6, last_part=False)
    assert errors(watching, 5.0, 3) == pytest.approx(errors(other, 5.0, 3), abs=0.0)


@dataclass(kw_only=True)
class Counting:
    """Sees the goal exactly where it is; keeps when it looked."""

    rate: float = 10.0
    delay: float = 0.0
    stamps: list[float] = field(default_factory=list)

    def expose(self, stamp: float, vehicle: Pose2, goal: Pose2, *, last_part: bool) -> GoalMeasurement | None:
        self.stamps.append(stamp)
        seen = goal.relative_to(vehicle)
        return GoalMeasurement(stamp=stamp, x=seen.x, y=seen.y, phi=seen.phi, frame=Frame.VEHICLE)


@pytest.mark.parametrize("rate", [10.0, 7.0, 1000.0, 0.3])
def test_exposures_are_one_period_apart(rate: float) -> None:
    watching = Counting(rate=rate)
    lookout = Lookout(detector=watching)
    for _ in range(2000):
        lookout.expose(VEHICLE, goal_at(1.0), last_part=True)
    assert np.array(watching.stamps) == pytest.approx(np.arange(2000) / rate, abs=1e-9)


def test_detections_arrive_once_after_their_delay_in_the_order_of_their_stamps() -> None:
    lookout = Lookout(detector=Counting(delay=0.25))
    for _ in range(4):
        lookout.expose(VEHICLE, goal_at(1.0), last_part=True)
    assert lookout.arrived(0.24) == ()
    assert [one.stamp for one in lookout.arrived(0.25)] == [0.0]
    assert [one.stamp for one in lookout.arrived(0.25)] == []
    assert [one.stamp for one in lookout.arrived(0.5)] == [0.1, 0.2]
    assert [one.stamp for one in lookout.arrived(9.0)] == [0.3]


def forward(now: float, state: VehicleState) -> tuple[float, float]:
    return 1.0, 0.0


def still(now: float, state: VehicleState) -> tuple[float, float]:
    return 0.0, 0.0


def watched(tables: dict[str, Any], duration: float = 2.0, **measurement: Any) -> Scenario:
    """The straight scenario with a detector; its goal is at (10, 0, 0)."""
    section = {"dropout": 0.0, "outlier": 0.0, **measurement}
    simulation = {"duration": duration, "state_noise": [0.01, 0.01, 0.002, 0.01, 0.002]}
    return scenario_from_dict({**tables, "goal": {"measurement": section}, "simulation": simulation})


@pytest.mark.parametrize("rate", [10.0, 7.0, 60.0])
@pytest.mark.parametrize("delay", [0.0, 0.1, 0.13])
def test_loop_exposes_between_cycles_and_tells_at_the_first_cycle_after_the_delay(
    scripted: Any, tables: dict[str, Any], rate: float, delay: float
) -> None:
    controller = scripted(script=forward)
    simulate(watched(tables, rate=rate, delay=delay, **EXACT), controller=controller)
    arrived = [
        (told[0], one)
        for told, ones in zip(controller.given, controller.detections, strict=True)
        for one in ones
    ]
    stamps = np.array([one.stamp for _, one in arrived])
    assert stamps == pytest.approx(np.arange(len(stamps)) / rate, abs=1e-9)
    assert len(stamps) == int((2.0 - delay) * rate + 1e-6) + 1
    cycles = np.ceil((stamps + delay) / 0.05 - 1e-6) * 0.05
    assert np.array([time for time, _ in arrived]) == pytest.approx(cycles, abs=1e-9)
    # Seen from where the vehicle truly was at the stamp.
    assert [one.x for _, one in arrived] == pytest.approx(10.0 - 0.5 * stamps**2, abs=1e-6)


def test_detector_sees_the_last_part_when_the_controller_is_on_it(
    scripted: Any, tables: dict[str, Any]
) -> None:
    tables["path"]["segments"].append({"direction": -1, "curvature": 0, "length": 5})
    controller = scripted(script=still, part=lambda now: int(now > 0.93))
    simulate(watched(tables, visible_after_cusp=True), controller=controller)
    stamps = [one.stamp for ones in controller.detections for one in ones]
    # The cycle at 0.95 s changes over.
    assert stamps == pytest.approx(0.1 * np.arange(10, 21))


def test_noise_is_the_same_whatever_the_controller_does(scripted: Any, tables: dict[str, Any]) -> None:
    found = []
    for script, seed in ((still, 4), (forward, 4), (still, 5)):
        controller = scripted(script=script)
        simulate(watched(tables, dropout=0.3), controller=controller, seed=seed)
        rows = []
        for one in [one for ones in controller.detections for one in ones]:
            way = 10.0 - (0.5 * one.stamp**2 if script is forward else 0.0)
            rows.append((one.stamp, (one.x - way) / way, one.y / way, one.phi / way))
        found.append(np.array(rows))
    assert found[0] == pytest.approx(found[1], abs=1e-9)
    assert found[0][:4, 1].tolist() != found[2][:4, 1].tolist()


def test_noise_of_the_state_is_the_same_with_and_without_a_detector(
    scripted: Any, tables: dict[str, Any]
) -> None:
    states = []
    for scenario in (watched(tables), watched(tables, rate=60.0, dropout=0.5)):
        controller = scripted(script=still)
        simulate(scenario, controller=controller, seed=3)
        states.append([told[1] for told in controller.given])
    controller = scripted(script=still)
    plain = {key: value for key, value in watched(tables).model_dump(by_alias=True).items() if key != "goal"}
    simulate(scenario_from_dict(plain), controller=controller, seed=3)
    assert states[0] == states[1] == [told[1] for told in controller.given]
