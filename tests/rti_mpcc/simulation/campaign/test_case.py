"""A case follows from campaign, index and nothing else, and whatever happens to it is a row."""

from __future__ import annotations

import json
import tomllib

import pytest

from benchmarks.problems.courses import CAMPAIGN, drawn_course
from benchmarks.problems.scenes import drawn_scene
from rti_mpcc.errors import InputError
from rti_mpcc.simulation import changed, scenario_from_dict, scenario_text
from rti_mpcc.simulation.batch import Case, drive
from rti_mpcc.simulation.campaign import CampaignCase, Level, Problems
from rti_mpcc.simulation.campaign.case import DIED, MOST, died_lines, drive_case, driven_lines
from rti_mpcc.simulation.campaign.row import row_of
from tests.rti_mpcc.simulation.campaign import drives


def case(index: int = 3, seed: int = 11, level: Level = Level.HARD) -> CampaignCase:
    return CampaignCase(seed=seed, level=level, index=index)


def test_a_case_is_named_like_its_scenario() -> None:
    assert case().name == case().scenario().name == "campaign_11_03_hard"
    assert case().scenario().path == drawn_course(11, 3, CAMPAIGN).path


@pytest.mark.parametrize("level", Level)
@pytest.mark.parametrize("index", [1, 12])
def test_a_case_may_be_a_scene(index: int, level: Level) -> None:
    one = CampaignCase(seed=11, level=level, index=index, problems=Problems.SCENES)
    scenario, scene = one.scenario(), drawn_scene(11, index)
    assert one.name == scenario.name == f"{scene.name}_{level.value}"
    assert scenario == one.scenario()
    assert (scenario.start_pose(), scenario.goal_pose()) == (scene.start, scene.goal)
    assert scenario.area is not None
    assert len(scenario.area.obstacles) == len(scene.obstacles)


def test_a_case_may_have_a_deadline() -> None:
    plain = CampaignCase(seed=11, level=Level.HARD, index=3)
    hurried = CampaignCase(seed=11, level=Level.HARD, index=3, deadline=0.02)
    assert plain.scenario().controller.deadline is None
    assert hurried.scenario() == changed(plain.scenario(), {"controller.deadline": 0.02})


def test_every_case_has_noise_of_its_own() -> None:
    cases = [case(index, seed) for seed in (0, 1, 2) for index in (0, 1, MOST - 1)]
    assert len({one.run_seed for one in cases}) == 9
    assert case(7, 1).run_seed == 1000007


@pytest.mark.parametrize(
    ("index", "seed", "message"),
    [
        (0, -1, "seed = -1: must be >= 0"),
        (-1, 0, "index = -1: must be >= 0 and < 1000000"),
        (MOST, 0, f"index = {MOST}"),
    ],
)
def test_what_is_no_case_is_refused(index: int, seed: int, message: str) -> None:
    with pytest.raises(InputError, match=message):
        case(index, seed)


def test_the_saved_scenario_is_driven_to_the_same_row() -> None:
    one = case()
    read = changed(
        scenario_from_dict(tomllib.loads(scenario_text(one.scenario()))), {"simulation.duration": 0.5}
    )
    again = row_of(one.index, drive(Case(scenario=read, seed=one.run_seed)))
    assert driven_lines(drives.short, one).row == again.line()


def test_the_real_drive_is_of_the_drawn_scenario(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Case] = []

    def drive(what: Case) -> None:
        asked.append(what)
        raise KeyError("enough")

    monkeypatch.setattr("rti_mpcc.simulation.campaign.case.drive", drive)
    one = CampaignCase(seed=11, level=Level.NOISY, index=3, method="switched", preset="paper")
    with pytest.raises(KeyError, match="enough"):
        drive_case(one)
    assert asked == [Case(scenario=one.scenario(), method="switched", preset="paper", seed=11000003)]


def test_an_exception_is_a_row_that_tells_it() -> None:
    table = json.loads(driven_lines(drives.troubled, case(1)).row)
    assert table["outcome"] == "raised"
    assert table["detail"] == "ZeroDivisionError: case 1 of <object object>"
    assert table["course"]["pieces"] > 0
    assert table["disturbances"]["acceleration_gain"] != 1.0
    assert table["figures"] is None
    assert json.loads(driven_lines(drives.troubled, case(4)).row)["detail"] == "SystemExit: 3"


def test_figures_that_are_no_numbers_are_an_exception() -> None:
    table = json.loads(driven_lines(drives.without_figures, case()).row)
    assert (table["outcome"], table["figures"]) == ("raised", None)
    assert table["detail"].startswith("ValueError: Out of range float values")


def test_a_course_that_cannot_be_drawn_is_a_row_without_one(monkeypatch: pytest.MonkeyPatch) -> None:
    def none(seed: int, index: int, within: object) -> None:
        raise InputError(f"course {index} of seed {seed}: none of 200 draws can be docked in")

    monkeypatch.setattr("rti_mpcc.simulation.campaign.case.drawn_course", none)
    table = json.loads(driven_lines(drive_case, case()).row)
    assert table["outcome"] == "raised"
    assert table["detail"] == "InputError: course 3 of seed 11: none of 200 draws can be docked in"
    assert (table["scenario"], table["course"], table["disturbances"]) == ("campaign_11_03_hard", None, None)


def test_a_case_that_ended_its_worker_is_a_row() -> None:
    table = json.loads(died_lines(case()).row)
    assert (table["outcome"], table["detail"], table["figures"]) == ("worker_died", DIED, None)
    assert table["course"] is not None
    bare = json.loads(died_lines(case(), drawn=False).row)
    assert table | {"course": None, "disturbances": None} == bare
