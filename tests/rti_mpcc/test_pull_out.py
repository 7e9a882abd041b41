"""A vehicle that has stalled pulls out and comes again, in closed loop."""

from __future__ import annotations

from itertools import groupby

import pytest

from geometry import Pose2
from rti_mpcc.types import Command, Status
from tests.rti_mpcc.docking_runs import drive, straight

LENGTH, ASIDE = 20.0, 0.6


def jumps(direction: int) -> list[tuple[Pose2, Command]]:
    """The goal jumps aside when the vehicle is nearly there: it has no room to get over to it."""
    scenario = straight(direction, LENGTH)
    goals = [Pose2(direction * LENGTH, y, 0.0) for y in (0.0, ASIDE)]
    run = drive(scenario, 90.0, goal_at=lambda now: goals[now > 16.0])
    return [(Pose2(plant.x, plant.y, plant.phi), command) for plant, command in run]


@pytest.mark.acceptance
@pytest.mark.parametrize("direction", [1, pytest.param(-1, marks=pytest.mark.acceptance)])
def test_a_goal_that_jumps_aside_at_the_end_is_come_to_again(direction: int) -> None:
    run = jumps(direction)
    said = [status for status, _ in groupby(command.status for _, command in run)]
    assert said.count(Status.PULLING_OUT) == 1
    assert Status.STALLED not in said
    pose, command = run[-1]
    assert command.docked
    error = pose.relative_to(Pose2(direction * LENGTH, ASIDE, 0.0))
    assert max(abs(error.x), abs(error.y)) <= 0.05
    back = [pose.x * direction for pose, command in run if command.status is Status.PULLING_OUT]
    assert min(back) == pytest.approx(max(back) - 8.0, abs=0.6)
    reasons = {command.diagnostics.reason for _, command in run if command.status is Status.PULLING_OUT}
    assert all("pulling out, to come again (1. time)" in reason for reason in reasons)
