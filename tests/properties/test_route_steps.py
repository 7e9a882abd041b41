"""Steps of a mission near what they divide by: distances of 0, wheels that hardly turn."""

from __future__ import annotations

from math import inf, nan

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from geometry import Area, InputError, Pose2
from rti_mpcc.config import ControllerConfig
from rti_mpcc.mission import Approach, Straight, Undock
from rti_mpcc.mission.straight import straight_order

FEW = settings(derandomize=True, deadline=None, max_examples=60)

CONFIG = ControllerConfig()
YARD = Area(boundary=[(-60.0, -60.0), (60.0, -60.0), (60.0, 60.0), (-60.0, 60.0)])
HERE = Pose2(1.0, -2.0, 0.4)
DISTANCES = st.tuples(
    st.sampled_from([1.0, -1.0]),
    st.one_of(st.sampled_from([5e-324, 1e-17, 1e-9, 2e-9, 1e-6]), st.floats(1e-3, 20.0)),
).map(lambda pair: pair[0] * pair[1])
TURNS = st.floats(-320.0, 0.0).map(lambda n: 10.0**n)
"""Of the wheels [rad], or curvatures [1/m]."""


@pytest.mark.parametrize("distance", [0.0, -0.0, nan, inf])
def test_a_step_of_no_distance_is_refused(distance: float) -> None:
    for step in (Undock, Straight):
        with pytest.raises(InputError):
            step(distance)
    with pytest.raises(InputError):
        Approach(length=distance, direction=1)


@FEW
@given(distance=DISTANCES.filter(lambda distance: abs(distance) > 1e-300), steering=TURNS)
@example(distance=1e-17, steering=0.05)
@example(distance=-1.0, steering=0.05)
@example(distance=1.0, steering=5e-324)
@example(distance=1.0, steering=1e-310)
def test_a_straight_move_without_errors_is_as_long_as_its_distance_however_little_it_may_steer(
    distance: float, steering: float
) -> None:
    step = Straight(distance, steering=steering, tolerance=(0.01, 0.01))
    order, problem = straight_order(step, None, HERE, YARD, CONFIG)
    assert problem == ""
    assert order is not None
    assert order.manoeuvre.segments[0].length == pytest.approx(abs(distance))
