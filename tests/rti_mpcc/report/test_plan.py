"""A planned route: its rows, its files, and its picture."""

from __future__ import annotations

import json
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.text import Annotation

from geometry import Area, Pose2, ReferencePath
from rti_mpcc.config import ControllerConfig, Vehicle
from rti_mpcc.manoeuvre import Manoeuvre
from rti_mpcc.model.footprint import body_of, body_polygons
from rti_mpcc.report.plan import SPACING, docks_figure, plan_figure, route_rows, write_plan
from rti_mpcc.simulation import read_docks
from tests.rti_mpcc.dock_files import FIRST, SECOND, written
from tests.rti_mpcc.planned import manoeuvre_along, no_manoeuvre
from tests.rti_mpcc.report.test_pictures import assert_nothing_is_cut_off, drawn

CONFIG = ControllerConfig()
START = Pose2(1.0, 2.0, 0.3)
PATH = ReferencePath.from_segments(START, [(1, 0.1, 4.0), (1, 0.0, 1.02), (-1, -0.2, 3.0), (1, 0.0, 2.0)])
FOUND, IN_VAIN = manoeuvre_along(PATH), no_manoeuvre(START, PATH.end)
HALL = Area(
    boundary=[(-15.0, -16.0), (25.0, -16.0), (25.0, 16.0), (-15.0, 16.0)],
    obstacles=[[(8.0, 13.0), (10.0, 13.0), (10.0, 15.0), (8.0, 15.0)]],
)


def files(folder: Path, manoeuvre: Manoeuvre, area: Area = HALL) -> tuple[Any, list[str]]:
    """plan.json, and the lines of route.csv."""
    figures, written = write_plan("yard", manoeuvre, area, CONFIG, folder)
    assert [file.name for file in written] == ["plan.json", "route.csv", "plan.png"]
    assert written[2].read_bytes().startswith(b"\x89PNG")
    assert json.loads(written[0].read_text()) == figures
    return figures, written[1].read_text().splitlines()


def test_rows_follow_the_route() -> None:
    rows = route_rows(FOUND)
    poses = np.column_stack([rows["x"], rows["y"], rows["heading"]])
    assert rows["s"][[0, -1]] == pytest.approx([0.0, PATH.length])
    steps = np.diff(rows["s"])
    assert 0.0 <= steps.min() <= steps.max() <= SPACING + 1e-12
    assert poses[0] == pytest.approx((START.x, START.y, START.phi))
    assert poses[-1] == pytest.approx((PATH.end.x, PATH.end.y, PATH.end.phi))
    assert np.hypot(*np.diff(poses[:, :2], axis=0).T) == pytest.approx(steps, abs=1e-5)
    kinds = set(zip(rows["segment"].tolist(), rows["direction"].tolist(), strict=True))
    assert kinds == {(0.0, 1.0), (1.0, -1.0), (2.0, 1.0)}
    for segment, least, most in ((0, 0.0, 0.1), (1, -0.2, -0.2), (2, 0.0, 0.0)):
        curvature = rows["curvature"][rows["segment"] == segment]
        assert (curvature.min(), curvature.max()) == pytest.approx((least, most))
    ends = np.flatnonzero(np.diff(rows["segment"]))
    assert rows["s"][ends] == pytest.approx(PATH.cusps)
    assert poses[ends] == pytest.approx(poses[ends + 1])


def test_files_of_a_route(tmp_path: Path) -> None:
    figures, (header, *lines) = files(tmp_path, FOUND)
    assert header == "s,x,y,heading,curvature,direction,segment"
    table = np.array([[float(cell) for cell in line.split(",")] for line in lines])
    assert table == pytest.approx(np.column_stack(list(route_rows(FOUND).values())), abs=1e-6)
    poses = np.column_stack([table[:, 1], table[:, 2], table[:, 3]])
    clearance = float(HALL.signed_distances(body_of(CONFIG.vehicle), poses).min())
    assert figures.pop("min_clearance_m") == pytest.approx(clearance, abs=0.01)
    told = {"found": True, "seconds": 0.25, "length_m": pytest.approx(10.02), "cusps": 2, "nodes": 42}
    assert figures == told


def test_route_far_from_the_origin_keeps_its_digits(tmp_path: Path) -> None:
    far = Pose2(7_008_600_719.29408, -8_722_360_256.93465, 0.0)
    straight, area = ReferencePath.from_segments(far, [(1, 0.0, 2.0)]), Area().bounded([(far.x, far.y)], 15.0)
    _, lines = files(tmp_path, manoeuvre_along(straight), area)
    assert [float(cell) for cell in lines[1].split(",")[1:3]] == [far.x, far.y]


@pytest.fixture(scope="module")
def figure() -> Figure:
    return plan_figure("hall", HALL, FOUND, CONFIG)


def labels(axes: Axes) -> set[str]:
    return set(axes.get_legend_handles_labels()[1])


def test_plane_shows_obstacles_ends_route_and_cusps(figure: Figure) -> None:
    axes = figure.axes[0]
    assert labels(axes) == {"static obstacle", "start", "goal", "forward", "reverse", "cusp"}
    assert (axes.get_xlabel(), axes.get_ylabel(), axes.get_aspect()) == ("x [m]", "y [m]", 1.0)
    for label, pose in (("start", PATH.start), ("goal", PATH.end)):
        (body,) = body_polygons(np.array([[pose.x, pose.y, pose.phi]]), Vehicle())
        assert np.asarray(drawn(figure, label).get_paths()[0].vertices)[:4] == pytest.approx(body)
    cusps = np.array([(part.last.x, part.last.y) for part in PATH.parts[:2]])
    assert np.asarray(drawn(figure, "cusp").get_offsets()) == pytest.approx(cusps)
    (reverse,) = (line for line in axes.get_lines() if line.get_label() == "reverse")
    ends = np.array([(pose.x, pose.y) for pose in (PATH.parts[1].first, PATH.parts[1].last)])
    assert np.asarray(reverse.get_xydata())[[0, -1]] == pytest.approx(ends)
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    for at in PATH.sample(0.1):
        assert (left < at.x.min(), at.x.max() < right) == (True, True)
        assert (bottom < at.y.min(), at.y.max() < top) == (True, True)


def test_where_there_is_no_route_the_plane_stands_alone() -> None:
    figure = plan_figure("hall", HALL, IN_VAIN, CONFIG)
    (axes,) = figure.axes
    assert labels(axes) == {"static obstacle", "start", "goal"}
    assert figure.get_suptitle() == "hall: no route was found: too narrow"


FAR = Pose2(7_008_600_719.0, -8_722_360_256.0, 0.5)


@pytest.mark.parametrize(
    ("area", "path"),
    [
        (HALL, PATH),
        (Area(), ReferencePath.from_segments(Pose2(0.0, 0.0, 1.5708), [(-1, 0.0, 120.0)])),
        (Area().bounded([(FAR.x, FAR.y)], 15.0), ReferencePath.from_segments(FAR, [(1, 0.1, 8.0)])),
    ],
)
@pytest.mark.parametrize("found", [True, False])
def test_nothing_is_cut_off(area: Area, path: ReferencePath, found: bool) -> None:
    manoeuvre = manoeuvre_along(path) if found else no_manoeuvre(path.start, path.end)
    assert_nothing_is_cut_off(plan_figure("a_rather_long_name_of_a_scenario", area, manoeuvre, CONFIG))


# -- the picture of a docks file -----------------------------------------------------------------------------

VEHICLE = {"docked vehicle", "approach of the rear axle", "after the contact move"}
ALL = VEHICLE | {"static obstacle", "docked object", "board"}


def figure_of(folder: Path, text: str) -> Figure:
    return docks_figure("yard", read_docks(written(folder, text)))


def shape(axes: Axes, label: str) -> Any:
    """The corners of what has this label, the first of them."""
    found: Any = next(one for one in axes.get_children() if one.get_label() == label)
    return np.asarray(found.get_xydata() if isinstance(found, Line2D) else found.get_paths()[0].vertices)


def outline(pose: Pose2) -> Any:
    return body_polygons(np.array([[pose.x, pose.y, pose.phi]]), Vehicle())[0]


def names(axes: Axes) -> list[Annotation]:
    return [each for each in axes.texts if isinstance(each, Annotation) and each.get_text()]


def test_it_shows_the_dock_and_what_is_around_it(tmp_path: Path) -> None:
    (axes,) = figure_of(tmp_path, FIRST).axes
    assert shape(axes, "docked vehicle")[:4] == pytest.approx(outline(Pose2(10.0, 5.0, 0.5 * pi)))
    assert shape(axes, "after the contact move")[:4] == pytest.approx(outline(Pose2(10.0, 3.7, 0.5 * pi)))
    assert shape(axes, "approach of the rear axle") == pytest.approx(np.array([(10.0, 7.0), (10.0, 5.0)]))
    body = np.array([(11.0, 1.0), (11.0, 2.9), (9.0, 2.9), (9.0, 1.0)])
    assert shape(axes, "docked object")[:4] == pytest.approx(body)
    board = shape(axes, "board")
    assert board[:, 1] == pytest.approx([2.9, 2.9])
    assert sorted(board[:, 0]) == pytest.approx([9.5, 10.5])


def test_scale_labels_and_legend(tmp_path: Path) -> None:
    area = "[area]\nboundary = [[0, 0], [30, 0], [30, 20], [0, 20]]\n"
    figure = figure_of(tmp_path, FIRST + SECOND + area)
    (axes,) = figure.axes
    assert axes.get_aspect() == 1.0
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("x [m]", "y [m]")
    assert axes.get_title() == "yard"
    assert [each.get_text() for each in names(axes)] == ["first", "second"]
    (legend,) = figure.legends
    told = [text.get_text() for text in legend.get_texts()]
    assert len(told) == len(ALL)
    assert set(told) == ALL


def heading(degrees: float) -> str:
    pose = f"pose = [20, 5, {np.radians(degrees)}]"
    return SECOND.replace("pose = [20, 5, 0]", pose).replace("second", "a_dock_of_a_rather_long_name")


@pytest.mark.parametrize("degrees", [0.0, 20.0, 50.0, 90.0, 130.0, 180.0, -130.0, -90.0, -50.0])
def test_names_stand_before_the_vehicle_and_nothing_is_cut_off(tmp_path: Path, degrees: float) -> None:
    area = "[area]\nboundary = [[14, -1], [26, -1], [26, 11], [14, 11]]\n"
    figure = figure_of(tmp_path, heading(degrees) + area)
    figure.draw_without_rendering()
    (axes,) = figure.axes
    (name,) = names(axes)
    box, whole = name.get_window_extent(), figure.bbox
    assert whole.x0 <= box.x0 < box.x1 <= whole.x1
    assert whole.y0 <= box.y0 < box.y1 <= whole.y1
    body = shapely.Polygon(axes.transData.transform(outline(Pose2(20.0, 5.0, float(np.radians(degrees))))))
    assert not body.intersects(shapely.box(box.x0, box.y0, box.x1, box.y1))
    for part in (axes.title, axes.xaxis.label, axes.yaxis.label, *figure.legends):
        extent = part.get_window_extent()
        assert whole.x0 <= extent.x0 < extent.x1 <= whole.x1
        assert whole.y0 <= extent.y0 < extent.y1 <= whole.y1
