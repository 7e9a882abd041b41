"""The figures of a run on motions whose figures are known."""

from __future__ import annotations

from dataclasses import replace
from math import pi, sqrt

import numpy as np
import pytest

from geometry import Area
from rti_mpcc.simulation import RunResult, Scenario, Truth, changed, metrics, simulate, summary
from rti_mpcc.simulation.metrics import body_clearances, energy, rms, time_to_dock
from rti_mpcc.simulation.ride import energy_bound, turning_points
from rti_mpcc.types import Array, Reason, Source, Status, VehicleState
from tests.rti_mpcc.simulation.conftest import Scripted, still, with_columns

STEP = 0.01
TIMES: Array = STEP * np.arange(1001, dtype=np.float64)
DOCKED_POSE = (10.0, 0.0, 0.0)


def truth_of(
    *,
    poses: Array | None = None,
    v: Array | None = None,
    delta: Array | None = None,
    lateral: Array | None = None,
    goal: tuple[float, float, float] = DOCKED_POSE,
) -> Truth:
    count = len(TIMES)
    zeros = np.zeros(count)
    v = zeros if v is None else v
    delta = zeros if delta is None else delta
    return Truth(
        times=TIMES,
        poses=np.zeros((count, 3)) if poses is None else poses,
        v=v,
        delta=delta,
        theta=zeros,
        part=np.zeros(count, dtype=np.int64),
        acceleration=np.append(np.diff(v) / STEP, 0.0),
        steering_rate=np.append(np.diff(delta) / STEP, 0.0),
        lateral_acceleration=zeros if lateral is None else lateral,
        goals=np.tile(goal, (count, 1)),
    )


@pytest.fixture
def run(straight: Scenario) -> RunResult:
    """A run whose truth the tests replace."""
    return simulate(changed(straight, {"simulation.duration": 1.0}), controller=Scripted(script=still))


BRIEF = {"simulation.duration": 0.1, "vehicle.width": 2.0, "vehicle.front": 3.0, "vehicle.rear": 1.0}


@pytest.fixture
def in_lane(straight: Scenario) -> RunResult:
    """A body of 4 by 2 m in a lane of 6 m along x."""
    return simulate(changed(straight, BRIEF), controller=Scripted(script=still))


def clearance_at(run: RunResult, pose: tuple[float, float, float]) -> float:
    truth = replace(run.truth, poses=np.tile(pose, (len(run.truth.times), 1)))
    return float(body_clearances(replace(run, truth=truth))[0])


@pytest.mark.parametrize(
    ("pose", "expected"),
    [
        ((4.0, 0.0, 0.0), 2.0),
        ((4.0, 2.5, 0.0), -0.5),  # it crosses the boundary
        ((4.0, 3.0, pi), -1.0),
        ((4.0, 6.0, 0.0), -4.0),  # it is wholly beyond
        ((4.0, -6.0, 0.0), -4.0),
    ],
)
def test_clearance_is_negative_across_and_beyond_a_boundary(
    in_lane: RunResult, pose: tuple[float, float, float], expected: float
) -> None:
    assert clearance_at(in_lane, pose) == pytest.approx(expected, abs=1e-9)


def test_clearance_is_judged_by_shapely_too(in_lane: RunResult, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the controller's own distance sees nothing, shapely's counts."""
    monkeypatch.setattr(metrics, "clearances", lambda poses, *_: np.full((len(poses), 1), np.inf))
    assert clearance_at(in_lane, (4.0, 0.5, 0.0)) == pytest.approx(1.5)
    assert -1e-6 < clearance_at(in_lane, (4.0, 2.5, 0.0)) < 0.0


def test_clearance_in_an_area_is_judged_by_shapely_too(
    hall: Scenario, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = simulate(changed(hall, BRIEF), controller=Scripted(script=still))
    assert clearance_at(run, (8.0, 0.0, 0.0)) == pytest.approx(1.0)  # to the box
    monkeypatch.setattr(Area, "signed_distances", lambda area, body, poses, *_: np.full(len(poses), np.inf))
    assert clearance_at(run, (8.0, 0.0, 0.0)) == pytest.approx(1.0)
    assert -1e-6 < clearance_at(run, (8.0, 2.0, 0.0)) < 0.0


@pytest.mark.parametrize("until", [None, 4.0])
def test_energies_and_rms_of_harmonic_motion(until: float | None) -> None:
    rate = 2.0 * pi
    truth = truth_of(
        v=np.sin(rate * TIMES), delta=0.3 * np.sin(rate * TIMES), lateral=2.0 * np.cos(rate * TIMES)
    )
    time = 10.0 if until is None else until
    expected = {
        "acceleration": 0.5 * rate**2 * time,
        "steering_rate": 0.5 * (0.3 * rate) ** 2 * time,
        "lateral_acceleration": 2.0 * time,
    }
    assert energy(truth, until) == pytest.approx(expected, rel=2e-3)
    means = {name: sqrt(value / time) for name, value in expected.items()}
    assert rms(truth, until) == pytest.approx({**means, "steering": 0.3 / sqrt(2.0)}, rel=1e-3)


@pytest.mark.parametrize(
    ("travels", "changes"),
    [
        ([1.0], 0),
        ([1.0, -0.049, 1.0], 0),
        ([1.0, -0.051], 1),
        ([-1.0, 0.051], 1),
        ([1.0, -0.051, 0.049, -0.02], 1),
        ([1.0, -0.051, 0.051], 2),
        ([0.03, -1.0], 0),
        ([0.06, -1.0], 1),
        ([1.0, -0.03, 0.01, -0.031], 1),
        ([0.04, -0.04, 0.04], 0),
        ([], 0),
    ],
)
def test_direction_changes_count_after_five_centimetres(travels: list[float], changes: int) -> None:
    # Each travel takes 1 s at a speed that rises and falls as a sine over it.
    phase = np.arange(1000) / 1000.0
    v = np.concatenate([[0.0], *[travel * 0.5 * pi * np.sin(pi * phase) for travel in travels]])
    times: Array = 0.001 * np.arange(len(v), dtype=np.float64)
    assert len(turning_points(times, v)) == changes
    assert len(turning_points(times, -v)) == changes


def rest_to_rest(distance: float, duration: float) -> tuple[Array, Array]:
    """Times and speeds of least acceleration energy."""
    times = np.linspace(0.0, duration, 2001)
    return times, 6.0 * distance / duration**3 * times * (duration - times)


def joined(*pieces: tuple[Array, Array]) -> Truth:
    """Motions one after the other."""
    times, v = pieces[0]
    for more, faster in pieces[1:]:
        times, v = np.append(times, times[-1] + more[1:]), np.append(v, faster[1:])
    a, none = np.diff(v) / np.diff(times), np.zeros(len(times))
    a = np.append(a, a[-1])
    return replace(
        truth_of(), times=times, v=v, acceleration=a, steering_rate=none, lateral_acceleration=none
    )


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_best_ride_takes_no_more_than_its_bound(sign: float) -> None:
    times, v = rest_to_rest(8.0, 12.0)
    truth = joined((times, sign * v))
    assert energy_bound(truth, times[-1]) == pytest.approx(12.0 * 8.0**2 / 12.0**3, rel=1e-6)
    assert energy(truth, None)["acceleration"] == pytest.approx(energy_bound(truth, 12.0), rel=1e-3)


def test_hard_braking_is_counted_by_its_reason(straight: Scenario) -> None:
    # 0.5 m/s², from 3 s on -1 m/s² for 0.5 s, then none: the reasons are the controller's.
    def script(now: float, state: VehicleState) -> tuple[float, float]:
        return (0.5 if now < 3.0 else -1.0 if now < 3.5 else 0.0), 0.0

    controller = Scripted(script=script, docked=lambda now: False)
    result = simulate(changed(straight, {"simulation.duration": 5.0}), controller=controller)
    cycles = result.cycles
    hard = int(np.count_nonzero(cycles.acceleration == -1.0))
    assert summary(result)["hard_braking"] == {Reason.DRIVES.value: hard}
    last = int(np.flatnonzero(cycles.acceleration == -1.0)[-1])
    causes = tuple(Reason.CONTACT_AHEAD if i == last else each for i, each in enumerate(cycles.cause))
    other = summary(replace(result, cycles=with_columns(cycles, cause=causes)))
    assert other["hard_braking"] == {Reason.CONTACT_AHEAD.value: 1, Reason.DRIVES.value: hard - 1}
    # What a weak drive makes of it is in comfort.
    weak = replace(result, scenario=changed(result.scenario, {"simulation.acceleration_gain": 0.4}))
    assert summary(weak)["hard_braking"] == {}


@pytest.mark.parametrize(
    ("spans", "dock"),
    [
        ([(2.0, 2.49)], None),
        ([(2.0, 2.5)], 2.0),
        ([(2.0, 2.4), (4.0, 4.8), (6.0, 9.0)], 4.0),
        ([(0.0, 10.0)], 0.0),
        ([], None),
    ],
)
def test_time_to_dock_is_the_start_of_the_first_half_second(
    spans: list[tuple[float, float]], dock: float | None
) -> None:
    standing = np.zeros(len(TIMES), dtype=np.bool_)
    for begin, end in spans:
        standing |= np.abs(TIMES - 0.5 * (begin + end)) <= 0.5 * (end - begin) + 1e-9
    assert time_to_dock(TIMES, standing) == (None if dock is None else pytest.approx(dock, abs=1e-9))


def test_computing_figures_leave_the_first_cycle_out(run: RunResult) -> None:
    count = len(run.cycles.times)
    step_ms = np.linspace(1.0, 2.0, count)
    step_ms[0] = 500.0
    iterations = np.arange(count)
    by_piqp = iterations >= count - 3
    columns = {"iterations": iterations, "solved": iterations >= 10, "interior_point": by_piqp}
    cycles = with_columns(run.cycles, step_ms=step_ms, **columns)
    figures = summary(replace(run, cycles=cycles))
    assert figures["cycle_ms"]["max"] == 2.0
    assert figures["cycle_ms"]["p50"] == pytest.approx(np.median(step_ms[1:]))
    assert figures["feedback_ms"] == {"p50": 0.5, "p95": 0.5, "p99": 0.5, "max": 0.5}
    solver = {"iterations_p50": 15.0, "iterations_p95": 19.5, "failures": 0, "interior_point_cycles": 3}
    assert figures["solver"] == solver


def test_summary_has_the_names_of_the_contract(run: RunResult) -> None:
    figures = summary(run)
    names = (
        "scenario method preset seed docked time_to_tolerance_s time_to_dock_s final_error min_clearance_m "
        "direction_changes max_steering_rad rms energy energy_to_dock distance_m cycle_ms feedback_ms solver "
        "fallback_cycles deadline_misses goal energy_ratio hard_braking"
    )
    assert set(names.split()) <= set(figures)
    assert set(figures["final_error"]) == {"longitudinal_m", "lateral_m", "heading_rad"}
    assert figures["goal"] is None
    assert set(figures["rms"]) == {"steering", "steering_rate", "acceleration", "lateral_acceleration"}
    for name in ("energy", "energy_to_dock"):
        assert set(figures[name]) == {"steering_rate", "acceleration", "lateral_acceleration"}


def test_substitutes_are_counted_and_braking_to_the_goal_is_none(run: RunResult) -> None:
    solved, shifted, braking = Source.SOLUTION, Source.SHIFTED_PLAN, Source.BRAKING
    standing = Source.STANDSTILL
    none = [(solved, Status.FOLLOWING), (braking, Status.SETTLING), (standing, Status.DOCKED)]
    some = [(shifted, Status.FOLLOWING), (braking, Status.BLOCKED), (standing, Status.FAILED)]
    source, status = zip(*none, *some, strict=True)
    cycles = with_columns(run.cycles[:6].view(np.recarray), source=source, status=status)
    assert summary(replace(run, cycles=cycles))["fallback_cycles"] == 3
