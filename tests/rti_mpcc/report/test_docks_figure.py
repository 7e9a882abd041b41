"""The picture of docks shows what it promises, and nothing of it is cut off."""

from __future__ import annotations

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

from geometry import Pose2
from rti_mpcc.config import Vehicle
from rti_mpcc.model.footprint import body_polygons
from rti_mpcc.report.plan import docks_figure
from rti_mpcc.simulation import read_docks
from tests.rti_mpcc.dock_files import FIRST, SECOND, written

VEHICLE = {"docked vehicle", "approach of the rear axle", "after the contact move"}
ALL = VEHICLE | {"static obstacle", "docked object", "board"}


def figure_of(folder: Path, text: str) -> Figure:
    return docks_figure("yard", read_docks(written(folder, text)))


def drawn(axes: Axes, label: str) -> Any:
    """The corners of what has this label, the first of them."""
    shape: Any = next(one for one in axes.get_children() if one.get_label() == label)
    return np.asarray(shape.get_xydata() if isinstance(shape, Line2D) else shape.get_paths()[0].vertices)


def outline(pose: Pose2) -> Any:
    return body_polygons(np.array([[pose.x, pose.y, pose.phi]]), Vehicle())[0]


def names(axes: Axes) -> list[Annotation]:
    return [each for each in axes.texts if isinstance(each, Annotation) and each.get_text()]


def test_it_shows_the_dock_and_what_is_around_it(tmp_path: Path) -> None:
    (axes,) = figure_of(tmp_path, FIRST).axes
    assert drawn(axes, "docked vehicle")[:4] == pytest.approx(outline(Pose2(10.0, 5.0, 0.5 * pi)))
    assert drawn(axes, "after the contact move")[:4] == pytest.approx(outline(Pose2(10.0, 3.7, 0.5 * pi)))
    assert drawn(axes, "approach of the rear axle") == pytest.approx(np.array([(10.0, 7.0), (10.0, 5.0)]))
    body = np.array([(11.0, 1.0), (11.0, 2.9), (9.0, 2.9), (9.0, 1.0)])
    assert drawn(axes, "docked object")[:4] == pytest.approx(body)
    board = drawn(axes, "board")
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
