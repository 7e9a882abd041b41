from __future__ import annotations

from math import cos, nan, pi, sin

import numpy as np
import pytest

from geometry import Corridor, InputError, Narrowing, Pose2, ReferencePath

STRAIGHT = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 30.0)])
BODY = np.array([(-1.0, -1.0), (3.0, -1.0), (3.0, 1.0), (-1.0, 1.0)])
PILLAR = [(20.0, -0.1), (20.2, -0.1), (20.2, 0.1), (20.0, 0.1)]


def bodies(*poses: tuple[float, float, float]) -> np.ndarray:
    return np.stack(
        [BODY @ np.array([[cos(phi), sin(phi)], [-sin(phi), cos(phi)]]) + (x, y) for x, y, phi in poses]
    )


def corridor() -> Corridor:
    return Corridor.from_offsets(STRAIGHT, left=3.0, right=-2.0, narrowings=[Narrowing(10.0, 10.5, left=1.2)])


@pytest.mark.parametrize(
    ("pose", "expected"),
    [
        ((4.0, 0.0, 0.0), 1.0),
        ((9.0, 0.0, 0.0), 0.2),
        ((14.0, -1.3, 0.0), -0.3),
        ((4.0, 0.0, pi / 2), 0.0),
        ((4.0, 0.5, pi / 2), -0.5),
        # The corner of the narrowing is 0.3 m inside of the body, which has no corner beyond.
        ((9.3, 0.5, 0.0), -0.3),
        # All of it beyond the boundary.
        ((20.0, 6.0, 0.0), -4.0),
        # Behind the end, where there is no boundary: the corner of the body to the end of the wall.
        ((32.0, 2.5, 0.0), 1.0),
        ((40.0, 9.0, 0.0), None),
    ],
)
def test_clearance(pose: tuple[float, float, float], expected: float | None) -> None:
    shape = bodies(pose)
    clearance = corridor().clearance(0, shape)[0]
    if expected is None:
        assert clearance > 0.0
    else:
        assert clearance == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize(
    ("pose", "expected"),
    [
        ((15.0, 0.0, 0.0), 2.0),
        ((18.0, 0.0, 0.0), -1.0),
        ((18.0, 0.95, 0.0), -0.15),
        ((20.0, 1.2, 0.0), 0.1),
    ],
)
def test_obstacles_count(pose: tuple[float, float, float], expected: float) -> None:
    wide = Corridor.from_offsets(STRAIGHT, left=8.0, right=-8.0, obstacles=[PILLAR])
    assert wide.clearance(0, bodies(pose))[0] == pytest.approx(expected, abs=0.051)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (np.zeros((1, 2, 2)), "bodies has shape"),
        (np.full((1, 4, 2), nan), "finite"),
    ],
)
def test_bad_bodies_are_refused(values: np.ndarray, message: str) -> None:
    with pytest.raises(InputError, match=message):
        corridor().clearance(0, values)
