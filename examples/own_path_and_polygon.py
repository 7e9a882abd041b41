"""Bring your own path and corridor: past a bay, then back into it, in a yard whose outline is a polygon."""

from __future__ import annotations

from math import hypot, pi

from geometry import Corridor, Pose2, ReferencePath
from rti_mpcc import ControllerConfig, DockingController, Status, prepare_process
from rti_mpcc.simulation.plant import PlantParameters, PlantState, advance, issue

# Poses of the rear axle: x, y [m], heading of the vehicle [rad]; the path joins them by arcs.
# `ReferencePath.from_waypoints` takes points without headings, `from_csv` a file.
POSES = [Pose2(0.0, 0.0, 0.0), Pose2(8.0, 0.0, 0.0), Pose2(16.0, 2.2, 0.55), Pose2(10.0, -8.0, pi / 2)]
DIRECTIONS = [1, 1, -1]  # of the ways between them: the third is driven in reverse

# What may be driven on: a yard, and a bay 3.6 m wide below it.
YARD = [(-3.0, -4.0), (8.2, -4.0), (8.2, -11.0), (11.8, -11.0), (11.8, -4.0), (25.0, -4.0)]
YARD += [(25.0, 8.0), (-3.0, 8.0)]


def main() -> None:
    path = ReferencePath.from_poses(POSES, DIRECTIONS)
    corridor = Corridor.from_polygon(path, YARD)
    config = ControllerConfig(cycle=0.05, dead_time=0.1)
    controller = DockingController(path, corridor, config)
    prepare_process()  # no pause for garbage in the first cycles
    parameters = PlantParameters.of(config.vehicle, config.limits, dead_time=config.dead_time)
    plant = PlantState(x=path.start.x, y=path.start.y, phi=path.start.phi)
    print(f"{path.length:.1f} m of path, turning back after {path.cusps[0]:.1f} m")

    # No goal is given, so the vehicle docks at the last pose of the path.
    status = None
    while plant.time < 90.0 and status is not Status.DOCKED:
        state = plant.measured
        command = controller.step(state, now=plant.time)
        if command.status is not status:
            status = command.status
            print(f"{plant.time:6.2f} s  {status.value}")
        sent = issue(
            plant, parameters, acceleration=command.acceleration, steering_rate=command.steering_rate
        )
        plant = advance(sent, parameters, plant.time + config.cycle)

    error = Pose2(plant.x, plant.y, plant.phi).relative_to(path.end)
    print(f"{100 * hypot(error.x, error.y):.1f} cm and {error.phi:.3f} rad off the last pose")
    assert command.docked, command.status
    assert hypot(error.x, error.y) < 0.07
    assert abs(error.phi) < 0.035


if __name__ == "__main__":
    main()
