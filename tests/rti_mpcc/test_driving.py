"""What is driven while another plan is looked for in vain: the last one, unless it was brought to a stop."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from geometry import Corridor
from rti_mpcc import driving, scouting
from rti_mpcc.config import ControllerConfig
from rti_mpcc.controller import RtiMpcc
from rti_mpcc.planning.context import PlanningContext
from rti_mpcc.planning.pace import pace_of
from rti_mpcc.planning.search import ITERATIONS, SqpResult
from rti_mpcc.planning.state import ControllerState, Phase
from rti_mpcc.planning.stops import REPLAN_INTERVAL
from rti_mpcc.planning.workspace import Workspace
from rti_mpcc.scouting import Found
from rti_mpcc.simulation import docking_controller, load_scenario
from rti_mpcc.types import Source, Status, Trajectory
from tests.rti_mpcc.docking_runs import Clocked, drive, granting
from tests.rti_mpcc.states import NOW, PATH, contexts, state

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
    interval = REPLAN_INTERVAL
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
    assert 1 < len(looked) <= ITERATIONS
    gaps = [later - before for before, later in pairwise(looked)]
    assert gaps == pytest.approx([ControllerConfig().cycle] * len(gaps))
    assert begun == looked[-1]


@pytest.mark.parametrize(("latched", "source"), [("", Source.SHIFTED_PLAN), ("why", Source.BRAKING)])
def test_without_a_first_plan_in_one_cycle_it_drives_on_unless_it_was_brought_to_a_stop(
    latched: str, source: Source, monkeypatch: pytest.MonkeyPatch
) -> None:
    """So it is where it joins another way on the move."""

    def first_plan(s: ControllerState, context: PlanningContext, w: Workspace) -> Found:
        return Found(s, SqpResult(solutions=(), problem="not solved", corridor_infeasible=False), context)

    monkeypatch.setattr(driving, "first_plan", first_plan)
    config, context = ControllerConfig(), contexts()
    mpcc = RtiMpcc(PATH.parts[0], Corridor.from_offsets(PATH, left=5.0, right=-5.0), config)
    pace = pace_of(PATH.parts[0], config)
    w = Workspace(config=config, mpcc=mpcc, pace=pace, start=context.state, clock=granting(1))
    times = context.begin + np.linspace(0.0, 5.0, 51)
    way = 10.0 + times - times[0]
    states = np.column_stack([way, 0 * way, 0 * way, np.ones(51), 0 * way, way])
    plan = Trajectory(times=times, states=states, controls=np.zeros((50, 3)))
    s = state(phase=Phase.STARTING, driven=plan, accepted_at=NOW - config.cycle, latched=latched)
    assert driving._start(s, context, w).decision.control.source is source
