"""Dock with the Python API: a path, a corridor, a goal and a few lines of plant."""

from __future__ import annotations

from dataclasses import replace
from math import cos, hypot, pi, sin, tan

from geometry import Corridor, Pose2, ReferencePath
from rti_mpcc import Command, ControllerConfig, DockingController, VehicleState, prepare_process

CYCLE = 0.05  # [s]
SUBSTEPS = 10
GOAL = Pose2(11.08, -15.24, 1.171)


def drive(state: VehicleState, command: Command, wheelbase: float) -> VehicleState:
    """The plant: a bicycle that does what it is told for one cycle, in small Euler steps."""
    h = CYCLE / SUBSTEPS
    for _ in range(SUBSTEPS):
        state = replace(
            state,
            x=state.x + h * state.v * cos(state.phi),
            y=state.y + h * state.v * sin(state.phi),
            phi=state.phi + h * state.v * tan(state.delta) / wheelbase,
            v=state.v + h * command.acceleration,
            delta=state.delta + h * command.steering_rate,
        )
    return state


def main() -> None:
    path = ReferencePath.from_segments(
        start=Pose2(0.0, 0.0, pi / 2),
        # direction (-1: reverse), curvature [1/m], length [m]
        segments=[(-1, -0.2, 10.0), (-1, 0.2, 10.0), (-1, 0.0, 5.0), (-1, 0.2, 5.0)],
    )
    corridor = Corridor.from_offsets(path, left=5.0, right=-5.0, narrowings=[])
    config = ControllerConfig(cycle=CYCLE)
    controller = DockingController(path, corridor, config)
    prepare_process()  # no pause for garbage in the first cycles
    state = VehicleState(x=0.0, y=0.0, phi=pi / 2, v=0.0, delta=0.0)

    for count in range(1200):
        now = count * CYCLE
        command = controller.step(state, now=now, goal=GOAL)
        if command.docked:
            break
        if count % 60 == 0:
            print(f"{now:5.1f} s  {command.status.value:10}  v = {state.v:5.2f} m/s")
        state = drive(state, command, config.vehicle.wheelbase)

    error = Pose2(state.x, state.y, state.phi).relative_to(GOAL)
    print(f"docked after {now:.2f} s, {100 * hypot(error.x, error.y):.1f} cm and {error.phi:.3f} rad off")
    assert command.docked, command.status
    assert hypot(error.x, error.y) < 0.07
    assert abs(error.phi) < 0.035


if __name__ == "__main__":
    main()
