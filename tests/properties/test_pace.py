"""The pace divides by a curvature and by a turn of the wheels per metre: what holds at 0 and around it."""

from __future__ import annotations

from math import sqrt

import numpy as np
from hypothesis import example, given
from hypothesis import strategies as st

from geometry import Corridor, Pose2, ReferencePath
from rti_mpcc.config import ControllerConfig
from rti_mpcc.ocp.room import room_along
from rti_mpcc.planning.pace import pace_of
from tests.properties.magnitudes import examples, few_examples, from_zero, positive, signed

CONFIG = ControllerConfig()
MOST = CONFIG.limits.speed
HALF_WIDTH = 0.5 * CONFIG.vehicle.width


def path_of(*pieces: tuple[float, float]) -> ReferencePath:
    """Pieces of a curvature [1/m] and a length [m], driven forwards."""
    return ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, *piece) for piece in pieces])


@given(signed(1e-12, 1e3), positive(1e-9, 100.0))
@example(0.0, 1e-9)
@example(0.0, 30.0)
@example(1e3, 1e-9)
@examples
def test_on_an_arc_the_pace_is_that_of_the_lateral_acceleration_and_never_above_the_limit(
    curvature: float, length: float
) -> None:
    pace = pace_of(path_of((curvature, length)).parts[0], CONFIG)
    expected = min(MOST, sqrt(CONFIG.comfort_lateral_acceleration / max(abs(curvature), 1e-12)))
    np.testing.assert_allclose(pace.speed, expected, rtol=1e-6)


@given(st.floats(0.0, 0.23), st.floats(1.0, 2.0), positive(0.1, 100.0))
@example(0.0, 2.0, 30.0)
@examples
def test_a_sharper_bend_is_never_driven_faster(curvature: float, sharper: float, length: float) -> None:
    gentle, sharp = (
        pace_of(path_of((0.0, length), (each, length)).parts[0], CONFIG).speed
        for each in (curvature, sharper * curvature)
    )
    assert (sharp <= gentle * (1.0 + 1e-9)).all()


LANE = path_of((0.0, 10.0))
"""Between walls whose distance is drawn."""


def speed_between(half_width: float, config: ControllerConfig = CONFIG) -> float:
    """Highest speed [m/s] in a lane with walls so far [m] to either side of the path."""
    corridor = Corridor.from_offsets(LANE, left=half_width, right=-half_width)
    return float(room_along(LANE.parts[0], corridor, 0, config).speed.min())


@given(st.floats(0.5 * HALF_WIDTH, HALF_WIDTH + 2.0), from_zero(1e-9, 1.0))
@example(HALF_WIDTH - 0.01, 0.05)
@example(HALF_WIDTH, 0.0)
@example(HALF_WIDTH + CONFIG.caution.hard_minimum - 1e-6, 2e-6)
@few_examples
def test_a_narrower_lane_is_never_driven_faster(half_width: float, wider: float) -> None:
    narrow, wide = speed_between(half_width), speed_between(half_width + wider)
    assert CONFIG.narrow_passage.speed * (1.0 - 1e-9) <= narrow <= wide * (1.0 + 1e-9)
