"""What stands at the docks of a mission."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from geometry import Pose2
from rti_mpcc.planning.agenda import Agenda, Berth, Due
from rti_mpcc.steps import Dock, Wait

BODY = [(1.0, -1.0), (2.0, -1.0), (2.0, 1.0), (1.0, 1.0)]
ONE, OTHER = Pose2(0.0, 0.0, 0.0), Pose2(10.0, 0.0, 0.0)


def berth(pose: Pose2, *, body: bool = True) -> Berth:
    dock = Dock(pose, body=BODY if body else None)
    return Berth(dock=dock, place=0, pose=pose, body_at=pose)


def test_what_was_docked_at_goes_on_standing_there() -> None:
    there = Agenda(due=()).at(berth(ONE))
    assert len(there.standing) == 1
    for away in (there.at(None), there.at(berth(OTHER)), there.at(berth(OTHER, body=False))):
        assert any(np.array_equal(each, BODY) for each in away.standing)
    assert len(there.at(berth(OTHER)).at(None).standing) == 2


def test_docked_at_again_it_is_there_once_and_where_it_is_known_to_be_now() -> None:
    moved = berth(Pose2(0.3, 0.1, 0.05))
    again = Agenda(due=()).at(berth(ONE)).at(None).at(moved)
    (only,) = again.standing
    np.testing.assert_array_equal(only, moved.body)


def test_what_was_joined_is_gone() -> None:
    there = Agenda(due=()).at(berth(ONE))
    assert there.berth is not None
    joined = replace(there, berth=replace(there.berth, joined=True))
    assert joined.standing == ()
    assert joined.at(None).standing == ()


def test_the_step_is_the_first_one_that_is_due() -> None:
    step = Wait(1.0)
    assert Agenda(due=(Due(step=step, place=3),)).step is step
    assert Agenda(due=()).step is None
