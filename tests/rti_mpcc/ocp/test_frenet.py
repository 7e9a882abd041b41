from __future__ import annotations

from math import pi

import numpy as np
import pytest

from geometry import PathPart, Pose2, ReferencePath
from rti_mpcc.model.layout import STATES, THETA
from rti_mpcc.ocp.frenet import CONTOURING, HEADING, LAG, frenet_errors
from rti_mpcc.types import Array
from tests.rti_mpcc.differences import slopes

ARCS = [(1, 0.0), (1, 0.2), (1, -0.15), (-1, 0.0), (-1, 0.2), (-1, -0.15)]


def part(direction: int, curvature: float) -> PathPart:
    return ReferencePath.from_segments(Pose2(1.0, -2.0, 2.9), [(direction, curvature, 12.0)]).parts[0]


@pytest.mark.parametrize(("direction", "curvature"), ARCS)
def test_slopes(direction: int, curvature: float) -> None:
    way, random = part(direction, curvature), np.random.default_rng(3)
    states = random.uniform(-3.0, 3.0, (20, STATES))
    states[:, THETA] = random.uniform(0.5, 11.5, 20)
    errors = frenet_errors(states, way.reference(states[:, THETA]), direction)
    for k, state in enumerate(states):

        def all_errors(z: Array) -> Array:
            at = way.reference(z[THETA : THETA + 1])
            return np.asarray(frenet_errors(z[None], at, direction).values[0])

        expected = slopes(all_errors, state)
        np.testing.assert_allclose(errors.slopes[k], expected, atol=1e-7)


@pytest.mark.parametrize("direction", [1, -1])
def test_errors_beside_ahead_of_and_turned_to_the_reference(direction: int) -> None:
    way = ReferencePath.from_segments(Pose2(0.0, 0.0, pi / 2.0), [(direction, 0.0, 10.0)]).parts[0]
    at = way.pose(4.0)
    lag, left, turn = 0.3, 0.5, 0.1  # in the frame of the vehicle's heading
    pose = at.compose(Pose2(lag, left, turn))
    state = np.array([[pose.x, pose.y, pose.phi, 0.0, 0.0, 4.0]])
    errors = frenet_errors(state, way.reference(np.array([4.0])), direction)
    np.testing.assert_allclose(errors.values[0, [LAG, CONTOURING, HEADING]], [lag, left, turn])
