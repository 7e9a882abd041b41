"""A camera in a scenario: when it looks, the boards it sees, and what is lost or wrong."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pytest

from estimation import CharucoDetection
from geometry import Pose2
from rti_mpcc.simulation import GoalSource, changed, scenario_from_dict, simulate
from rti_mpcc.simulation.camera import Image
from rti_mpcc.simulation.goal_feed import CameraDetector
from rti_mpcc.simulation.metrics import detections_of
from rti_mpcc.simulation.sections.goal import CameraSection, MeasurementSection, WrongSection
from tests.lists import some_of
from tests.rti_mpcc.simulation.conftest import camera_tables

HERE, GOAL = Pose2(3.0, 0.1, 0.02), Pose2(0.0, 0.0, 0.0)


def camera(limits: Mapping[str, Any] | None = None, **keys: Any) -> CameraDetector:
    section = CameraSection(exact=True, **keys)
    return CameraDetector.of(section, MeasurementSection(rate=5.0, **(limits or {})), 0, None)


@pytest.mark.parametrize("limits", [{"visible_range": 2.0}, {"blind_range": 4.0}])
def test_it_sees_nothing_out_of_its_ranges(limits: dict[str, float]) -> None:
    assert camera(limits).expose(0.0, HERE, GOAL, last_part=True) is None


def test_the_board_of_another_dock_is_not_taken_for_it() -> None:
    beside = {"pose": (0.0, 1.5, 0.0), "first_marker": 20}
    measurement = camera(others=(beside,)).expose(0.0, HERE, GOAL, last_part=True)
    assert measurement is not None
    assert measurement.y == pytest.approx(GOAL.relative_to(HERE).y, abs=0.02)


def test_who_looks_on_sees_what_is_told() -> None:
    seen: list[CharucoDetection | None] = []

    def look(stamp: float, picture: Image, detection: CharucoDetection | None) -> None:
        seen.append(detection)

    section = CameraSection(
        exact=True, lost=(0.3, 0.5), wrong=WrongSection(after=0.6, offset=(1.0, 0.5, 0.2))
    )
    eye = CameraDetector.of(section, MeasurementSection(rate=5.0, visible_range=3.5), 0, look)
    places = [Pose2(5.0, 0.1, 0.02), HERE, HERE, HERE, HERE, HERE]
    told = [eye.expose(0.2 * k, place, GOAL, last_part=True) for k, place in enumerate(places)]
    assert [each is None for each in told] == [True, False, False, True, False, False]
    assert [None if each is None else each.measurement for each in seen] == told
    true, wrong = GOAL.relative_to(HERE), told[4]
    assert wrong is not None
    off = Pose2(wrong.x, wrong.y, wrong.phi).relative_to(true)
    assert (off.x, off.y, off.phi) == pytest.approx((1.0, 0.5, 0.2), abs=0.03)


@pytest.mark.parametrize("source", some_of(GoalSource, 3))
def test_a_run_docks_by_its_pictures_and_is_the_same_each_time(source: GoalSource) -> None:
    often = {"goal.measurement.rate": 2.0}
    scenario = changed(scenario_from_dict(camera_tables(board={"x": -2.0})), often)
    first = simulate(scenario, seed=3, goal_source=source)
    assert first.ended == "docked"
    if source is GoalSource.DETECTED:
        again = simulate(scenario, seed=3, goal_source=source)
        assert (first.truth.poses == again.truth.poses).all()
    accepted = sum(judged.accepted for judged in detections_of(first.cycles))
    assert (accepted > 10) is (source is GoalSource.DETECTED)
