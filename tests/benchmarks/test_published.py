"""The published figures and trajectories that come with the package."""

from __future__ import annotations

from operator import attrgetter

import numpy as np
import pytest

from benchmarks.reproduction.published import published, published_run, published_track
from rti_mpcc.config import ControllerConfig


@pytest.mark.parametrize(
    ("scenario", "method", "paper", "code", "changes", "clearance"),
    [
        ("docking_inside", "dynamic", 27.39, 27.33, 0, 1.11),
        ("docking_inside", "separated", 41.68, 41.99, 0, 1.15),
        ("docking_inside", "switched", 49.29, 46.89, 1, 1.21),
        ("docking_behind", "dynamic", 30.66, 31.15, 0, 0.17),
        ("docking_behind", "separated", 63.55, 69.69, 3, -0.54),
        ("docking_behind", "switched", 31.38, 30.87, 0, -1.35),
    ],
)
def test_figures_are_those_of_the_table(
    scenario: str, method: str, paper: float, code: float, changes: int, clearance: float
) -> None:
    run = published_run(scenario, method)
    assert (run["time_in_paper_s"], run["time_to_tolerance_s"]) == (paper, code)
    assert (run["direction_changes"], run["min_clearance_m"]) == (changes, clearance)
    assert set(run["rms"]) == {"steering", "steering_rate", "acceleration", "lateral_acceleration"}
    track = published_track(scenario, method)
    assert track.times[-1] == pytest.approx(code, abs=0.7)


@pytest.mark.parametrize("run", published()["runs"], ids=lambda run: f"{run['scenario']}-{run['method']}")
def test_trajectories_are_motions(run: dict[str, str]) -> None:
    track = published_track(run["scenario"], run["method"])
    assert np.diff(track.times) == pytest.approx(np.full(len(track.times) - 1, 0.1))
    way = np.hypot(*np.diff(track.poses[:, :2], axis=0).T)
    assert way == pytest.approx(0.1 * np.abs(track.v[1:]), abs=0.02)
    assert not track.poses.flags.writeable


def test_rms_and_energy_agree() -> None:
    run = published_run("docking_inside", "dynamic")
    for name, energy in run["energy"].items():
        assert np.sqrt(energy / run["time_to_tolerance_s"]) == pytest.approx(run["rms"][name], rel=0.01)


def test_what_is_not_known_of_a_run_is_none() -> None:
    course = published_run("path_following", "dynamic")
    assert course["time_in_paper_s"] is course["min_clearance_m"] is None


def test_origin_is_told_and_settings_of_the_paper_are_those_of_the_preset() -> None:
    assert "published code of the paper's authors, run headless" in published()["origin"]
    config = ControllerConfig.paper()
    for parameter in published()["parameters"]:
        value = attrgetter(parameter["setting"])(config)
        told = parameter.get("code", parameter.get("paper")).partition(" (")[0]
        values = value if isinstance(value, tuple) else (value,)
        assert [float(one) for one in told.split(", ")] == pytest.approx(list(map(float, values)))
