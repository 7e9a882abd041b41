"""A case from above, driven and not."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection

from rti_mpcc.model.footprint import body_polygons
from rti_mpcc.report.campaign.case_picture import case_figure
from rti_mpcc.simulation import RunResult, changed, load_scenario, simulate
from rti_mpcc.simulation.metrics import clearances


def shapes(axes: Axes, label: str) -> list[np.ndarray]:
    """Corners of the polygons with a label that begins so."""
    found = [one for one in axes.collections if str(one.get_label()).startswith(label)]
    assert len(found) == 1
    assert isinstance(found[0], PolyCollection)
    return [np.asarray(path.vertices)[:4] for path in found[0].get_paths()]


def test_a_driven_case_has_its_bodies_and_goal(run: RunResult) -> None:
    axes = case_figure(run.scenario, run, "case 7").axes[0]
    assert axes.get_aspect() == 1.0
    assert axes.get_title(loc="left") == "case 7"
    bodies = body_polygons(run.truth.poses, run.config.vehicle)
    assert shapes(axes, "body at the end")[0] == pytest.approx(bodies[-1])
    clearance = clearances(run)
    least = int(np.argmin(clearance))
    assert shapes(axes, "body nearest to a boundary")[0] == pytest.approx(bodies[least])
    label = next(str(one.get_label()) for one in axes.collections if "nearest" in str(one.get_label()))
    assert f"{clearance[least]:.3f} m at {run.truth.times[least]:.1f} s" in label
    goal = body_polygons(run.truth.goals[-1:], run.config.vehicle)[0]
    assert shapes(axes, "goal")[0] == pytest.approx(goal)
    assert len(shapes(axes, "body each second")) == 4
    assert len(shapes(axes, "obstacle")) == 1
    labels = {str(one.get_label()) for one in axes.collections}
    assert {"corridor, earlier parts", "corridor, last part", "path"} <= labels


def test_a_case_that_was_not_driven_has_its_course(run: RunResult) -> None:
    axes = case_figure(run.scenario, None, "case 7").axes[0]
    start = body_polygons(run.truth.poses[:1], run.config.vehicle)[0]
    assert shapes(axes, "body at the start")[0] == pytest.approx(start)
    assert len(shapes(axes, "goal")) == len(shapes(axes, "obstacle")) == 1
    assert not axes.lines


def test_a_scene_has_what_is_solid_and_the_ways_that_were_planned() -> None:
    tables = {"goal.measurement": {}, "simulation.duration": 1.5}
    scenario = changed(load_scenario("bay_perpendicular"), tables)
    result = simulate(scenario)
    axes = case_figure(scenario, result, "case 7").axes[0]
    labels = {str(one.get_label()) for one in axes.get_children()}
    assert {"solid", "path", "goal", "planned goal", "body at the end", "rear axle, driven"} <= labels
    goal = body_polygons(result.truth.goals[-1:], result.config.vehicle)[0]
    assert shapes(axes, "goal")[0] == pytest.approx(goal)
    undriven = case_figure(scenario, None, "case 7").axes[0]
    start = body_polygons(result.truth.poses[:1], result.config.vehicle)[0]
    assert shapes(undriven, "body at the start")[0] == pytest.approx(start)


def test_a_detected_goal_has_its_planned_one_beside_it(watched: RunResult) -> None:
    axes = case_figure(watched.scenario, watched, "case 7").axes[0]
    planned = watched.scenario.planned_goal(watched.path)
    assert planned is not None
    pose = np.array([[planned.x, planned.y, planned.phi]])
    assert shapes(axes, "planned goal")[0] == pytest.approx(body_polygons(pose, watched.config.vehicle)[0])
