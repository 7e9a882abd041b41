"""What pulling out cannot mend."""

from __future__ import annotations

from math import pi

from geometry import Pose2
from rti_mpcc.simulation import changed
from rti_mpcc.simulation.metrics import pull_outs
from rti_mpcc.types import Status
from tests.rti_mpcc.docking_runs import drive, short


def test_a_goal_out_of_reach_ends_standing_with_a_reason() -> None:
    """Across a lane 0.7 m wider than the body is long: there is room for it, but no way to turn round to it.

    It is pulled out twice.
    """
    scenario = changed(short(), {"corridor": {"left": 2.6, "right": -2.6}})
    goal = scenario.build_path().parts[0].pose(8.0).compose(Pose2(0.0, -1.4, 0.5 * pi))
    run = list(drive(scenario, 165.0, goal_at=lambda now: goal))
    plant, command = run[-1]
    assert pull_outs([command.status for _, command in run]) == 2
    assert command.status in (Status.STALLED, Status.FAILED)
    assert abs(plant.v) <= 0.02
    assert "no plan" in command.diagnostics.reason or "not solved" in command.diagnostics.reason
    assert not any(command.docked for _, command in run)
