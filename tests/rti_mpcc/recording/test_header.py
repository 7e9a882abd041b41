"""Route, corridor and settings come back from a header the same to the last bit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from math import pi
from pathlib import Path

import numpy as np
import pytest

from geometry import Corridor, Narrowing, PathPart, Pose2, ReferencePath
from rti_mpcc.config import ControllerConfig, SolverSettings, Vehicle
from rti_mpcc.docking import DockingController
from rti_mpcc.model.footprint import body_of
from rti_mpcc.paper import with_method
from rti_mpcc.recording import Header
from rti_mpcc.recording.codec import structured
from rti_mpcc.recording.lines import from_line, to_line

SEGMENTS = [(1, 0.05, 8.0), (-1, -0.2, 10.0), (-1, 0.1, 7.0)]
ROUTE = ReferencePath.from_segments(Pose2(0.1, 0.2, pi / 3), SEGMENTS)
STRAIGHT = ReferencePath.from_segments(Pose2(2.0, 0.0, 0.0), [(1, 0.0, 16.0)])
BOX = [(0.0, -3.0), (20.0, -3.0), (20.0, 2.5), (0.0, 2.5)]
OBSTACLES = [[(30.0, 30.0), (31.0, 30.0), (31.5, 31.0)], [(40.0, 0.0), (40.0, 1.0), (41.0, 1.0), (41.0, 0.0)]]

CSV = "x,y,heading,direction\n0,0,0,1\n5.1,0.3,0.1,1\n10,1,0.15,1\n"


def from_csv(folder: Path) -> ReferencePath:
    (folder / "path.csv").write_text(CSV)
    return ReferencePath.from_csv(folder / "path.csv")


PATHS: dict[str, Callable[[Path], ReferencePath]] = {
    "segments": lambda _: ROUTE,
    "poses": lambda _: ReferencePath.from_poses([Pose2(0, 0, 0), Pose2(6, 1, 0.3), Pose2(12, 3, 0.3)], 1),
    "waypoints": lambda _: ReferencePath.from_waypoints([(0, 0), (5, 0.4), (11, 1.1), (17, 1.3)], -1),
    "csv": from_csv,
}

NARROWING = Narrowing(12.0, 13.0, left=1.4, right=-1.3)


def back(header: Header) -> Header:
    """A header by way of its line."""
    return structured(from_line(to_line(header).rstrip())[0], Header)


def header_of(path: ReferencePath, corridor: Corridor, config: ControllerConfig | None = None) -> Header:
    return Header.of(DockingController(path, corridor, config))


@pytest.mark.parametrize("name", PATHS)
def test_path(name: str, tmp_path: Path) -> None:
    path = PATHS[name](tmp_path)
    again = back(header_of(path, Corridor.from_offsets(path, left=3.0, right=-3.0))).path
    for part, other in zip(path.parts, again.parts, strict=True):
        for field in fields(PathPart):
            one, two = getattr(part, field.name), getattr(other, field.name)
            np.testing.assert_array_equal(one, two, strict=True)
        thetas = np.linspace(part.start - 1.0, part.end + 1.0, 777)
        for field in fields(part.reference(thetas)):
            one, two = (getattr(each.reference(thetas), field.name) for each in (part, other))
            assert one.tobytes() == two.tobytes()


@pytest.mark.parametrize(
    ("path", "corridor"),
    [
        (ROUTE, Corridor.from_offsets(ROUTE, left=3.0, right=-3.0, narrowings=[NARROWING])),
        (ROUTE, Corridor.from_offsets(ROUTE, left=3.0, right=-3.0, obstacles=OBSTACLES)),
        (STRAIGHT, Corridor.from_polygon(STRAIGHT, BOX)),
        (STRAIGHT, Corridor.from_polygon(STRAIGHT, BOX, obstacles=OBSTACLES)),
    ],
)
def test_corridor(path: ReferencePath, corridor: Corridor) -> None:
    again = Corridor.from_lines(back(header_of(path, corridor)).corridor)
    poses = np.random.default_rng(0).uniform(-5.0, 25.0, (200, 3))
    for part in range(len(path.parts)):
        one, two = (
            each.contacts(part, body_of(Vehicle(), 2), poses, within=5.0, outward=0.02).values
            for each in (corridor, again)
        )
        assert one.tobytes() == two.tobytes()
    assert again.narrowest() == corridor.narrowest()
    assert all(map(np.array_equal, again.obstacles, corridor.obstacles))


@pytest.mark.parametrize(
    "config",
    [
        ControllerConfig(),
        ControllerConfig.paper(cycle=0.07),
        ControllerConfig.paper_printed(),
        with_method(ControllerConfig(), "separated"),
        ControllerConfig(deadline=0.1 + 0.2, solver=SolverSettings(tolerance=1 / 3e5)),
    ],
)
def test_config(config: ControllerConfig) -> None:
    corridor = Corridor.from_offsets(ROUTE, left=3.0, right=-3.0)
    assert back(header_of(ROUTE, corridor, config)).config == config
