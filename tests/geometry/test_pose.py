from __future__ import annotations

from math import inf, nan, pi

import numpy as np
import pytest

from geometry import InputError, Pose2, RtiMpccError, lift, wrap


def test_compose_puts_the_offset_into_the_frame_of_the_heading() -> None:
    pose = Pose2(1.0, 2.0, pi / 2).compose(Pose2(3.0, 0.5, 0.2))
    assert (pose.x, pose.y, pose.phi) == pytest.approx((0.5, 5.0, pi / 2 + 0.2))


def test_relative_to_inverts_compose_and_wraps() -> None:
    frame, offset = Pose2(-3.0, 7.0, 2.5), Pose2(1.5, -0.4, 3.0)
    back = frame.compose(offset).relative_to(frame)
    assert (back.x, back.y, back.phi) == pytest.approx((1.5, -0.4, 3.0))
    assert Pose2(0.0, 0.0, 3.5).relative_to(Pose2(0.0, 0.0, 0.0)).phi == pytest.approx(3.5 - 2.0 * pi)


@pytest.mark.parametrize("name", ["x", "y", "phi"])
@pytest.mark.parametrize("value", [nan, inf, -inf])
def test_fields_must_be_finite(name: str, value: float) -> None:
    with pytest.raises(InputError, match=f"{name} = {value}") as caught:
        Pose2(**{"x": 0.0, "y": 0.0, "phi": 0.0} | {name: value})
    assert isinstance(caught.value, RtiMpccError)
    assert isinstance(caught.value, ValueError)


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
