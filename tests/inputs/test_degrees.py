"""A heading in degrees is asked about wherever a pose comes in."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any

import pytest

from geometry import Area, Pose2
from rti_mpcc import DockingController, DockingMission, DriveTo, ScenarioError, VehicleState, plan_manoeuvre
from rti_mpcc.simulation.docks_file import load_docks
from rti_mpcc.simulation.scenario import scenario_from_dict
from tests.rti_mpcc.simulation.conftest import area_tables
from tests.rti_mpcc.yards import block

ASKED = "in degrees?"
AREA = Area(boundary=block(-20.0, -20.0, 20.0, 20.0))


@pytest.mark.parametrize(("phi", "asked"), [(90.0, True), (-180.0, True), (1.57, False), (6.2, False)])
def test_of_a_goal_in_an_area(phi: float, asked: bool) -> None:
    controller = DockingController.in_area(AREA)
    command = controller.step(VehicleState(0.0, 0.0, 0.0, 0.0, 0.0), now=0.0, goal=Pose2(5.0, 0.0, phi))
    assert (f"goal heading {phi:.6g}: {ASKED}" in command.diagnostics.reason) is asked


def test_of_a_measured_state_in_an_area() -> None:
    controller = DockingController.in_area(AREA)
    command = controller.step(VehicleState(0.0, 0.0, 90.0, 0.0, 0.0), now=0.0, goal=Pose2(5.0, 0.0, 0.0))
    assert f"heading 90: {ASKED}" in command.diagnostics.reason


@pytest.mark.parametrize(("start", "goal", "name"), [(90.0, 0.0, "start.phi"), (0.0, 90.0, "goal.phi")])
def test_of_a_plan(caplog: pytest.LogCaptureFixture, start: float, goal: float, name: str) -> None:
    plan_manoeuvre(Pose2(0.0, 0.0, start), Pose2(0.1, 0.0, goal), AREA)
    assert f"{name} 90: {ASKED}" in caplog.text


def test_of_steps(caplog: pytest.LogCaptureFixture) -> None:
    controller = DockingController.in_area(AREA)
    DockingMission(controller, [DriveTo(Pose2(5.0, 0.0, 90.0))], home=Pose2(0.0, 0.0, 180.0))
    assert f"steps[0].pose.phi 90: {ASKED}" in caplog.text
    assert f"home.pose.phi 180: {ASKED}" in caplog.text


@pytest.mark.parametrize(
    ("changes", "key"),
    [
        ({"start": {"pose": [0.0, 0.0, 90.0]}}, "start.pose[2]"),
        ({"goal": {"pose": [5.0, 0.0, 90.0]}}, "goal.pose[2]"),
    ],
)
def test_of_scenario_files(caplog: pytest.LogCaptureFixture, changes: dict[str, Any], key: str) -> None:
    with caplog.at_level(logging.WARNING):
        scenario_from_dict({**area_tables(), **changes})
    assert f"{key} 90: {ASKED}" in caplog.text


def test_of_docks(tmp_path: Path) -> None:
    file = tmp_path / "docks.toml"
    file.write_text('[[dock]]\nname = "A"\npose = [5.0, 0.0, 90.0]\n', encoding="utf-8")
    with pytest.raises(ScenarioError, match=r"pose\[2\] = 90\.0: .* in degrees\?"):
        load_docks(file)
