"""Contacts on the way between stages, where corners pass each other."""

from __future__ import annotations

import numpy as np
import pytest

from geometry import Corridor, Pose2, ReferencePath
from rti_mpcc.config import Vehicle
from rti_mpcc.model.bicycle import rollout
from rti_mpcc.model.footprint import PIECES, body_of
from rti_mpcc.model.layout import DELTA, PHI, POSE, V
from rti_mpcc.ocp.corridor_rows import stage_contacts
from rti_mpcc.ocp.horizon import states_at
from rti_mpcc.types import Trajectory
from tests.geometry.sides import Contacts, contacts_of

VEHICLE, MARGIN = Vehicle(), 0.1
BODY = body_of(VEHICLE, PIECES)
LENGTH = 0.3
"""Of the stages [s], driven at 1 m/s."""


def turning(late: float) -> Trajectory:
    """Forward on a circle to the left, its stages so much later on it [s]."""
    begin = np.zeros(6)
    begin[V], begin[DELTA] = 1.0, 0.5
    lengths = np.array([late, *[LENGTH] * 15])
    states = rollout(begin, np.zeros((16, 3)), lengths, VEHICLE.wheelbase)
    times = np.append(0.0, np.cumsum(lengths))
    return Trajectory(times=times, states=states, controls=np.zeros((16, 3)))


def beside_a_corner() -> Corridor:
    """A corner that the front right corner of the body passes by 0.08 m as it swings out."""
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 30.0)])
    at = turning(2.0).states[1]
    c, s = np.cos(at[PHI]), np.sin(at[PHI])
    x, y = (
        at[0] + VEHICLE.front * c + 0.5 * VEHICLE.width * s,
        at[1] + VEHICLE.front * s - 0.5 * VEHICLE.width * c,
    )
    turn = np.arctan2(
        VEHICLE.front * np.tan(0.5) / VEHICLE.wheelbase,
        1.0 + 0.5 * VEHICLE.width * np.tan(0.5) / VEHICLE.wheelbase,
    )
    way = at[PHI] + turn
    x, y = x + 0.08 * np.sin(way), y - 0.08 * np.cos(way)
    out = np.array([np.sin(way), -np.cos(way)])
    along = np.array([np.cos(way), np.sin(way)])
    corner = np.array([x, y])
    ring = [corner, corner + 2.0 * (out - along), corner + 4.0 * out, corner + 2.0 * (out + along)]
    return Corridor.from_offsets(path, left=20.0, right=-20.0, obstacles=[ring])


def contacts_along(corridor: Corridor, plan: Trajectory) -> Contacts:
    """At its stages, or on the way there."""
    return Contacts(stage_contacts(corridor.spaces[0], BODY, plan, MARGIN, VEHICLE.wheelbase))


def nearest(plan: Trajectory) -> float:
    """The least distance to the obstacle at the stages of a plan [m]."""
    return float(contacts_along(beside_a_corner(), plan).apart[..., 2].min())


@pytest.mark.parametrize("late", [0.05, 0.1, 0.15, 0.2, 0.25, 0.3])
def test_what_a_corner_comes_to_between_stages_is_known(late: float) -> None:
    plan = turning(late)
    fine = states_at(plan, np.linspace(0.0, plan.times[-1], 2001), VEHICLE.wheelbase)[:, :POSE]
    least = contacts_of(beside_a_corner(), 0, BODY, fine, 1.1).apart[..., 2].min()
    assert least == pytest.approx(0.08, abs=0.002)
    assert nearest(plan) == pytest.approx(least, abs=0.01)


def test_normals_and_points_are_those_of_the_stage() -> None:
    """As all bodies are moved, and turned about their axles, the distance changes by the half-plane."""
    plan, corridor = turning(0.15), beside_a_corner()
    found = contacts_along(corridor, plan)
    k, piece = np.unravel_index(np.argmin(found.apart[..., 2]), found.apart.shape[:2])
    for turn_most in (0.0, 1e-4):
        for change in np.random.default_rng(3).uniform(-1e-4, 1e-4, (20, 3)) * (1.0, 1.0, turn_most / 1e-4):
            states = plan.states.copy()
            states[:, :POSE] += change
            moved = Trajectory(times=plan.times, states=states, controls=plan.controls)
            after = contacts_along(corridor, moved).apart[k, piece, 2]
            normal = found.normal[k, piece, 2] * np.exp(1j * plan.states[k + 1, PHI])
            slopes = np.array([normal.real, normal.imag, (found.at.conj() * found.normal).imag[k, piece, 2]])
            # The way from a stage to where the body is nearest turns with it.
            most = 1e-7 + LENGTH * turn_most
            assert after - found.apart[k, piece, 2] == pytest.approx(slopes @ change, abs=most)


def test_beside_walls_without_corners_nothing_is_looked_at_twice() -> None:
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 30.0)])
    corridor, plan = Corridor.from_offsets(path, left=6.0, right=-1.2), turning(0.2)
    found = contacts_along(corridor, plan)
    plain = contacts_of(corridor, 0, BODY, plan.states[1:, :POSE], 1.1, 0.02)
    assert np.isfinite(plain.apart).any()
    np.testing.assert_array_equal(found.values, plain.values)
