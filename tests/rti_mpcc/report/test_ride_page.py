"""The page of a ride: all of its cycles in one file that needs nothing else. A browser shows it."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.pictures import BROWSER
from rti_mpcc.report.ride import Ride
from rti_mpcc.report.ride_page import ride_page
from rti_mpcc.simulation import RunResult, changed, load_scenario, summary
from tests.rti_mpcc.report.conftest import driven
from tests.rti_mpcc.report.pages import browsed

AFTER = """
<script>
slider.value = 25;
slider.dispatchEvent(new Event("input"));
</script>
"""
"""What a user does: move the slider."""


@pytest.fixture(scope="module")
def page(ride: Ride, figures: dict[str, Any]) -> str:
    return ride_page(ride, figures)


def data_of(page: str) -> Any:
    (found,) = re.findall(r'id="data">(.*?)</script>', page, flags=re.DOTALL)
    return json.loads(found)


def test_it_holds_each_cycle_where_the_vehicle_was(page: str, ride: Ride) -> None:
    data = data_of(page)
    poses = np.column_stack([data[name] for name in ("x", "y", "phi")])
    poses[:, :2] += data["origin"]
    assert poses == pytest.approx(np.array([moment.pose for moment in ride.moments]), abs=6e-4)
    assert [data["texts"][k] for k in data["status"]] == [m.command.status.value for m in ride.moments]
    assert [data["texts"][k] for k in data["reason"]] == [m.command.diagnostics.reason for m in ride.moments]
    assert len({len(column) for name, column in data.items() if name in ("plan", "planes", "goal", "t")}) == 1
    plan = np.reshape(data["plan"][20][:-1], (-1, 2)).cumsum(axis=0) / 100.0 + ride.moments[20].pose[:2]
    assert plan[-1] == pytest.approx(ride.moments[20].command.trajectory.states[-1, :2], abs=0.006)
    assert [len(data["outlines"][k]) for k in data["obstacles"][0]] == [6]


def test_half_planes_are_as_far_from_the_body_as_its_clearance() -> None:
    changes = {"corridor.left": 1.8, "corridor.right": -1.8, "simulation.duration": 0.3}
    result, ride = driven(changed(load_scenario("docking_full_course"), changes))
    data = data_of(ride_page(ride, summary(result)))
    (clearance,) = [strip for strip in data["strips"] if strip["label"] == "clearance [m]"]
    body = np.reshape(data["body"], (-1, 2))
    for planes, apart in zip(data["planes"], clearance["values"], strict=True):
        edges, normals = np.array(planes)[:, :2] / 100.0, np.array(planes)[:, 2:] / 100.0
        least = min(
            float(((body - edge) @ normal).min()) for edge, normal in zip(edges, normals, strict=True)
        )
        assert least == pytest.approx(apart, abs=0.03)
        assert apart == pytest.approx(1.8 - 0.5 * ride.config.vehicle.width, abs=0.01)


def test_it_is_small_and_loads_nothing(page: str, ride: Ride) -> None:
    assert len(page.encode()) < 25_000 + 300_000 * ride.end / 60.0 * 2  # two cycles here are one at 20 Hz
    assert not re.search(r"(src|href)\s*=|https?://|@import|url\(", page)


def test_a_title_cannot_end_its_data(ride: Ride, figures: dict[str, Any]) -> None:
    page = ride_page(replace(ride, title="</script><b>"), figures)
    assert "</script><b>" not in page


def test_cycles_without_a_position_are_gaps(detected: tuple[RunResult, Ride]) -> None:
    ride = detected[1]
    blind = replace(ride.moments[3], pose=np.full(3, np.nan))
    moments = (*ride.moments[:3], blind, *ride.moments[4:])
    data = data_of(ride_page(replace(ride, moments=moments), summary(detected[0])))
    assert (data["x"][3], data["plan"][3], data["planes"][3]) == (None, [], [])
    assert data["ellipse"][-1] is not None
    assert len(data["detections"]) == sum(each.pose is not None for each in ride.detections)
    assert {len(each) for each in data["detections"]} == {7}  # each with its ellipse


@pytest.mark.skipif(BROWSER is None, reason="no Chromium here")
def test_a_browser_shows_the_cycle_of_the_slider(page: str, ride: Ride, tmp_path: Path) -> None:
    file = tmp_path / "page.html"
    file.write_text(page.replace("</body>", f"{AFTER}</body>"))
    dom = browsed(file, tmp_path, "#cycle=7")
    (shown,) = re.findall(r'data-cycle="(\d+)" data-pose="([^"]*)"', dom)
    assert shown[0] == "25"
    origin = data_of(page)["origin"]
    x, y, phi = map(float, shown[1].split())
    assert (x + origin[0], y + origin[1], phi) == pytest.approx(ride.moments[25].pose.tolist(), abs=6e-4)
    assert f"cycle 26 of {len(ride.moments)}" in dom
