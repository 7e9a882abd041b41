"""A whole mission: drive to a capsule, detect it, dock, wait, connect by a straight move, leave."""

from __future__ import annotations

from math import hypot, pi

import numpy as np

import rti_mpcc as rm
from geometry import Pose2
from rti_mpcc.simulation.plant import PlantParameters, PlantState, advance, issue

CAPSULE = [(-5.0, -1.1), (-2.0, -1.1), (-2.0, 1.1), (-5.0, 1.1)]  # in the frame of the docked vehicle [m]
WALLS = [[(x, -8.0), (x + 4.0, -8.0), (x + 4.0, -3.0), (x, -3.0)] for x in (-9.0, 5.0)]
EXPECTED, TRUE = Pose2(0.4, 0.3, 0.5 * pi + 0.1), Pose2(0.0, 0.0, 0.5 * pi)


def detections(plant: PlantState, random: np.random.Generator) -> list[rm.GoalMeasurement]:
    """What a camera says of the capsule, in the vehicle's frame: put your own detector here."""
    seen = TRUE.relative_to(Pose2(plant.x, plant.y, plant.phi))
    distance = hypot(seen.x, seen.y)
    if distance > 9.0:
        return []
    covariance = rm.DetectionNoise().covariance(distance)
    x, y, phi = random.multivariate_normal((seen.x, seen.y, seen.phi), covariance).tolist()
    frame = rm.Frame.VEHICLE
    return [rm.GoalMeasurement(stamp=plant.time, x=x, y=y, phi=phi, covariance=covariance, frame=frame)]


def main() -> None:
    config, random = rm.ControllerConfig(dead_time=0.18), np.random.default_rng(0)
    plant = PlantState(x=-12.0, y=6.0, phi=0.0)
    vehicle = PlantParameters.of(config.vehicle, config.limits, dead_time=0.18)

    def touches() -> bool:  # your own contact switch
        return Pose2(plant.x, plant.y, plant.phi).relative_to(TRUE).x <= -1.2

    approach, tolerance = rm.Approach(2.0, -1), (0.05, 0.015, 0.01)
    dock = rm.Dock(
        EXPECTED, kind=rm.DockKind.DETECTED, body=CAPSULE, approach=approach, tolerance=tolerance, retries=1
    )
    contact = rm.Straight(-1.22, tolerance=(0.02, 0.01), until=touches, retries=1, retry_from=0)
    controller = rm.DockingController.in_area(rm.Area(obstacles=WALLS), config)
    mission = rm.DockingMission(controller, [dock, rm.Wait(10.0), contact, rm.Undock(6.0)])
    rm.prepare_process()  # no pause for garbage in the first cycles
    while not mission.over:  # no step is left, and the vehicle stands
        command = mission.step(plant.measured, now=plant.time, measurements=detections(plant, random))
        a, rate = command.acceleration, command.steering_rate
        plant = issue(plant, vehicle, acceleration=a, steering_rate=rate)
        plant = advance(plant, vehicle, plant.time + config.cycle)
    for step in mission.log:
        print(f"{step.kind:8} {step.begin:6.2f} to {step.end:6.2f} s: {step.result.value}")
    assert mission.result is rm.MissionResult.SUCCEEDED
    print("docked, connected, and out again")


if __name__ == "__main__":
    main()
