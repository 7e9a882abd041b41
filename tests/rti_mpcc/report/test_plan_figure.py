"""The picture of a planned way shows what it promises, and nothing of it is cut off."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure

from geometry import Area, Pose2, ReferencePath
from rti_mpcc.config import ControllerConfig
from rti_mpcc.model.footprint import body_polygons
from rti_mpcc.report import style
from rti_mpcc.report.plan_figure import plan_figure
from tests.rti_mpcc.planned import manoeuvre_along, no_manoeuvre

CONFIG = ControllerConfig()
HALL = Area(
    boundary=[(-5.0, -6.0), (25.0, -6.0), (25.0, 6.0), (-5.0, 6.0)],
    obstacles=[[(8.0, 3.0), (10.0, 3.0), (10.0, 5.0), (8.0, 5.0)]],
)
PATH = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.1, 6.0), (-1, -0.1, 3.0), (1, 0.0, 8.0)])
FOUND = manoeuvre_along(PATH)


@pytest.fixture(scope="module")
def figure() -> Figure:
    return plan_figure("hall", HALL, FOUND, CONFIG)


def labels(axes: Axes) -> list[str]:
    return list(axes.get_legend_handles_labels()[1])


def drawn(axes: Axes, label: str) -> Any:
    return next(one for one in axes.get_children() if one.get_label() == label)


def test_plane_shows_what_is_solid_the_ends_the_way_and_its_cusps(figure: Figure) -> None:
    axes = figure.axes[0]
    assert set(labels(axes)) == {"solid", "start", "goal", "forward", "reverse", "cusp"}
    assert axes.get_aspect() == 1.0
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("x [m]", "y [m]")
    for label, pose in (("start", PATH.start), ("goal", PATH.end)):
        shape = drawn(axes, label)
        (body,) = body_polygons(np.array([[pose.x, pose.y, pose.phi]]), CONFIG.vehicle)
        assert np.asarray(shape.get_paths()[0].vertices)[:4] == pytest.approx(body)
    cusps = [PATH.parts[0].last, PATH.parts[1].last]
    assert np.asarray(drawn(axes, "cusp").get_xydata()) == pytest.approx(
        np.array([(p.x, p.y) for p in cusps])
    )


def test_the_way_is_coloured_by_direction(figure: Figure) -> None:
    axes = figure.axes[0]
    for label, parts in (("forward", (0, 2)), ("reverse", (1,))):
        lines = drawn(axes, label)
        assert isinstance(lines, LineCollection)
        segments = [np.asarray(line) for line in lines.get_segments()]
        assert len(segments) == len(parts)
        for line, part in zip(segments, parts, strict=True):
            assert line[[0, -1]] == pytest.approx(
                np.array([(pose.x, pose.y) for pose in (PATH.parts[part].first, PATH.parts[part].last)])
            )


def test_a_body_stands_every_half_metre(figure: Figure) -> None:
    bodies = [
        len(one.get_paths())
        for one in figure.axes[0].collections
        if isinstance(one, PolyCollection) and str(one.get_label()).startswith("_")
    ]
    assert sum(bodies) == int(PATH.length / 0.5)


def test_all_that_is_driven_is_in_view(figure: Figure) -> None:
    axes = figure.axes[0]
    points = np.concatenate([np.column_stack([at.x, at.y]) for at in PATH.sample(0.1)])
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    assert (points > (left, bottom)).all()
    assert (points < (right, top)).all()


def test_curvature_and_clearance_over_the_way(figure: Figure) -> None:
    _, curvature, clearance = figure.axes
    assert (curvature.get_ylabel(), clearance.get_ylabel()) == ("curvature [1/m]", "clearance [m]")
    assert clearance.get_xlabel() == "way driven [m]"
    for axes in (curvature, clearance):
        assert axes.get_xlim() == pytest.approx((0.0, PATH.length))
        marks = [line.get_xdata()[0] for line in axes.get_lines() if line.get_linestyle() == ":"]  # type: ignore[index]
        assert marks == pytest.approx(list(PATH.cusps))
    assert set(labels(curvature)) == {"forward", "reverse", "vehicle's limit", "cusp"}
    assert set(labels(clearance)) == {"clearance", "wanted clearance", "least clearance", "cusp"}


def level(axes: Axes, label: str) -> float:
    """Where a horizontal line stands."""
    (y, _) = np.asarray(drawn(axes, label).get_ydata())
    return float(y)


def test_limits_and_margins_stand_where_they_are(figure: Figure) -> None:
    _, curvature, clearance = figure.axes
    assert level(curvature, "vehicle's limit") == pytest.approx(CONFIG.max_curvature)
    assert level(clearance, "wanted clearance") == CONFIG.clearance.on_routes
    assert level(clearance, "least clearance") == CONFIG.clearance.least
    assert curvature.get_ylim()[1] > CONFIG.max_curvature


def test_a_stop_to_steer_is_marked_as_one() -> None:
    (first,) = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 4.0)]).parts
    (second,) = ReferencePath.from_segments(first.last, [(1, 0.2, 4.0)]).parts
    path = ReferencePath(parts=(first, replace(second, knots=second.knots + 4.0)))
    figure = plan_figure("hall", HALL, manoeuvre_along(path), CONFIG)
    assert "stop to steer" in labels(figure.axes[0])
    assert "cusp" not in labels(figure.axes[0])
    assert "0 cusps" in figure.get_suptitle()


def test_where_there_is_no_way_the_plane_stands_alone() -> None:
    figure = plan_figure("hall", HALL, no_manoeuvre(PATH.start, PATH.end), CONFIG)
    (axes,) = figure.axes
    assert set(labels(axes)) == {"solid", "start", "goal"}
    assert figure.get_suptitle() == "hall: no way was found: too narrow"


FAR = Pose2(7_008_600_719.0, -8_722_360_256.0, 0.5)


@pytest.mark.parametrize(
    ("area", "path"),
    [
        (HALL, PATH),
        (HALL, ReferencePath.from_segments(Pose2(0.0, -5.0, 1.5), [(1, 0.0, 4.0)])),
        (Area(), ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 120.0)])),
        (Area(), ReferencePath.from_segments(Pose2(0.0, 0.0, 1.5708), [(-1, 0.0, 120.0)])),
        (Area().bounded([(FAR.x, FAR.y)], 15.0), ReferencePath.from_segments(FAR, [(1, 0.1, 8.0)])),
    ],
)
@pytest.mark.parametrize("found", [True, False])
def test_nothing_is_cut_off_and_legends_stand_outside(area: Area, path: ReferencePath, found: bool) -> None:
    manoeuvre = manoeuvre_along(path) if found else no_manoeuvre(path.start, path.end)
    figure = plan_figure("a_rather_long_name_of_a_scenario", area, manoeuvre, CONFIG)
    figure.set_dpi(style.DPI)
    figure.draw_without_rendering()
    whole = figure.bbox
    boxes = [one.get_tightbbox() for one in figure.axes]
    boxes += [one.get_window_extent() for one in (*figure.legends, *figure.texts)]
    for box in boxes:
        assert box is not None
        assert (box.x0 >= whole.x0, box.y0 >= whole.y0) == (True, True)
        assert (box.x1 <= whole.x1, box.y1 <= whole.y1) == (True, True)
    for axes in figure.axes:
        legend = axes.get_legend()
        assert legend is None or legend.get_window_extent().x0 >= axes.get_window_extent().x1
    (legend,) = figure.legends
    assert legend.get_window_extent().y1 <= figure.axes[0].get_window_extent().y0
