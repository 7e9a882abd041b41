from __future__ import annotations

from math import pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from geometry import lift, wrap

ANGLES = st.floats(-1e3, 1e3)


@pytest.mark.parametrize(
    ("angle", "expected"),
    [(0.0, 0.0), (pi, pi), (-pi, pi), (3.0 * pi, pi), (1.5 * pi, -0.5 * pi), (-1.5 * pi, 0.5 * pi)],
)
def test_wrap_goes_to_minus_pi_exclusive_to_pi(angle: float, expected: float) -> None:
    assert wrap(angle) == pytest.approx(expected)
    assert isinstance(wrap(angle), float)


@given(ANGLES, ANGLES)
def test_lift_is_the_same_angle_within_pi(angle: float, near: float) -> None:
    lifted = lift(angle, near)
    assert abs(lifted - near) <= pi + 1e-9
    turns = (lifted - angle) / (2.0 * pi)
    assert turns == pytest.approx(round(turns), abs=1e-9)


def test_arrays_go_element_by_element() -> None:
    angles = np.linspace(-20.0, 20.0, 41)
    np.testing.assert_allclose(wrap(angles), [wrap(float(angle)) for angle in angles])
    np.testing.assert_allclose(lift(angles, 7.0), [lift(float(angle), 7.0) for angle in angles])
    np.testing.assert_allclose(lift(0.1, angles), [lift(0.1, float(angle)) for angle in angles])
