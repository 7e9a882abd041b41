"""A planned way in rows: what they are, and the files made of them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from geometry import Area, Pose2, ReferencePath
from rti_mpcc.config import ControllerConfig, Vehicle
from rti_mpcc.manoeuvre import PlanOutcome
from rti_mpcc.report.plan_files import ROUTE_COLUMNS, plan_figures, write_plan, write_route
from rti_mpcc.report.planned_way import SPACING, least_clearance, no_way, way_of
from tests.rti_mpcc.planned import manoeuvre_along, no_manoeuvre

START = Pose2(1.0, 2.0, 0.3)
PATH = ReferencePath.from_segments(START, [(1, 0.1, 4.0), (1, 0.0, 1.02), (-1, -0.2, 3.0), (1, 0.0, 2.0)])
FOUND = manoeuvre_along(PATH)
IN_VAIN = no_manoeuvre(START, PATH.end)
AREA = Area(boundary=[(-20.0, -20.0), (30.0, -20.0), (30.0, 20.0), (-20.0, 20.0)])
CONFIG = ControllerConfig()


def route(folder: Path, manoeuvre: Any = FOUND) -> tuple[list[str], Any]:
    """Header and rows of route.csv."""
    file = folder / "route.csv"
    write_route(manoeuvre, file)
    lines = file.read_text(encoding="utf-8").splitlines()
    return lines[0].split(","), np.array([[float(cell) for cell in line.split(",")] for line in lines[1:]])


def test_rows_follow_the_way() -> None:
    way = way_of(FOUND)
    assert way.s[[0, -1]] == pytest.approx([0.0, PATH.length])
    steps = np.diff(way.s)
    assert (steps >= 0.0).all()
    assert steps.max() <= SPACING + 1e-12
    assert way.poses[0] == pytest.approx((START.x, START.y, START.phi))
    assert way.poses[-1] == pytest.approx((PATH.end.x, PATH.end.y, PATH.end.phi))
    moved = np.hypot(*np.diff(way.poses[:, :2], axis=0).T)
    assert moved == pytest.approx(steps, abs=1e-5)


def test_rows_know_curvature_direction_and_segment() -> None:
    way = way_of(FOUND)
    assert set(zip(way.segment.tolist(), way.direction.tolist(), strict=True)) == {(0, 1), (1, -1), (2, 1)}
    for segment, least, most in ((0, 0.0, 0.1), (1, -0.2, -0.2), (2, 0.0, 0.0)):
        rows = way.segment == segment
        assert (way.curvature[rows].min(), way.curvature[rows].max()) == pytest.approx((least, most))
    assert way.curvature[way.s < 4.0 - 1e-9] == pytest.approx(0.1)


def test_where_segments_meet_there_is_a_row_of_either() -> None:
    way = way_of(FOUND)
    rows = way.last_rows
    assert way.s[rows] == pytest.approx(PATH.cusps)
    assert way.s[rows + 1] == pytest.approx(PATH.cusps)
    assert way.poses[rows] == pytest.approx(way.poses[rows + 1])
    assert way.is_cusp.tolist() == [True, True]


def test_least_clearance_is_that_of_the_body() -> None:
    vehicle = Vehicle(width=2.0, front=4.0, rear=1.0)
    straight = manoeuvre_along(ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 10.0)]))
    post = [(4.991, 1.25), (4.995, 1.25), (4.993, 1.3)]
    assert least_clearance(straight, Area(obstacles=[post]), vehicle) == pytest.approx(0.25, abs=1e-9)
    assert least_clearance(IN_VAIN, AREA, vehicle) is None


def test_figures_of_a_way() -> None:
    assert plan_figures(FOUND, AREA, CONFIG) == {
        "found": True,
        "seconds": 0.25,
        "length_m": pytest.approx(10.02),
        "cusps": 2,
        "min_clearance_m": pytest.approx(least_clearance(FOUND, AREA, CONFIG.vehicle)),
        "nodes": 42,
    }


def test_figures_of_no_way() -> None:
    nothing = dict.fromkeys(("length_m", "cusps", "min_clearance_m"))
    assert plan_figures(IN_VAIN, AREA, CONFIG) == {"found": False, "seconds": 2.0, "nodes": 1000, **nothing}


def test_route_file(tmp_path: Path) -> None:
    header, rows = route(tmp_path)
    assert tuple(header) == ROUTE_COLUMNS == ("s", "x", "y", "heading", "curvature", "direction", "segment")
    way = way_of(FOUND)
    assert rows[:, 0] == pytest.approx(way.s, abs=1e-6)
    assert rows[:, 1:4] == pytest.approx(way.poses, abs=1e-9)
    assert rows[:, 4] == pytest.approx(way.curvature)
    assert (rows[:, 5] == way.direction).all()
    assert (rows[:, 6] == way.segment).all()


def test_route_file_far_from_the_origin_keeps_its_digits(tmp_path: Path) -> None:
    far = Pose2(7_008_600_719.29408, -8_722_360_256.93465, 0.0)
    _, rows = route(tmp_path, manoeuvre_along(ReferencePath.from_segments(far, [(1, 0.0, 2.0)])))
    assert (rows[0, 1], rows[0, 2]) == (far.x, far.y)


def test_route_file_of_no_way_has_no_rows(tmp_path: Path) -> None:
    header, rows = route(tmp_path, IN_VAIN)
    assert tuple(header) == ROUTE_COLUMNS
    assert len(rows) == 0


@pytest.mark.parametrize("manoeuvre", [FOUND, IN_VAIN])
def test_all_files_are_written(tmp_path: Path, manoeuvre: Any) -> None:
    figures = plan_figures(manoeuvre, AREA, CONFIG)
    written = write_plan("yard", figures, manoeuvre, AREA, CONFIG, tmp_path)
    assert set(written) == {tmp_path / name for name in ("plan.json", "route.csv", "plan.png")}
    assert all(file.stat().st_size > 0 for file in written)
    assert json.loads((tmp_path / "plan.json").read_text()) == figures


def test_why_there_is_no_way() -> None:
    assert no_way(IN_VAIN) == [
        "no way was found: too narrow",
        "the search came within 1.50 m of the goal, 1000 poses in 2.0 s",
    ]
    blocked = PlanOutcome.GOAL_IN_COLLISION
    silent = type(IN_VAIN)(start=START, goal=START, outcome=blocked)
    assert no_way(silent) == [f"no way was found: {blocked.value}"]
