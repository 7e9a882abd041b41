"""Overview and timeline show what they promise, and nothing is cut off."""

from __future__ import annotations

from dataclasses import replace
from io import BytesIO
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from PIL import Image

from estimation import GoalStatus
from geometry import Pose2, ReferencePath
from rti_mpcc.model.footprint import body_polygons
from rti_mpcc.report import draw
from rti_mpcc.report.overview import overview_figure
from rti_mpcc.report.ride import Ride, ride_of_run
from rti_mpcc.report.timeline import GOAL_ROWS, timeline_figure
from rti_mpcc.simulation import GoalSource, RunResult, scenario_from_dict, simulate, summary
from rti_mpcc.types import Status
from tests.rti_mpcc.planned import OnPlannedPath
from tests.rti_mpcc.report.conftest import driven
from tests.rti_mpcc.short_missions import short
from tests.rti_mpcc.simulation.conftest import area_tables

MOTION = [
    "speed\n[m/s]",
    "steering\n[rad]",
    "acceleration\n[m/s²]",
    "lateral acceleration\n[m/s²]",
    "steering rate\n[rad/s]",
    "progress\n[m]",
]
COMPUTING = "time a cycle\n[ms]"
PATH = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.05, 6.0), (-1, 0.0, 4.0)])
OTHER = ReferencePath.from_segments(Pose2(0.5, 0.0, 0.0), [(1, 0.0, 6.0)])
WALL = np.array([[14.0, -3.0], [14.5, -3.0], [14.5, -2.0], [14.0, -2.0]])
HALL = area_tables() | {
    "goal": {"pose": [PATH.end.x, PATH.end.y, PATH.end.phi]},
    "simulation": {"duration": 2.0, "cycle": 0.1},
}


@pytest.fixture(scope="module")
def hall() -> Ride:
    """A ride in an area in which something comes."""
    scenario = scenario_from_dict(HALL)
    controller = OnPlannedPath(PATH, scenario.controller_config())
    obstacles_at = lambda now: [WALL] if now > 0.95 else []  # noqa: E731
    return ride_of_run(simulate(scenario, controller=controller, obstacles_at=obstacles_at))


@pytest.fixture(scope="module")
def mission() -> tuple[RunResult, Ride]:
    return driven(short())


def assert_nothing_is_cut_off(figure: Figure) -> None:
    """The edges of its picture are white: tight pictures have a rim around all that is drawn."""
    stream = BytesIO()
    draw.save(figure, stream)
    picture = np.asarray(Image.open(stream).convert("L"))
    for edge in (picture[0], picture[-1], picture[:, 0], picture[:, -1]):
        assert edge.min() == 255


def labels(where: Axes | Figure) -> list[str]:
    """The entries of a legend."""
    legend = where.legends[0] if isinstance(where, Figure) else where.get_legend()
    assert legend is not None
    return [text.get_text() for text in legend.get_texts()]


def drawn(figure: Figure, label: str) -> Any:
    return next(one for one in figure.axes[0].get_children() if one.get_label() == label)


def body_at(ride: Ride, pose: Any) -> Any:
    return body_polygons(np.asarray(pose)[None], ride.config.vehicle)[0]


def test_overview_shows_path_corridor_bodies_goal_and_obstacles(ride: Ride) -> None:
    figure = overview_figure(ride)
    (axes,) = figure.axes
    shown = {"path", "corridor", "obstacle", "goal", "body each second", "body at the end"}
    assert shown <= set(labels(figure))
    assert (axes.get_xlabel(), axes.get_ylabel(), axes.get_aspect()) == ("x [m]", "y [m]", 1.0)
    # At 0, 1, 2, 3 s and at the end.
    assert len(drawn(figure, "body each second").get_paths()) == 5
    for line in ride.corridor.lines(1)[0] if ride.corridor else ():
        assert axes.get_xlim()[0] <= line[:, 0].min() <= line[:, 0].max() <= axes.get_xlim()[1]


def test_each_goal_is_drawn_at_its_place(detected: tuple[RunResult, Ride]) -> None:
    result, ride = detected
    figure = overview_figure(ride)
    first, last = result.truth.goals[0], result.truth.goals[-1]
    planned = Pose2(*first.tolist()).compose(Pose2(0.4, -0.3, 0.1))
    poses = {"goal before it moved": first, "goal": last, "planned goal": (planned.x, planned.y, planned.phi)}
    for label, pose in poses.items():
        (path,) = drawn(figure, label).get_paths()
        assert np.asarray(path.vertices)[:4] == pytest.approx(body_at(ride, pose))
    for accepted, label in ((True, "detection, accepted"), (False, "detection, rejected")):
        known = [each.pose for each in ride.detections if each.accepted is accepted and each.pose]
        expected = np.array([(pose.x, pose.y) for pose in known])
        assert np.asarray(drawn(figure, label).get_offsets()) == pytest.approx(expected)


def test_overview_in_an_area_shows_static_and_other_obstacles_and_routes(hall: Ride) -> None:
    figure = overview_figure(hall)
    bodies = {
        "body each second",
        "rear axle, driven",
        "body at the start, heading",
        "body at the end",
        "goal",
    }
    bodies |= {"direction of motion"} if abs(hall.motion.v).max() > 1.0 else set()
    assert set(labels(figure)) == bodies | {"static obstacle", "obstacle", "route"}
    (outline,) = drawn(figure, "obstacle").get_paths()
    assert np.asarray(outline.vertices)[:4] == pytest.approx(WALL)
    (left, right), (bottom, top) = figure.axes[0].get_xlim(), figure.axes[0].get_ylim()
    assert -6.0 <= left < hall.motion.poses[:, 0].min()
    assert (right <= 26.0, bottom >= -7.0, top <= 7.0) == (True, True, True)
    replanned = replace(hall, routes=((0.0, PATH), (0.5, OTHER), (1.0, PATH)))
    assert {"route", "earlier route"} <= set(labels(overview_figure(replanned)))
    assert not {"route", "earlier route"} & set(labels(overview_figure(replace(hall, routes=()))))


def test_status_comfort_and_changing_weights_are_shown(ride: Ride, figures: dict[str, Any]) -> None:
    """The band has each status from its first cycle on; lines leave the curves visible."""
    first, *others = ride.moments
    other = replace(first.command, status=Status.BLOCKED)
    weights = replace(first.command.diagnostics.weights, goal_position=1.0)
    changed = replace(first.command, diagnostics=replace(first.command.diagnostics, weights=weights))
    blocked = replace(ride, moments=(replace(first, command=other), *others))
    figure = timeline_figure(blocked, figures)
    assert labels(figure.axes[0])[0] == "blocked"
    span = figure.axes[0].patches[0].get_extents().transformed(figure.axes[0].transData.inverted())
    assert (span.x0, span.x1) == pytest.approx((0.0, others[0].time), abs=1e-6)
    assert {"comfort", "commanded"} <= set(labels(figure.axes[3]))
    assert "limit" not in labels(figure.axes[3])
    weighed = timeline_figure(replace(ride, moments=(replace(first, command=changed), *others)), figures)
    assert "effective\nweights" in [axes.get_ylabel() for axes in weighed.axes]


def test_timeline_shares_its_time_axis_and_names_units(ride: Ride, figures: dict[str, Any]) -> None:
    figure = timeline_figure(ride, figures)
    assert [axes.get_ylabel() for axes in figure.axes] == ["status", *MOTION, COMPUTING]
    assert {axes.get_xlim() for axes in figure.axes} == {(0.0, ride.end)}
    assert figure.axes[-1].get_xlabel() == "time [s]"


@pytest.mark.parametrize("which", ["run", "mission"])
def test_nothing_of_the_written_pictures_is_cut_off(
    which: str, ride: Ride, mission: tuple[RunResult, Ride]
) -> None:
    shown = ride if which == "run" else mission[1]
    for figure in (overview_figure(shown), timeline_figure(shown, {"time_to_dock_s": 1.0})):
        assert_nothing_is_cut_off(figure)


# The goal's rows: GOAL is the true one, and looks along y.
GOAL = Pose2(20.0, -3.0, 0.5 * np.pi)


def test_goal_rows_are_there_where_a_filter_was_in_use(detected: tuple[RunResult, Ride]) -> None:
    ride = detected[1]
    figure = timeline_figure(ride, summary(detected[0]))
    assert [axes.get_ylabel() for axes in figure.axes] == ["status", *MOTION, *GOAL_ROWS, COMPUTING]
    known = {"± 3 sigma", "goal setpoint", "estimate", "goal tolerance"}
    given = {"accepted", "rejected", "rejected, farther off", *(status.value for status in GoalStatus)}
    assert set(labels(figure.axes[7])) >= known | given
    assert len(labels(figure.axes[7])) == len(set(labels(figure.axes[7])))
    spans = [
        patch.get_extents().transformed(figure.axes[8].transData.inverted())
        for patch in figure.axes[8].patches
    ]
    goals = [moment.command.diagnostics.goal for moment in ride.moments]
    statuses = [goal and goal.status for goal in goals]
    starts = [ride.moments[statuses.index(status)].time for status in GoalStatus]
    assert [span.x0 for span in spans] == pytest.approx(starts, abs=1e-6)
    assert [span.x1 for span in spans] == pytest.approx([*starts[1:], ride.end], abs=1e-6)
    raw = ride_of_run(replace(detected[0], goal_source=GoalSource.RAW), ride.moments)
    assert [axes.get_ylabel() for axes in timeline_figure(raw, {}).axes] == ["status", *MOTION, COMPUTING]


def test_steps_of_a_mission_are_bands_with_names(mission: tuple[RunResult, Ride]) -> None:
    result, ride = mission
    figure = timeline_figure(ride, summary(result))
    assert [text.get_text() for text in figure.axes[0].texts] == ["dock", "wait", "straight"]
    marks = {"step, succeeded", "end of a wait", "inside tolerance", "docked"}
    assert set(labels(figure.axes[1])) == marks | {"true"}
    assert not set(labels(figure.axes[3])) & marks
    assert [len(axes.patches) for axes in figure.axes[1:]] == [3, 3, 3, *[0] * (len(figure.axes) - 4)]
