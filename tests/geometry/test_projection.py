from __future__ import annotations

from math import inf, nan, pi

import numpy as np
import pytest

from geometry import InputError, Pose2, ReferencePath

HAIRPIN = [(1, 0.0, 20.0), (1, 0.5, 2.0 * pi), (1, 0.0, 20.0)]  # two lanes 4 m apart


def test_heading_chooses_the_lane() -> None:
    part = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), HAIRPIN).parts[0]
    assert part.project(8.0, 1.9) == pytest.approx(8.0)
    assert part.project(8.0, 1.9, heading=0.3) == pytest.approx(8.0)
    assert part.project(8.0, 1.9, heading=pi - 0.3) == pytest.approx(20.0 + 2.0 * pi + 12.0)
    # The branch of the heading does not matter.
    assert part.project(8.0, 1.9, heading=0.3 - 4.0 * pi) == pytest.approx(8.0)


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("x", {"x": nan}),
        ("y", {"y": inf}),
        ("near", {"near": nan}),
        ("heading", {"heading": nan}),
        ("reach", {"reach": nan}),
        ("reach", {"reach": -1.0}),
    ],
)
def test_bad_numbers_are_refused(name: str, values: dict[str, float], reversing: ReferencePath) -> None:
    with pytest.raises(InputError, match=f"{name} = "):
        reversing.parts[0].project(**{"x": 0.0, "y": 0.0} | values)


def test_the_closest_of_many_points_is_no_closer() -> None:
    """Routes, windows and headings drawn at random, against a point each centimetre."""
    random = np.random.default_rng(3)
    for _ in range(200):
        direction = int(random.choice([-1, 1]))
        count = int(random.integers(1, 7))
        segments = [
            (direction, float(random.choice([0.0, 1.0, 1.0]) * random.uniform(-1.0, 1.0)), float(length))
            for length in random.uniform(0.5, 8.0, count)
        ]
        part = ReferencePath.from_segments(Pose2(*random.uniform(-5.0, 5.0, 3)), segments).parts[0]
        x, y = random.uniform(-10.0, 10.0, 2)
        near, reach = random.uniform(part.start, part.end), random.uniform(0.1, 10.0)
        wanted = None if random.uniform() < 0.5 else float(random.uniform(-7.0, 7.0))
        found = part.project(x, y, near=near, reach=reach, heading=wanted)
        low, high = max(near - reach, part.start), min(near + reach, part.end)
        assert low <= found <= high
        theta = np.append(np.linspace(low, high, int(100.0 * (high - low)) + 2), found)
        at = part.reference(theta)
        apart = np.hypot(at.x - x, at.y - y)
        if wanted is not None:
            fits = np.cos(at.phi - wanted) >= -1e-9
            apart[~fits] = np.inf if fits.any() else apart[~fits]
        assert apart[-1] <= apart.min() + 1e-9
