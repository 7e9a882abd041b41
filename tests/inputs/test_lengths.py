"""Long paths take memory by their rows, and a length that asks for far too many places is refused."""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from geometry import Corridor, CorridorError, InputError, Narrowing, PathError, Pose2, ReferencePath
from geometry.arrays import Array
from rti_mpcc import DockingController
from tests.lists import some_of

BYTES = 1000
"""For each row."""


def recorded(rows: int) -> Array:
    """Poses (n, 3) of a track in bends, 5 cm apart."""
    x = 0.05 * np.arange(rows)
    return np.column_stack([x, 2.0 * np.sin(x / 15.0), np.arctan(2.0 / 15.0 * np.cos(x / 15.0))])


def from_csv(poses: Array, folder: Path) -> ReferencePath:
    file = folder / "track.csv"
    rows = np.column_stack([poses, np.ones(len(poses))])
    np.savetxt(file, rows, delimiter=",", header="x,y,heading,direction", comments="")
    return ReferencePath.from_csv(file)


@pytest.mark.parametrize("rows", some_of([20_000, 100_000]))
@pytest.mark.parametrize(
    "built",
    [
        lambda poses, folder: ReferencePath.from_poses(poses, 1),
        lambda poses, folder: ReferencePath.from_poses(
            [Pose2(*row) for row in poses.tolist()], [1] * len(poses)
        ),
        lambda poses, folder: ReferencePath.from_waypoints(poses[:, :2]),
        from_csv,
    ],
    ids=["poses", "Pose2s", "waypoints", "csv"],
)
def test_a_track_of_many_rows_takes_little_memory_and_leads_through_them(
    built: Callable[[Array, Path], ReferencePath], rows: int, tmp_path: Path
) -> None:
    poses = recorded(rows)
    built(poses[:100], tmp_path)  # what is imported with the first one doesn't count
    tracemalloc.start()
    path = built(poses, tmp_path)
    taken = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert taken < BYTES * rows
    part = path.parts[0]
    for row in (0, 1, 4_321, rows // 2, rows - 1):
        x, y, _ = poses[row]
        at = part.pose(part.project(x, y))
        assert np.hypot(at.x - x, at.y - y) < 1e-5


LINE = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 20.0)])
BENT = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 10.0), (1, 0.2, 5.0), (1, -0.2, 5.0)])
ENDLESS = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 1e9)])
BOX = [(-1.0, -3.0), (1.1e9, -3.0), (1.1e9, 3.0), (-1.0, 3.0)]


@pytest.mark.parametrize(
    ("refused", "error"),
    [
        (lambda: ReferencePath.from_waypoints([(0.0, 0.0), (1e9, 0.0)]), PathError),
        (lambda: ReferencePath.from_waypoints([(0.0, 0.0), (1.0, 0.0), (1e300, 1.0)]), PathError),
        (lambda: LINE.sample(1e-12), PathError),
        (lambda: Corridor.from_offsets(ENDLESS, left=2.0, right=-2.0), CorridorError),
        (lambda: Corridor.from_polygon(ENDLESS, BOX), PathError),
        (lambda: Corridor.from_offsets(BENT, left=1e5, right=-1e5), CorridorError),
        (
            lambda: Corridor.from_offsets(
                LINE, left=1e6, right=-1.0, narrowings=[Narrowing(5.0, 6.0, left=1.0)]
            ),
            CorridorError,
        ),
        (
            lambda: DockingController(ENDLESS, Corridor.from_offsets(LINE, left=2.0, right=-2.0)),
            PathError,
        ),
    ],
    ids=[
        "waypoints",
        "the last waypoint",
        "sample",
        "a path",
        "in a polygon",
        "bends far off",
        "a step",
        "a controller",
    ],
)
def test_what_asks_for_far_too_many_places_is_refused_in_one_line(
    refused: Callable[[], object], error: type[InputError]
) -> None:
    with pytest.raises(
        error, match=r"^(a|the) [^\n]* is [0-9.e+]+ m long: at most [-0-9.e+]+ m are allowed[^\n]*$"
    ):
        refused()
