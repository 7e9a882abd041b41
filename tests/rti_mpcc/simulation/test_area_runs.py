"""Runs in an area: progress on what is planned, the goal, clearance and the figures of the planning."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from geometry import Pose2, ReferencePath
from rti_mpcc.errors import InputError
from rti_mpcc.simulation import RunResult, Scenario, changed, simulate, summary
from rti_mpcc.simulation.metrics import untimed
from tests.rti_mpcc.simulation.conftest import Scripted, ScriptedPlanner, forward, still

AHEAD = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 4.0), (-1, 0.0, 3.0), (1, 0.0, 14.0)])
BACK = ReferencePath.from_segments(Pose2(1.0, 0.0, 0.0), [(1, 0.0, 14.0)])


def first_ahead_then_back(now: float) -> ReferencePath | None:
    return None if now < 0.475 else AHEAD if now < 1.475 else BACK


def test_progress_is_on_the_way_that_was_planned(hall: Scenario) -> None:
    controller = ScriptedPlanner(script=forward, planned=first_ahead_then_back)
    result = simulate(changed(hall, {"simulation.duration": 2.0}), controller=controller)
    times, x = result.truth.times, result.truth.poses[:, 0]
    assert [begin for begin, _ in result.paths] == [0.5, 1.5]
    assert [path for _, path in result.paths] == [AHEAD, BACK]
    assert result.path is BACK
    assert result.given_path is None
    before, first, second = (
        times < 0.5 - 1e-9,
        (times >= 0.5 - 1e-9) & (times < 1.5 - 1e-9),
        times >= 1.5 - 1e-9,
    )
    assert (result.truth.theta[before] == 0.0).all()
    assert result.truth.theta[first] == pytest.approx(x[first], abs=1e-9)
    assert result.truth.theta[second] == pytest.approx(np.maximum(x[second] - 1.0, 0.0), abs=1e-9)
    assert (result.truth.part == 0).all()


def test_without_a_route_there_is_no_path(hall: Scenario) -> None:
    result = simulate(changed(hall, {"simulation.duration": 0.5}), controller=Scripted(script=still))
    assert not result.paths
    with pytest.raises(InputError, match=r"hall: no route was found"):
        _ = result.path


def test_figures_of_the_planning(hall: Scenario) -> None:
    controller = ScriptedPlanner(script=still, planned=first_ahead_then_back)
    result = simulate(changed(hall, {"simulation.duration": 2.0}), controller=controller)
    figures = summary(result)
    assert figures["planning"] == {"seconds": 0.25, "replans": 1, "length_m": pytest.approx(21.0), "cusps": 2}
    assert figures["expected_time_s"] is None
    assert untimed(figures)["planning"] == {"replans": 1, "length_m": pytest.approx(21.0), "cusps": 2}


ASIDE = ReferencePath.from_segments(Pose2(2.0, 0.0, 0.0), [(-1, 0.0, 1.0), (1, 0.0, 9.0)])


def leaving(straight: Scenario, planned: Any, x: float = 0.0, y: float = 0.0) -> RunResult:
    """Two seconds at rest there, on 10 m of path along x, which the controller may leave for others."""
    return simulate(
        changed(straight, {"simulation.duration": 2.0, "simulation.start_offset": [x, y, 0.0]}),
        controller=ScriptedPlanner(script=still, planned=planned),
    )


def on_given_then_aside(straight: Scenario) -> Any:
    given = straight.build_path()
    return lambda now: given if now < 0.975 else ASIDE


def test_a_path_that_is_left_is_followed_by_the_way_that_was_planned(straight: Scenario) -> None:
    result = leaving(straight, on_given_then_aside(straight))
    (begin, given), (left, aside) = result.paths
    assert (begin, left) == (0.0, 1.0)
    assert aside is ASIDE
    assert result.path is ASIDE
    assert result.given_path is given
    assert given.length == 10.0
    figures = summary(result)
    assert figures["planning"] == {"seconds": 0.25, "replans": 1, "length_m": pytest.approx(10.0), "cusps": 1}
    stays = leaving(straight, lambda now: given)
    assert figures["expected_time_s"] == summary(stays)["expected_time_s"] is not None
