"""Routes that several tests use."""

from __future__ import annotations

from math import pi

import pytest

from geometry import Corridor, Narrowing, Pose2, ReferencePath

REVERSING = [(-1, -0.2, 10.0), (-1, 0.2, 10.0), (-1, 0.0, 5.0), (-1, 0.2, 5.0)]
FORWARD = [(1, 0.0, 5.0), (1, 0.2, 5.0), (1, -0.2, 10.0), (1, 0.2, 5.0), (1, 0.0, 5.0)]


@pytest.fixture
def reversing() -> ReferencePath:
    return ReferencePath.from_segments(Pose2(0.0, 0.0, pi / 2), REVERSING)


@pytest.fixture
def full_course() -> ReferencePath:
    return ReferencePath.from_segments(Pose2(0.0, -30.0, pi / 2), FORWARD + REVERSING)


@pytest.fixture
def docking_behind(reversing: ReferencePath) -> Corridor:
    narrowings = [Narrowing(22.0, 23.0, left=1.3), Narrowing(27.5, 28.4, right=-1.0)]
    return Corridor.from_offsets(reversing, left=5.0, right=-5.0, narrowings=narrowings)
