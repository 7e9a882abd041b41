from __future__ import annotations

from math import nan
from typing import Any

import numpy as np
import pytest

from geometry import Corridor, CorridorError, Narrowing, Pose2, ReferencePath

PATH = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 20.0)])


@pytest.mark.parametrize(
    ("left", "right", "message"),
    [
        (nan, -1.0, "left = nan"),
        (-1.0, 1.0, "left = -1.0: must be > 0 m"),
        (-1.0, -2.0, "left = -1.0: must be > 0"),
        (2.0, 1.0, "right = 1.0: must be < 0"),
    ],
)
def test_bad_offsets_are_refused(left: float, right: float, message: str) -> None:
    with pytest.raises(CorridorError, match=message):
        Corridor.from_offsets(PATH, left=left, right=right)


@pytest.mark.parametrize(
    ("narrowing", "message"),
    [
        (
            Narrowing(-1.0, 3.0, left=1.0),
            r"narrowings\[1\].start = -1.0: must be between 0 and the length 20 m",
        ),
        (Narrowing(3.0, 20.1, left=1.0), r"narrowings\[1\].end = 20.1"),
        (Narrowing(nan, 3.0, left=1.0), r"narrowings\[1\].start = nan"),
        (Narrowing(5.0, 3.0, left=1.0), "must be less than end"),
        (Narrowing(3.0, 5.0, left=nan), r"narrowings\[1\].left = nan"),
        (Narrowing(3.0, 5.0, left=-6.0), "must be > 0 m"),
        (Narrowing(3.0, 5.0, left=-0.5), "crosses the path"),
    ],
)
def test_bad_narrowings_are_refused(narrowing: Narrowing, message: str) -> None:
    with pytest.raises(CorridorError, match=message):
        Corridor.from_offsets(
            PATH, left=5.0, right=-5.0, narrowings=[Narrowing(1.0, 2.0, left=2.0), narrowing]
        )


WITHOUT_AREA = [
    ([(0.0, 0.0), (1.0, 0.0)], "2 corner"),
    ([(0.0, 0.0), (1.0, 0.0), (0.0, 0.0)], "2 corner"),
    ([(0.0, 0.0), (1.0, 0.0), (2.0, 0.0)], "not a simple polygon"),
]
BAD_POLYGONS = [
    ([], "shape"),
    ([(0.0, 0.0, 0.0)] * 3, "shape"),
    ([("a", "b")] * 3, "must be an array of numbers"),
    ([(0.0, 0.0), (1.0, nan), (1.0, 1.0)], "finite"),
    ([(0.0, 0.0), (2.0, 2.0), (2.0, 0.0), (0.0, 2.0)], "not a simple polygon"),
    ([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (1.0, 0.0)], "not a simple polygon"),
    (np.zeros((0, 2)), "no corner|0 corner"),
]


@pytest.mark.parametrize(("corners", "message"), WITHOUT_AREA)
def test_boundaries_need_an_area(corners: list[tuple[float, ...]], message: str) -> None:
    with pytest.raises(CorridorError, match=message):
        Corridor.from_polygon(PATH, corners)


@pytest.mark.parametrize(("corners", "message"), BAD_POLYGONS)
def test_bad_polygons_are_refused(corners: Any, message: str) -> None:
    with pytest.raises(CorridorError, match=message):
        Corridor.from_polygon(PATH, corners)
    with pytest.raises(CorridorError, match=message) as caught:
        Corridor.from_offsets(PATH, left=5.0, right=-5.0, obstacles=[[(1, 1), (2, 1), (2, 2)], corners])
    assert str(caught.value).startswith("obstacles[1]")
    with pytest.raises(CorridorError, match=message):
        Corridor.from_offsets(PATH, left=5.0, right=-5.0).with_obstacles([corners])


def test_polygon_must_contain_the_path() -> None:
    with pytest.raises(CorridorError, match="polygon does not contain the path: part 0"):
        Corridor.from_polygon(PATH, [(-1.0, -1.0), (19.0, -1.0), (19.0, 1.0), (-1.0, 1.0)])
    notched = [(-1, -1), (21, -1), (21, 1), (10.01, 1), (10.0, -0.5), (9.99, 1), (-1, 1)]
    with pytest.raises(CorridorError, match="does not contain"):
        Corridor.from_polygon(PATH, notched)
