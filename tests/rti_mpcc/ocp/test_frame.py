from __future__ import annotations

from math import pi

import numpy as np

from geometry import Pose2, ReferencePath
from rti_mpcc.model.layout import PHI
from rti_mpcc.ocp.frenet import (
    HEADING,
    LocalFrame,
    frenet_errors,
    local_to_world,
    pose_in,
    reference_in,
    world_to_local,
)

FRAME = LocalFrame(x=5000.0, y=-3000.0, phi=7.5)


def test_in_and_out_are_inverse_and_the_origin_is_zero() -> None:
    states = np.random.default_rng(2).uniform(-10.0, 10.0, (8, 6))
    states += np.array([5000.0, -3000.0, 7.0, 0.0, 0.0, 0.0])
    np.testing.assert_allclose(local_to_world(FRAME, world_to_local(FRAME, states)), states, atol=1e-11)
    local = world_to_local(LocalFrame(*states[3, :3].tolist()), states)
    np.testing.assert_allclose(local[3, :3], 0.0, atol=1e-12)
    np.testing.assert_allclose(local[:, 3:], states[:, 3:])


def test_headings_keep_their_branch() -> None:
    state = np.array([5000.0, -3000.0, 7.5 + 4.0 * pi, 0.0, 0.0, 0.0])
    assert world_to_local(FRAME, state[None])[0, PHI] == 4.0 * pi
    assert pose_in(FRAME, Pose2(5000.0, -3000.0, 7.5 + 4.0 * pi))[PHI] == 4.0 * pi


def test_frenet_errors_do_not_depend_on_the_frame() -> None:
    part = ReferencePath.from_segments(Pose2(5000.0, -3000.0, 1.0), [(-1, 0.2, 10.0)]).parts[0]
    states = np.random.default_rng(4).uniform(-2.0, 2.0, (6, 6))
    states += np.array([5000.0, -3000.0, 0.0, 0.0, 0.0, 5.0])
    reference = part.reference(states[:, 5])
    world = frenet_errors(states, reference, -1)
    local = frenet_errors(world_to_local(FRAME, states), reference_in(FRAME, reference), -1)
    np.testing.assert_allclose(local.values, world.values, atol=1e-9)
    np.testing.assert_allclose(local.values[:, HEADING], world.values[:, HEADING], atol=1e-12)
