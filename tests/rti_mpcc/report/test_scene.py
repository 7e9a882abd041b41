"""The scene of a cycle, and the bars of its weights, by what is drawn."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure

from rti_mpcc.model.footprint import body_polygons
from rti_mpcc.report.bars import WeightBars
from rti_mpcc.report.film import Film
from rti_mpcc.report.scene import NORMAL, PLANE, Scene, extent, plane_lines
from rti_mpcc.report.views import ActivePlanes
from rti_mpcc.types import Array, EffectiveWeights


@pytest.fixture
def scene(film: Film) -> Scene:
    return Scene(Figure().add_subplot(), film)


def corners(shapes: PolyCollection) -> Array:
    """(k, 4, 2) of quadrangles."""
    return np.array([np.asarray(path.vertices)[:4] for path in shapes.get_paths()]).reshape(-1, 4, 2)


def lines(drawn: LineCollection) -> list[Array]:
    return [np.asarray(line) for line in drawn.get_segments()]


@pytest.mark.parametrize("index", [0, 12, 32])
def test_what_moves_is_where_the_cycle_has_it(film: Film, scene: Scene, index: int) -> None:
    scene.show(index)
    view, vehicle = film.views[index], film.config.vehicle
    plan = view.observed.command.trajectory
    assert view.goal is not None
    for shapes, pose in ((scene.body, view.pose), (scene.aim, view.aim), (scene.goal, view.goal)):
        assert corners(shapes) == pytest.approx(body_polygons(pose[None], vehicle))
    assert np.asarray(scene.plan.get_xydata()) == pytest.approx(plan.states[:, :2])
    driven = np.array([one.pose[:2] for one in film.views[: index + 1]])
    assert np.asarray(scene.driven.get_xydata()) == pytest.approx(driven)
    bodies = corners(scene.plan_bodies)
    assert bodies[-1] == pytest.approx(body_polygons(plan.states[-1:], vehicle)[0])
    assert len(bodies) == 6


def test_boundaries_of_the_active_part_stand_out(film: Film, scene: Scene) -> None:
    scene.show(len(film.views) - 1)
    assert film.views[-1].observed.command.diagnostics.part == 0
    assert film.corridor is not None
    left, right = film.corridor.lines(0)
    assert all((one == other).all() for one, other in zip(lines(scene.walls), [*left, *right], strict=True))


def test_wheel_stands_at_the_front_axle_and_is_turned(film: Film) -> None:
    view = film.views[-1]
    pose = np.array([1.0, 2.0, 0.5 * np.pi])
    observed = replace(view.observed, state=replace(view.observed.state, delta=0.25 * np.pi))
    turned = Scene(
        Figure().add_subplot(), replace(film, views=(replace(view, pose=pose, observed=observed),))
    )
    behind, ahead = np.asarray(turned.wheel.get_xydata())
    assert 0.5 * (behind + ahead) == pytest.approx((1.0, 2.0 + film.config.vehicle.wheelbase))
    assert np.arctan2(*(ahead - behind)[::-1]) == pytest.approx(0.75 * np.pi)


def test_half_planes_are_edges_with_their_normals(film: Film) -> None:
    points, normals = np.array([[1.0, 2.0], [-3.0, 4.0]]), np.array([[0.0, 1.0], [0.6, -0.8]])
    planes = ActivePlanes(points=points, normals=normals)
    views = (replace(film.views[0], planes=planes), film.views[1])
    assert not len(views[1].planes.points)
    scene = Scene(Figure().add_subplot(), replace(film, views=views))
    scene.show(0)
    for edge, normal, point, inward in zip(
        lines(scene.planes), lines(scene.normals), planes.points, planes.normals, strict=True
    ):
        assert edge.mean(axis=0) == pytest.approx(point)
        assert np.linalg.norm(edge[1] - edge[0]) == pytest.approx(2.0 * PLANE)
        assert (edge[1] - edge[0]) @ inward == pytest.approx(0.0, abs=1e-12)
        assert normal == pytest.approx(np.array([point, point + NORMAL * inward]))
    scene.show(1)
    assert lines(scene.planes) == lines(scene.normals) == []


def test_no_half_plane_is_no_line() -> None:
    nothing = np.zeros((0, 2))
    edges, normals = plane_lines(ActivePlanes(points=nothing, normals=nothing))
    assert edges.shape == normals.shape == (0, 2, 2)


def test_all_that_is_driven_and_stands_there_lies_in_view(film: Film, scene: Scene) -> None:
    left, right, bottom, top = extent(film)
    assert (scene.axes.get_xlim(), scene.axes.get_ylim()) == ((left, right), (bottom, top))
    assert film.corridor is not None
    points = [view.pose[:2] for view in film.views]
    points += [line for part in (0, 1) for side in film.corridor.lines(part) for line in side]
    points += film.views[0].obstacles
    every = np.vstack(points)
    assert (every > (left, bottom)).all()
    assert (every < (right, top)).all()
    assert scene.axes.get_aspect() == 1.0
    assert (scene.axes.get_xlabel(), scene.axes.get_ylabel()) == ("x [m]", "y [m]")


def test_legend_names_what_there_is(film: Film, scene: Scene) -> None:
    names = {
        "corridor",
        "corridor, other part",
        "path",
        "obstacle",
        "body",
        "body, predicted",
        "predicted",
        "pose aimed at",
        "goal",
        "rear axle, driven",
        "active half-plane",
    }
    assert set(scene.axes.get_legend_handles_labels()[1]) == names
    bare = tuple(replace(view, obstacles=(), goal=None) for view in film.views)
    other = Scene(Figure().add_subplot(), replace(film, views=bare))
    assert set(other.axes.get_legend_handles_labels()[1]) == names - {"obstacle", "goal"}


def test_a_pose_that_was_not_measured_is_not_drawn(film: Film) -> None:
    blind = replace(film.views[1], pose=np.full(3, np.nan))
    figure = Figure()
    scene = Scene(figure.add_subplot(), replace(film, views=(film.views[0], blind), times=film.times[:2]))
    scene.show(1)
    figure.draw_without_rendering()
    assert np.isfinite(extent(scene.film)).all()


def test_bars_are_as_long_as_the_weights(film: Film) -> None:
    weights = EffectiveWeights(lag=1000.0, contouring=1.5, progress_reward=0.0, goal_position=2e4)
    view: Any = film.views[0]
    command = view.observed.command
    told = replace(command.diagnostics, weights=weights)
    view = replace(view, observed=replace(view.observed, command=replace(command, diagnostics=told)))
    axes = Figure().add_subplot()
    bars = WeightBars(axes, [replace(film, views=(view,)), film])
    bars.show(view)
    assert [bar.get_width() for bar in bars.bars.patches] == [1000.0, 1.5, 0.0, 2e4]
    assert [label.get_text() for label in axes.get_yticklabels()] == [
        "lag",
        "contouring",
        "progress reward",
        "goal position",
    ]
    assert axes.get_xlim() == (0.0, 1e6)  # the other one arrives with 1e5
