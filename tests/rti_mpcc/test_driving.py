"""From a cruise to an arrival: one that cannot be driven is looked for again, and the cruise goes on."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import pytest

from rti_mpcc import driving, scouting
from rti_mpcc.config import ControllerConfig
from rti_mpcc.planning.context import PlanningContext
from rti_mpcc.planning.state import ControllerState
from rti_mpcc.planning.workspace import Workspace
from rti_mpcc.scouting import Found
from rti_mpcc.simulation import docking_controller, load_scenario
from rti_mpcc.types import Source, Status
from tests.rti_mpcc.docking_runs import Clocked, drive, granting

IN_VAIN = 3


def test_an_arrival_that_goes_through_something_is_looked_for_again_from_nearer(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    looked: list[float] = []

    def first_plan(s: ControllerState, context: PlanningContext, w: Workspace) -> Found:
        found = scouting.first_plan(s, context, w)
        if s.is_stationary or found.s.task.arrival is None or len(looked) > IN_VAIN:
            return found
        looked.append(s.now)
        infeasible = len(looked) <= IN_VAIN
        return found._replace(attempt=replace(found.attempt, corridor_infeasible=infeasible))

    monkeypatch.setattr(driving, "first_plan", first_plan)
    statuses: list[Status] = []
    for plant, command in drive(load_scenario("long_approach"), 60.0):
        statuses.append(command.status)
        assert command.source is Source.SOLUTION
        if command.status is Status.ARRIVING:
            assert plant.time == looked[-1]
            break
    assert len(looked) == IN_VAIN + 1
    interval = ControllerConfig().retries.replan_interval
    gaps = [later - before for before, later in pairwise(looked)]
    assert gaps == pytest.approx([interval] * IN_VAIN, abs=ControllerConfig().cycle)
    assert set(statuses[:-1]) == {Status.FOLLOWING}


def test_a_search_for_an_arrival_that_ran_out_of_time_goes_on_in_the_next_cycle(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What it has come to by then may go through something: it has not come to its end."""
    looked: list[float] = []

    def first_plan(s: ControllerState, context: PlanningContext, w: Workspace) -> Found:
        found = scouting.first_plan(s, context, w)
        if s.is_stationary:
            return found
        looked.append(s.now)
        return found._replace(attempt=replace(found.attempt, corridor_infeasible=found.attempt.out_of_time))

    monkeypatch.setattr(driving, "first_plan", first_plan)
    scenario = load_scenario("long_approach")
    controller = Clocked(docking_controller(scenario), lambda _: granting(2))
    run = drive(scenario, 60.0, controller=controller)
    begun = next(plant.time for plant, command in run if command.status is Status.ARRIVING)
    assert 1 < len(looked) <= ControllerConfig().search.iterations
    gaps = [later - before for before, later in pairwise(looked)]
    assert gaps == pytest.approx([ControllerConfig().cycle] * len(gaps))
    assert begun == looked[-1]
