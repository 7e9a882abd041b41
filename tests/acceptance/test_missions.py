"""Whole missions: the built-in one by camera, drawn ones, undocking, cancelling, faults in every step."""

from __future__ import annotations

from math import isfinite, radians
from typing import Any

import numpy as np
import pytest

from benchmarks.problems.missions import drawn_mission, drawn_undocking
from rti_mpcc.config import ControllerConfig
from rti_mpcc.mission import DockingMission, DriveTo
from rti_mpcc.simulation import Scenario, changed, driver_of, load_scenario, simulate, summary
from rti_mpcc.simulation.plant import PlantState
from rti_mpcc.types import Command, MissionResult
from tests.rti_mpcc.docking_runs import obeyed

SEEDS = range(20)
DRAWN_SEED, DRAWN, AT_ONCE = 4242, 100, 5
UNDOCK_SEED, UNDOCKED, UNDOCKED_AT_ONCE = 551, 50, 10
CANCELS, CANCELLED_AT_ONCE = 200, 20
ACROSS, TURNED = 0.02, radians(0.5)
"""Largest errors at the contact [m], [rad]."""
T_GOAL = 45.0
PEAK = 1.1
"""Times the comfort value."""
AT_REST, STANDS = 0.02, 0.5
"""Slower than this [m/s] for so long [s] is a standstill."""


def standstills(figures_of: Any) -> int:
    """How often the vehicle stands while it docks, but at the begin and the end."""
    truth, end = figures_of.truth, figures_of.mission[0].end
    stands = np.abs(truth.v[truth.times <= end]) < AT_REST
    edges = np.flatnonzero(np.diff(stands.astype(int)))
    spells = np.split(np.arange(len(stands)), edges + 1)
    step = float(truth.times[1] - truth.times[0])
    inner = spells[1:-1] if stands[0] else spells[:-1]
    return sum(bool(stands[spell[0]]) and len(spell) * step >= STANDS for spell in inner)


@pytest.mark.parametrize("seed", SEEDS)
def test_the_built_in_mission_connects(seed: int, figures: dict[str, Any]) -> None:
    result = simulate(load_scenario("docking_mission"), seed=seed)
    told = summary(result)
    contact = next(step for step in told["mission"] if step["kind"] == "straight")
    figures["t_goal"], figures["peak"] = told["time_to_tolerance_s"], told["peak"]
    figures["contact"] = contact["final_error"]
    assert told["mission_result"] == "SUCCEEDED"
    assert len(told["mission"]) == 4  # nothing was tried again
    assert abs(contact["final_error"]["lateral_m"]) <= ACROSS
    assert abs(contact["final_error"]["heading_rad"]) <= TURNED
    assert told["time_to_tolerance_s"] <= T_GOAL
    assert standstills(result) == 1  # the change of direction
    for name in ("acceleration", "lateral_acceleration", "steering_rate"):
        assert told["peak"][name] <= PEAK * told["comfort"][name], name
    assert told["min_clearance_m"] > 0.0


@pytest.mark.parametrize("first", range(0, DRAWN, AT_ONCE))
def test_drawn_missions_connect_or_say_why_not(first: int, figures: dict[str, Any]) -> None:
    wrong, peaks = [], []
    for number in range(first, first + AT_ONCE):
        drawn = drawn_mission(DRAWN_SEED, number)
        told = summary(simulate(drawn.scenario, seed=number))
        peaks.append(told["peak"]["acceleration"] / told["comfort"]["acceleration"])
        assert told["min_clearance_m"] > 0.0, number
        for step in told["mission"]:
            if (step["kind"], step["result"]) == ("dock", "SUCCEEDED"):  # at the right dock
                assert abs(step["final_error"]["lateral_m"]) < 0.05, number
        if told["mission_result"] != drawn.expected.value:
            wrong.append((number, told["mission_result"], drawn.expected.value))
    figures["wrong"], figures["peaks"] = wrong, peaks
    assert len(wrong) <= 1, wrong


@pytest.mark.parametrize("first", range(0, UNDOCKED, UNDOCKED_AT_ONCE))
def test_vehicles_drive_out_of_drawn_docks(first: int) -> None:
    for number in range(first, first + UNDOCKED_AT_ONCE):
        scenario = drawn_undocking(UNDOCK_SEED, number)
        told = summary(simulate(scenario, seed=number))
        assert told["mission_result"] == "SUCCEEDED", number
        assert told["min_clearance_m"] > 0.0, number
        assert abs(told["mission"][0]["final_error"]["longitudinal_m"]) < 0.25


def lighter() -> Scenario:
    """The built-in mission by drawn detections, which take less time than pictures."""
    return changed(load_scenario("docking_mission"), {"goal.camera": None})


def driven(mission: DockingMission, plant: PlantState, until: float) -> tuple[PlantState, list[Command]]:
    """The mission in closed loop, its dock known, until a time [s] or its end."""
    scenario, config, commands = lighter(), mission.controller.config, []
    parameters = scenario.plant_parameters()
    while plant.time < until and mission.result is MissionResult.RUNNING:
        command = mission.step(plant.measured, now=plant.time)
        commands.append(command)
        plant = obeyed(plant, command, parameters, round(plant.time + config.cycle, 9))
    return plant, commands


@pytest.mark.parametrize("first", range(0, CANCELS, CANCELLED_AT_ONCE))
def test_cancelled_at_any_moment_it_stands_and_the_next_mission_works(first: int) -> None:
    known = changed(lighter(), {"goal.measurement": None})
    random = np.random.default_rng([77, first])
    for moment in random.uniform(0.0, 60.0, CANCELLED_AT_ONCE).tolist():
        mission = driver_of(known)
        assert isinstance(mission, DockingMission)
        start = known.start_pose()
        plant, _ = driven(mission, PlantState(x=start.x, y=start.y, phi=start.phi), moment)
        config: ControllerConfig = mission.controller.config
        speed, over = abs(plant.v), mission.result is not MissionResult.RUNNING
        mission.cancel()
        needed = speed / config.limits.acceleration + config.dead_time
        began = plant.time
        parameters = known.plant_parameters()
        while plant.time < began + 3.0:
            command = mission.step(plant.measured, now=plant.time)
            assert isfinite(command.acceleration)
            assert abs(command.acceleration) <= config.limits.acceleration
            plant = obeyed(plant, command, parameters, round(plant.time + config.cycle, 9))
            if plant.time > began + needed + 6.0 * config.cycle:
                assert abs(plant.v) < 0.05, moment
        assert mission.result is (MissionResult.SUCCEEDED if over else MissionResult.CANCELLED)
        again = DockingMission(mission.controller, [DriveTo(start)])
        plant, _ = driven(again, plant, plant.time + 120.0)
        assert again.result is MissionResult.SUCCEEDED, moment


KINDS = (
    "nan_state", "frozen_state", "state_jump", "lost_cycles", "late_cycles", "clock_back", "solver_fail",
    "solver_timeout", "stuck_steering", "weak_brakes", "goal_jump", "goal_nan", "blocked",
)  # fmt: skip
MOMENTS = {"dock forward": 8.0, "dock in reverse": 24.0, "wait": 35.0, "straight": 44.0, "undock": 52.0}
"""When the fault begins: in each step of the mission [s]."""


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("step", MOMENTS)
def test_the_promises_hold_with_a_fault_in_any_step(kind: str, step: str) -> None:
    begin = MOMENTS[step]
    fault: dict[str, Any] = {"kind": kind, "from": begin, "to": begin + 1.0}
    result = simulate(changed(lighter(), {"faults": [fault]}), seed=1)
    limits, cycles = result.config.limits, result.cycles
    for values, most in (
        (cycles.acceleration, limits.acceleration),
        (cycles.steering_rate, limits.steering_rate),
    ):
        assert np.isfinite(values).all()
        assert np.abs(values).max() <= most * (1.0 + 1e-9)
    told = summary(result)
    assert told["min_clearance_m"] > 0.0
    assert told["mission_result"] in {each.value for each in MissionResult} - {"RUNNING", "CANCELLED"}
    if kind != "blocked":  # what fills the way may stay until the patience is over
        assert told["mission_result"] == "SUCCEEDED", told["mission"]
