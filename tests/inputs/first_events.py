"""Drive until each kind of event first takes place, and print what its cycles load. For a fresh process:

    python -m tests.inputs.first_events FOLDER KIND...

For each kind a controller is made and makes one ordinary cycle. From then on each cycle is watched for
modules that are imported, files that are opened, Python code that is compiled, and kernels that numba
compiles. Nothing is imported here but what a loop of a user imports: what else is loaded would not be noticed
any more.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from math import cos, nan, sin, tan
from pathlib import Path
from typing import Any

from numba.core import event

from rti_mpcc import (
    Area,
    Command,
    ControllerConfig,
    Corridor,
    Dock,
    DockingController,
    DockingMission,
    DriveTo,
    GoalMeasurement,
    MissionResult,
    Pose2,
    ReferencePath,
    Straight,
    Undock,
    VehicleState,
    Wait,
)

FOLDER = Path(sys.argv[1])
CONFIG = ControllerConfig(cycle=0.1, comfort_acceleration=1.2)
PATH = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 8.0)])
LONG = ReferencePath.from_segments(PATH.start, [(1, 0.0, 20.0)])
YARD = Area(boundary=[(-8.0, -8.0), (32.0, -8.0), (32.0, 8.0), (-8.0, 8.0)])
THERE_AND_BACK = ReferencePath.from_segments(PATH.start, [(1, 0.0, 4.0), (-1, 0.1, 4.0)])
BESIDE = [(4.0, 2.0), (5.0, 2.0), (5.0, 3.0), (4.0, 3.0)]
"""An obstacle that is passed,"""
ACROSS = [(12.0, -8.0), (12.5, -8.0), (12.5, 2.5), (12.0, 2.5)]
"""and one that the route leads into."""
FAR = Pose2(900.0, 0.0, 0.0)


class Watch(event.Listener):  # type: ignore[misc]
    """What cycles load, in words."""

    def __init__(self) -> None:
        self.loaded: list[str] = []
        self._on = False
        event.register("numba:compile", self)
        sys.addaudithook(self._audit)

    def _audit(self, name: str, given: tuple[Any, ...]) -> None:
        if self._on and name in ("import", "open", "compile"):
            self.loaded.append(f"{name} {given[1 if name == 'compile' else 0]}")

    def on_start(self, event: Any) -> None:
        if self._on:
            self.loaded.append(f"kernel {event.data['dispatcher'].__name__}")

    def on_end(self, event: Any) -> None:
        """Nothing to note."""

    @contextmanager
    def cycle(self) -> Iterator[None]:
        before = set(sys.modules)
        self._on = True
        try:
            yield
        finally:
            self._on = False
            self.loaded += [f"module {name}" for name in sorted(set(sys.modules) - before)]


class Ride:
    """A bicycle without dead time that is driven in a loop."""

    def __init__(self, driver: Any) -> None:
        self.driver, self.watch, self.now, self.sees = driver, Watch(), 0.0, False
        self.state = VehicleState(x=0.0, y=0.0, phi=0.0, v=0.0, delta=0.0)

    def ordinary_cycle(self) -> None:
        """One that is not watched."""
        self._move(self.driver.step(self.state, now=self.now))

    def until(self, happened: Callable[[Command], bool], seconds: float = 60.0, **given: Any) -> bool:
        """Watched cycles; whether it happened in this time [s]."""
        end = self.now + seconds
        while self.now < end:
            if self.sees:
                given["measurements"] = [GoalMeasurement(stamp=self.now, x=8.2, y=0.1, phi=0.02)]
            with self.watch.cycle():
                command: Command = self.driver.step(self.state, now=self.now, **given)
            if happened(command):
                return True
            self._move(command)
        return False

    def _move(self, command: Command) -> None:
        s, h = self.state, CONFIG.cycle
        delta, v = s.delta + 0.5 * h * command.steering_rate, s.v + 0.5 * h * command.acceleration
        turn = h * v * tan(delta) / CONFIG.vehicle.wheelbase
        phi = s.phi + 0.5 * turn
        self.state = VehicleState(
            x=s.x + h * v * cos(phi),
            y=s.y + h * v * sin(phi),
            phi=s.phi + turn,
            v=s.v + h * command.acceleration,
            delta=s.delta + h * command.steering_rate,
        )
        self.now += h


def started(driver: Any) -> Ride:
    """One that has made its ordinary cycle."""
    ride = Ride(driver)
    ride.ordinary_cycle()
    return ride


def controller_on(path: ReferencePath = PATH) -> DockingController:
    return DockingController(path, Corridor.from_offsets(path, left=8.0, right=-8.0), CONFIG)


def on_path(path: ReferencePath = PATH) -> Ride:
    return started(controller_on(path))


def first_detection(ride: Ride | None = None) -> tuple[Ride, bool]:
    ride = ride or on_path()
    ride.until(lambda command: ride.state.x > 1.0)
    ride.sees = True
    docked = ride.until(lambda command: command.docked)
    return ride, docked and ride.state.x > 8.1


def first_obstacle() -> tuple[Ride, bool]:
    ride = on_path()
    ride.until(lambda command: ride.state.x > 1.0)
    return ride, ride.until(lambda command: command.docked, obstacles=[BESIDE])


def first_change_of_direction() -> tuple[Ride, bool]:
    ride = on_path(THERE_AND_BACK)
    return ride, ride.until(lambda command: command.docked)


def first_replan() -> tuple[Ride, bool]:
    ride = on_path(LONG)
    docked = ride.until(lambda command: command.docked, obstacles=[ACROSS])
    return ride, docked and ride.driver.replans > 0


def first_refused_goal() -> tuple[Ride, bool]:
    ride = on_path()
    return ride, ride.until(lambda command: "goal" in command.diagnostics.reason, goal=FAR)


def first_unusable_input() -> tuple[Ride, bool]:
    ride = on_path()
    ride.until(lambda command: ride.state.x > 1.0)
    good, ride.state = ride.state, VehicleState(x=nan, y=0.0, phi=0.0, v=0.0, delta=0.0)
    refused = ride.until(lambda command: True, obstacles=[[(0.0, nan)]])
    ride.state = good
    return ride, refused and ride.until(lambda command: command.docked, obstacles=[])


def first_steps() -> tuple[Ride, bool]:
    ride = on_path()
    return driven([Wait(0.1), Dock()], ride.driver, ride)


def first_steps_in_an_area() -> tuple[Ride, bool]:
    controller = DockingController.in_area(YARD, CONFIG)
    steps = [DriveTo(Pose2(5.0, 0.5, 0.0)), Straight(0.5), Wait(0.1), Undock(1.0)]
    return driven(steps, controller, started(controller))


def driven(steps: list[Any], controller: DockingController, ride: Ride) -> tuple[Ride, bool]:
    ride.driver = mission = DockingMission(controller, steps)
    over = ride.until(lambda command: mission.result is not MissionResult.RUNNING)
    return ride, over and mission.result is MissionResult.SUCCEEDED


def first_plan_in_an_area(area: Area = YARD) -> tuple[Ride, bool]:
    ride = started(DockingController.in_area(area, CONFIG))
    return ride, ride.until(lambda command: command.docked, goal=Pose2(8.0, 2.0, 0.5))


def first_plan_on_a_map() -> tuple[Ride, bool]:
    (FOLDER / "yard.pgm").write_bytes(b"P5\n200 80\n255\n" + bytes([254]) * 16000)
    (FOLDER / "yard.yaml").write_text(
        "image: yard.pgm\nresolution: 0.2\norigin: [-8.0, -8.0, 0.0]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.2\n"
    )
    return first_plan_in_an_area(Area.from_map(FOLDER / "yard.yaml"))


def first_recorded_detection() -> tuple[Ride, bool]:
    from rti_mpcc.recording import Recorder

    recorder = Recorder(controller_on(), FOLDER / "recording.jsonl")
    return first_detection(started(recorder))


def main() -> None:
    rides = {kind: globals()[kind]() for kind in sys.argv[2:]}
    found = {kind: {"loaded": ride.watch.loaded, "happened": done} for kind, (ride, done) in rides.items()}
    sys.stdout.write(json.dumps(found))


if __name__ == "__main__":
    main()
