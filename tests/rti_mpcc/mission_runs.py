"""Short drives of missions: `yards.Driver` with a mission in place of the controller, until it is over."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from math import inf
from typing import Any

import numpy as np

from estimation import Frame, GoalMeasurement
from geometry import Area, Pose2
from rti_mpcc import Command, ControllerConfig, DockingController, DockingMission, Source, VehicleState
from rti_mpcc.mission import Step
from rti_mpcc.mission.state import StepRecord
from rti_mpcc.types import MissionResult
from tests.rti_mpcc.yards import BRISK, DEAD_TIME, Drive, Driver

RUNNING, SUCCEEDED = MissionResult.RUNNING, MissionResult.SUCCEEDED
NOT_REACHED, TIMED_OUT = MissionResult.NOT_REACHED, MissionResult.TIMED_OUT
CANCELLED = MissionResult.CANCELLED
STILL = 0.02
"""Slower than this a vehicle stands [m/s]."""


@dataclass(slots=True, kw_only=True)
class UntilOver:
    """Steps a mission, and lets the drive end with it.

    Attributes:
        mission: that drives; before: called before each cycle with its time [s].
        signal: told in each cycle, at its time [s].
        times, commands: of all cycles.
    """

    mission: DockingMission
    before: Callable[[float], None] = lambda now: None
    signal: Callable[[float], bool | None] = lambda now: None
    times: list[float] = field(default_factory=list)
    commands: list[Command] = field(default_factory=list)

    def step(self, state: VehicleState, *, now: float, **unused_goal: Any) -> Command:
        self.before(now)
        command = self.mission.step(state, now=now, signal=self.signal(now), **unused_goal)
        self.times.append(now)
        self.commands.append(command)
        return replace(command, docked=self.mission.result is not RUNNING)


def mission_in(
    area: Area, steps: Sequence[Step], *, config: ControllerConfig = BRISK, home: Pose2 | None = None
) -> DockingMission:
    """On a controller in an area."""
    return DockingMission(DockingController.in_area(area, config), steps, home=home)


def driven(
    mission: DockingMission,
    area: Area,
    seconds: float,
    *,
    before: Callable[[float], None] = lambda now: None,
    signal: Callable[[float], bool | None] = lambda now: None,
    after: float = 0.3,
    **driver: Any,
) -> Drive:
    """Drive it for so long, or until it has been over for a while; judged by what must always be so."""
    loop = UntilOver(mission=mission, before=before, signal=signal)
    driver.setdefault("goal_at", lambda now: None)
    drive = Driver(area=area, controller=loop, **driver).drive(seconds, after_docking=after)
    drive = replace(drive, commands=tuple(loop.commands))
    assert_sane(drive, mission.controller.config)
    return drive


def assert_sane(drive: Drive, config: ControllerConfig = BRISK) -> None:
    """Every command is finite, within the limits, and says where it comes from; each reason is one line."""
    commanded, limits = np.abs(drive.commanded()), config.limits
    assert np.isfinite(commanded).all()
    assert (commanded <= np.array([limits.acceleration, limits.steering_rate]) + 1e-9).all()
    for command in drive.commands:
        assert isinstance(command.source, Source)
        assert len(command.diagnostics.reason.splitlines()) <= 1
        assert command.mission is not None
        assert len(command.mission.reason.splitlines()) <= 1


def assert_stays(drive: Drive, begin: float) -> None:
    """It stands from then on [s], and nothing else is asked of it."""
    later = drive.between(begin, inf)
    assert len(drive.times[later]) > 0
    assert np.abs(drive.states[later, 3]).max() <= STILL
    moved = np.ptp(drive.states[later, :3], axis=0)
    assert (moved <= 0.01).all(), moved


def stop_time(speed: float, config: ControllerConfig = BRISK, cycles: int = 6) -> float:
    """So long a vehicle may take to stand once it is told to [s]."""
    return speed / config.limits.acceleration + DEAD_TIME + cycles * config.cycle


def results(log: Sequence[StepRecord]) -> list[tuple[str, int, int, MissionResult]]:
    """Kind, place, attempt and result of each step that was begun."""
    return [(record.kind, record.place, record.attempt, record.result) for record in log]


def seen_dock(at: Pose2) -> Callable[[float, Any], list[Any]]:
    """Detections of a dock at a pose, without noise."""

    def measurements_at(now: float, plant: Any) -> list[Any]:
        p = at.relative_to(Pose2(plant.x, plant.y, plant.phi))
        return [GoalMeasurement(stamp=now, x=p.x, y=p.y, phi=p.phi, frame=Frame.VEHICLE)]

    return measurements_at
