"""The scene at one cycle, the window that shows it, and its camera."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import cv2
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from rti_mpcc.model.footprint import body_polygons
from rti_mpcc.report.ride import Ride
from rti_mpcc.report.scene import CameraView, Scene, status_line
from rti_mpcc.report.viewer import Viewer
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


def test_front_wheel_is_turned(scene: Scene, ride: Ride) -> None:
    moment = replace(
        ride.moments[0], pose=np.array([1.0, 2.0, 0.5]), state=replace(ride.moments[0].state, delta=0.3)
    )
    scene.ride = replace(ride, moments=(moment,))
    scene.show(0)
    ends = np.asarray(scene.wheel.get_xydata())
    axle = 2.875 * np.array([np.cos(0.5), np.sin(0.5)]) + (1.0, 2.0)
    assert ends.mean(axis=0) == pytest.approx(axle)
    assert np.arctan2(*(ends[1] - ends[0])[::-1]) == pytest.approx(0.8)


def test_boundaries_of_the_active_segment_are_apart_and_all_is_in_view(scene: Scene, ride: Ride) -> None:
    assert ride.corridor is not None
    scene.show(0)
    lines = [line for side in ride.corridor.lines(0) for line in side]
    assert [len(each) for each in scene.walls.get_segments()] == [len(line) for line in lines]
    labels = set(scene.axes.get_legend_handles_labels()[1])
    assert {"path", "corridor", "corridor, other segment", "end of the segment", "predicted"} <= labels
    assert scene.axes.get_aspect() == 1.0
    (left, right), (bottom, top) = scene.axes.get_xlim(), scene.axes.get_ylim()
    for line in lines:
        assert ((line > (left, bottom)) & (line < (right, top))).all()


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


def test_camera_shows_its_last_picture() -> None:
    frames = [
        (stamp, cv2.imencode(".jpg", np.full((6, 8, 3), grey, np.uint8))[1].tobytes())
        for stamp, grey in ((1.0, 0), (2.0, 100))
    ]
    axes = Figure().add_subplot()
    view = CameraView(axes, frames)
    for time, grey in ((0.5, None), (1.0, 0), (1.9, 0), (5.0, 100)):
        view.show(time)
        word, image = axes.texts[0].get_text(), axes.images[0]
        assert word == ("no picture yet" if grey is None else "")
        assert image.get_alpha() == (0.0 if grey is None else 1.0)
        if grey is not None:
            assert abs(int(np.asarray(image.get_array()).max()) - grey) <= 2


def test_slider_shows_a_cycle(ride: Ride) -> None:
    figure = Figure(layout="constrained")
    FigureCanvasAgg(figure)
    viewer = Viewer(figure, ride)
    viewer.slider.set_val(1.04)
    assert viewer.index == 10
    assert viewer.scene.status.get_text() == status_line(ride.moments[10])
    assert viewer.text.get_text().startswith("cycle 11 of 33, ")
    assert {cursor.get_xdata()[0] for cursor in viewer.cursors} == {ride.moments[10].time}
