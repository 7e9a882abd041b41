"""Noise and a steering that is off, beside walls: found by campaigns, where it kicked the steering."""

from __future__ import annotations

import pytest

from rti_mpcc.simulation import Scenario, simulate, summary
from tests.rti_mpcc.docking_runs import BODY_HALF_WIDTH, FREE_SIDE, straight

NOISE = [0.005, 0.005, 0.002, 0.01, 0.002]
"""Of the measured state."""


def between_walls(direction: int, offset: float) -> Scenario:
    """16 m between walls that leave 0.25 m on either side, 0.3 m beside the path, at up to 2.3 m/s."""
    half = BODY_HALF_WIDTH + FREE_SIDE
    walls = {"from": 12.0, "to": 28.0, "left": 0.3 + half, "right": 0.3 - half}
    return straight(direction, corridor={"narrowings": [walls]}, state_noise=NOISE, steering_offset=offset)


@pytest.mark.acceptance
@pytest.mark.parametrize(
    ("direction", "offset"),
    [*(pytest.param(d, 0.0175, marks=pytest.mark.acceptance) for d in (1, -1)), (-1, -0.0175)],
)
def test_noise_beside_a_wall_is_not_answered_with_all_the_steering(direction: int, offset: float) -> None:
    figures = summary(simulate(between_walls(direction, offset), seed=1))
    assert figures["docked"]
    assert figures["min_clearance_m"] > 0.09
    assert figures["solver"]["failures"] == 0
    assert figures["peak"]["steering_rate"] < 0.5
    assert figures["energy"]["steering_rate"] < 0.15
