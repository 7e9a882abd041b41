"""The scene at one cycle."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from rti_mpcc.model.footprint import body_polygons
from rti_mpcc.report.ride import Ride
from rti_mpcc.report.scene import Scene, status_line
from rti_mpcc.simulation import changed, load_scenario
from tests.rti_mpcc.report.conftest import driven


@pytest.fixture
def scene(ride: Ride) -> Scene:
    return Scene(Figure().add_subplot(), ride)


def corners(shapes: Any) -> Any:
    return [np.asarray(path.vertices)[:4] for path in shapes.get_paths()]


def test_scene_shows_the_vehicle_its_plan_and_the_obstacles_of_the_cycle(scene: Scene, ride: Ride) -> None:
    scene.show(20)
    moment, vehicle = ride.moments[20], ride.config.vehicle
    states = moment.command.trajectory.states
    assert moment.goal is not None
    for shapes, pose in ((scene.body, moment.pose), (scene.goal, moment.goal)):
        assert corners(shapes) == [pytest.approx(body_polygons(pose[None], vehicle)[0])]
    assert corners(scene.plan_bodies)[-1] == pytest.approx(body_polygons(states[-1:], vehicle)[0])
    assert np.asarray(scene.plan.get_xydata()) == pytest.approx(states[:, :2])
    assert len(np.asarray(scene.driven.get_xdata())) == 21
    assert len(scene.obstacles.get_paths()) == 1
    assert scene.status.get_text() == status_line(moment) == "2.0 s: arriving (solution)"


def test_scene_in_an_area_shows_the_route_of_the_cycle() -> None:
    scenario = changed(load_scenario("bay_perpendicular"), {"simulation.duration": 1.0})
    ride = driven(scenario)[1]
    scene = Scene(Figure().add_subplot(), ride)
    scene.show(0)
    assert len(scene.route.get_segments()) == 0
    scene.show(len(ride.moments) - 1)
    route = ride.moments[-1].route
    assert route is not None
    ends = [np.asarray(line)[-1] for line in scene.route.get_segments()]
    assert ends == [pytest.approx((part.last.x, part.last.y)) for part in route.parts]
    labels = set(scene.axes.get_legend_handles_labels()[1])
    assert {"static obstacle", "route"} <= labels
    assert "corridor" not in labels
