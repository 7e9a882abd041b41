"""Park on a map: an occupancy grid in the format of ROS, a start and a goal, and no path.

This example makes its map; for a map of your own call `Area.from_map("yard.yaml")`. A van parks on the route:
the vehicle stops, replans from there, and drives the new route.
"""

from __future__ import annotations

from math import hypot, pi
from pathlib import Path

import numpy as np

from geometry import Area, Pose2
from rti_mpcc import ControllerConfig, DockingController, Status, prepare_process
from rti_mpcc.simulation.plant import PlantParameters, PlantState, advance, issue

FREE, OCCUPIED, CELL = 254, 0, 0.1  # grey values of a map_server picture, [m] a cell
YAML = f"image: yard.pgm\nresolution: {CELL}\norigin: [-2.0, -2.0, 0.0]\n"
YAML += "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.2\n"
BAY = Pose2(21.0, 0.0, 0.5 * pi)  # of the rear axle: in reverse, between two cars
VAN, PARKS_AT = [(13.0, 6.0), (14.5, 6.0), (14.5, 9.0), (13.0, 9.0)], 3.0  # [m], [s]


def draw(folder: Path) -> Path:
    """A yard of 30 m by 16 m with a row of bays at its lower side, two of them taken, as picture and YAML."""
    cells = np.full((160, 300), FREE, dtype=np.uint8)
    cells[:3] = cells[-3:] = cells[:, :3] = cells[:, -3:] = OCCUPIED
    for x in (17.8, 22.4):  # cars, 1.8 m by 4.6 m, 2.8 m apart
        column = round((x + 2.0) / CELL)
        cells[109:155, column : column + 18] = OCCUPIED
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "yard.pgm").write_bytes(b"P5\n300 160\n255\n" + cells.tobytes())
    (folder / "yard.yaml").write_text(YAML)
    return folder / "yard.yaml"


def main() -> None:
    config = ControllerConfig(cycle=0.05, dead_time=0.18, comfort_acceleration=0.8)
    controller = DockingController.in_area(Area.from_map(draw(Path("runs/park_from_map"))), config)
    prepare_process()  # no pause for garbage in the first cycles
    parameters = PlantParameters.of(config.vehicle, config.limits, dead_time=config.dead_time)
    plant, status = PlantState(x=1.0, y=9.0, phi=0.0), None
    while plant.time < 120.0 and status is not Status.DOCKED:
        there = [VAN] if plant.time >= PARKS_AT else []
        command = controller.step(plant.measured, now=plant.time, goal=BAY, obstacles=there)
        if command.status is not status:
            status = command.status
            print(f"{plant.time:6.2f} s  {status.value}  {command.diagnostics.reason}")
        act = issue(plant, parameters, acceleration=command.acceleration, steering_rate=command.steering_rate)
        plant = advance(act, parameters, plant.time + config.cycle)
    error = Pose2(plant.x, plant.y, plant.phi).relative_to(BAY)
    print(f"{100 * hypot(error.x, error.y):.1f} cm off, planned anew: {controller.replans}")
    assert command.docked, command.status
    assert hypot(error.x, error.y) < 0.07
    assert controller.replans == 1


if __name__ == "__main__":
    main()
