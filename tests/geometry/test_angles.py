from __future__ import annotations

from math import pi

import numpy as np
import pytest

from geometry import lift, wrap


@pytest.mark.parametrize(
    ("angle", "expected"),
    [(0.0, 0.0), (pi, pi), (-pi, pi), (3.0 * pi, pi), (1.5 * pi, -0.5 * pi), (-1.5 * pi, 0.5 * pi)],
)
def test_wrap_goes_to_minus_pi_exclusive_to_pi(angle: float, expected: float) -> None:
    assert wrap(angle) == pytest.approx(expected)
    assert isinstance(wrap(angle), float)


def test_arrays_go_element_by_element() -> None:
    angles = np.linspace(-20.0, 20.0, 41)
    np.testing.assert_allclose(wrap(angles), [wrap(float(angle)) for angle in angles])
    np.testing.assert_allclose(lift(angles, 7.0), [lift(float(angle), 7.0) for angle in angles])
    np.testing.assert_allclose(lift(0.1, angles), [lift(0.1, float(angle)) for angle in angles])
