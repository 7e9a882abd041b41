"""A camera in a scenario: when it looks, what it suffers, the boards it sees, and each bad key."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from typing import Any

import pytest

from estimation import CharucoBoard, CharucoDetection
from estimation.charuco import opencv_board
from geometry import Pose2
from rti_mpcc.errors import ConfigError, ScenarioError
from rti_mpcc.simulation import GoalSource, Scenario, scenario_from_dict, simulate
from rti_mpcc.simulation.camera import Image
from rti_mpcc.simulation.scenario import MeasurementSection
from rti_mpcc.simulation.scenario_camera import (
    CameraSection,
    OtherBoardSection,
    ScenarioCamera,
    WrongSection,
)
from rti_mpcc.simulation.scenario_writer import scenario_text

HERE, GOAL = Pose2(3.0, 0.1, 0.02), Pose2(0.0, 0.0, 0.0)


def camera(limits: Mapping[str, Any] | None = None, **keys: Any) -> ScenarioCamera:
    section = CameraSection(exact=True, **keys)
    return ScenarioCamera.of(section, MeasurementSection(rate=5.0, **(limits or {})), 0, None)


def scenario(**goal_camera: Any) -> Scenario:
    return scenario_from_dict(
        {
            "name": "seen",
            "path": {
                "start": [4.0, 0.3, 0.05],
                "segments": [{"direction": -1, "curvature": 0.0, "length": 4.0}],
            },
            "corridor": {"left": 3.0, "right": -3.0},
            "goal": {"measurement": {"initial_offset": [0.2, 0.1, 0.05], "rate": 5.0}, "camera": goal_camera},
            "simulation": {"cycle": 0.05, "duration": 40.0},
        }
    )


def test_it_sees_the_board_where_it_is() -> None:
    measurement = camera().expose(0.0, HERE, GOAL, last_part=True)
    assert measurement is not None
    seen = GOAL.relative_to(HERE)
    assert (measurement.x, measurement.y) == pytest.approx((seen.x, seen.y), abs=0.02)
    assert measurement.phi == pytest.approx(seen.phi, abs=0.01)


def test_it_takes_no_picture_before_the_change_of_direction_where_it_is_to_wait() -> None:
    taken: list[float] = []

    def seen(stamp: float, picture: Image, detection: CharucoDetection | None) -> None:
        taken.append(stamp)

    limits = MeasurementSection(rate=5.0, visible_after_cusp=True)
    eye = ScenarioCamera.of(CameraSection(exact=True), limits, 0, seen)
    assert eye.expose(0.0, HERE, GOAL, last_part=False) is None
    assert taken == []
    assert eye.expose(0.2, HERE, GOAL, last_part=True) is not None
    assert taken == [0.2]


@pytest.mark.parametrize("limits", [{"visible_range": 2.0}, {"blind_range": 4.0}])
def test_it_sees_nothing_out_of_its_ranges(limits: dict[str, float]) -> None:
    assert camera(limits).expose(0.0, HERE, GOAL, last_part=True) is None


def test_detections_are_lost_for_a_while() -> None:
    eye = camera(lost=(0.5, 1.0))
    found = [eye.expose(0.2 * k, HERE, GOAL, last_part=True) is not None for k in range(7)]
    assert found == [True, True, True, False, False, True, True]


def test_one_detection_is_wrong() -> None:
    eye = camera(wrong=WrongSection(after=0.3, offset=(1.0, 0.0, 0.0)))
    seen = [eye.expose(0.2 * k, HERE, GOAL, last_part=True) for k in range(4)]
    along = [each.x for each in seen if each is not None]
    assert along == pytest.approx([-3.0, -3.0, -2.0, -3.0], abs=0.03)


def test_the_board_of_another_dock_is_not_taken_for_it() -> None:
    beside = {"pose": (0.0, 1.5, 0.0), "first_marker": 20}
    measurement = camera(others=(beside,)).expose(0.0, HERE, GOAL, last_part=True)
    assert measurement is not None
    assert measurement.y == pytest.approx(GOAL.relative_to(HERE).y, abs=0.02)


def test_a_board_alone_with_other_markers_is_none() -> None:
    eye = camera(others=({"pose": (0.0, 0.0, 0.0), "first_marker": 20},))
    assert eye.expose(0.0, HERE, Pose2(0.0, 50.0, 0.0), last_part=True) is None


def test_a_nearer_board_hides_a_farther_one() -> None:
    eye = camera(others=({"pose": (1.0, 0.0, 0.0), "first_marker": 20},))
    assert eye.expose(0.0, HERE, GOAL, last_part=True) is None


def test_a_dictionary_has_so_many_markers() -> None:
    opencv_board(CharucoBoard(first_marker=40))
    with pytest.raises(ConfigError, match="the board needs 51 markers"):
        opencv_board(CharucoBoard(first_marker=41))


def test_a_board_whose_dictionary_is_too_small_is_found_before_a_run() -> None:
    CameraSection(others=(OtherBoardSection(pose=(0.0, 0.0, 0.0), first_marker=40),)).check()
    with pytest.raises(ConfigError, match="the board needs 51 markers"):
        CameraSection(others=(OtherBoardSection(pose=(0.0, 0.0, 0.0), first_marker=41),)).check()


def test_who_looks_on_sees_what_is_told() -> None:
    seen: list[CharucoDetection | None] = []

    def look(stamp: float, picture: Image, detection: CharucoDetection | None) -> None:
        seen.append(detection)

    section = CameraSection(
        exact=True, lost=(0.3, 0.5), wrong=WrongSection(after=0.6, offset=(1.0, 0.5, 0.2))
    )
    eye = ScenarioCamera.of(section, MeasurementSection(rate=5.0, visible_range=3.5), 0, look)
    places = [Pose2(5.0, 0.1, 0.02), HERE, HERE, HERE, HERE, HERE]
    told = [eye.expose(0.2 * k, place, GOAL, last_part=True) for k, place in enumerate(places)]
    assert [each is None for each in told] == [True, False, False, True, False, False]
    assert [None if each is None else each.measurement for each in seen] == told
    true, wrong = GOAL.relative_to(HERE), told[4]
    assert wrong is not None
    off = Pose2(wrong.x, wrong.y, wrong.phi).relative_to(true)
    assert (off.x, off.y, off.phi) == pytest.approx((1.0, 0.5, 0.2), abs=0.03)


def test_what_is_lost_changes_no_later_detection() -> None:
    eye, other = camera(lost=(0.1, 0.5)), camera()
    for k in range(4):
        found, whole = (each.expose(0.2 * k, HERE, GOAL, last_part=True) for each in (eye, other))
        assert (found is None) == (k in (1, 2))
    assert found is not None
    assert whole is not None
    assert (found.x, found.y, found.phi) == (whole.x, whole.y, whole.phi)


def test_a_scenario_with_a_camera_is_written_and_read_back() -> None:
    keys = {
        "board": {"x": -2, "first_marker": 5},
        "mount": {"x": -1.0, "distortion": [0.01, 0, 0, 0, 0]},
        "optics": {"noise": 2.0},
        "others": [{"pose": [4, 0, 0], "first_marker": 20}],
        "lost": [1.0, 4.0],
        "wrong": {"after": 2.0, "offset": [1.0, 0.0, 0.0]},
    }
    given = scenario(**keys)
    assert scenario_from_dict(tomllib.loads(scenario_text(given))) == given


@pytest.mark.parametrize("source", [GoalSource.RAW, GoalSource.KNOWN])
def test_the_goal_may_come_from_elsewhere(source: GoalSource) -> None:
    assert simulate(scenario(board={"x": -2.0}), seed=3, goal_source=source).ended == "docked"


def test_a_run_docks_by_its_pictures_and_is_the_same_each_time() -> None:
    first, again = (simulate(scenario(board={"x": -2.0}), seed=3) for _ in range(2))
    assert first.ended == "docked"
    assert first.tracking is not None
    assert sum(judged.accepted for judged in first.tracking.detections) > 10
    assert (first.truth.poses == again.truth.poses).all()


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"lost": [3.0, 1.0]}, "goal.camera.lost = [3.0, 1.0]: must be two times after the first detection"),
        (
            {"others": [{"pose": [0.0, 0.0, 0.0], "first_marker": 41}]},
            "goal.camera.others[0].first_marker = 41: must leave room for its 10 markers, "
            "'DICT_4X4_50' has 0 to 49",
        ),
        (
            {"board": {"first_marker": 45}},
            "goal.camera.board.first_marker = 45: must leave room for its 10 markers, "
            "'DICT_4X4_50' has 0 to 49",
        ),
        ({"others": [{"pose": [0.0, 0.0, 0.0], "first_marker": 9}]}, "must leave the markers 0 to 9 to the"),
        ({"others": [{"pose": [0.0, 0.0], "first_marker": 20}]}, "goal.camera.others[0].pose"),
        ({"others": [{"pose": [0.0, 0.0, 0.0], "first_marker": -1}]}, "must be >= 0"),
        (
            {"wrong": {"after": -1.0, "offset": [0.0, 0.0, 0.0]}},
            "goal.camera.wrong.after = -1.0: must be >= 0",
        ),
        ({"lost": [1.0, "2"]}, "goal.camera.lost[1] = '2': must be a number"),
        ({"wrong": {"after": 1.0}}, "goal.camera.wrong.offset: required"),
        ({"exact": 1}, "goal.camera.exact = 1: must be true or false"),
        ({"board": {"square": -0.1}}, "goal.camera.board.square = -0.1: must be > 0"),
        ({"board": {"x": "2"}}, "goal.camera.board.x = '2': must be a number"),
        ({"board": {"first_marker": 1.5}}, "goal.camera.board.first_marker = 1.5: must be an integer"),
        ({"board": {"first_marker": -1}}, "goal.camera.board.first_marker = -1: must be >= 0"),
        ({"board": {"marker": 0.5}}, "marker = 0.5: must be smaller than square = 0.2"),
        ({"mount": {"fx": 0.0}}, "goal.camera.mount.fx = 0.0: must be > 0"),
        ({"mount": {"fx": True}}, "goal.camera.mount.fx = True: must be a number"),
        ({"mount": {"z": float("nan")}}, "goal.camera.mount.z = nan: must be a finite number"),
        ({"mount": {"distortion": [0.0] * 4}}, "goal.camera.mount.distortion[4]: required"),
        ({"optics": {"noise": -1.0}}, "goal.camera.optics.noise = -1.0: must be >= 0"),
        (
            {"optics": {"blurred": 1.0}},
            "goal.camera.optics.blurred = 1.0: unknown key, allowed are blur, exposure",
        ),
        ({"lens": 1.0}, "goal.camera.lens = 1.0: unknown key"),
    ],
)
def test_each_bad_key_in_a_sentence(keys: dict[str, Any], said: str) -> None:
    with pytest.raises(ScenarioError) as error:
        scenario(**keys)
    assert said in str(error.value)
    assert "\n" not in str(error.value)
