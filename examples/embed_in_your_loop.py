"""Embed the controller in a loop of your own: your plant, its dead time, a gate, a dock that moves.

The vehicle follows setpoints for speed and steering after a dead time. Its wheelbase is 2 % longer than the
controller assumes. A gate blocks the path for 20 s. `rti-mpcc show embedded.jsonl` shows the recorded ride.
"""

from __future__ import annotations

from math import cos, hypot, sin, tan

from geometry import Corridor, Pose2, ReferencePath
from rti_mpcc import Command, ControllerConfig, DockingController, Status, VehicleState, prepare_process
from rti_mpcc.recording import Recorder

CYCLE, DEAD_TIME, OPENS = 0.05, 0.2, 20.0  # [s]
GATE = [(18.0, -4.0), (18.5, -4.0), (18.5, 4.0), (18.0, 4.0)]


class Truck:
    """Does what it was told DEAD_TIME ago: over one cycle its speed and steering go to the set points."""

    def __init__(self) -> None:
        self.x = self.y = self.phi = self.v = self.delta = 0.0
        self.on_the_way = [(0.0, 0.0)] * round(DEAD_TIME / CYCLE)

    def drive(self, command: Command, steps: int = 10) -> None:
        """Take a command in and move on by one cycle."""
        self.on_the_way.append((command.speed, command.steering))
        speed, steering = self.on_the_way.pop(0)
        dv, ddelta, h = (speed - self.v) / steps, (steering - self.delta) / steps, CYCLE / steps
        for _ in range(steps):
            self.x, self.y = self.x + h * self.v * cos(self.phi), self.y + h * self.v * sin(self.phi)
            self.phi += h * self.v * tan(self.delta) / (1.02 * 2.875)
            self.v, self.delta = self.v + dv, self.delta + ddelta


def main() -> None:
    path = ReferencePath.from_waypoints([(0.0, 0.0), (10.0, 0.5), (20.0, 0.0), (30.0, 2.0)])
    corridor = Corridor.from_offsets(path, left=4.0, right=-4.0)
    controller = DockingController(path, corridor, ControllerConfig(cycle=CYCLE, dead_time=DEAD_TIME))
    prepare_process()  # no pause for garbage in the first cycles
    truck, now, status = Truck(), 0.0, None
    with Recorder(controller, "embedded.jsonl") as recorder:
        while now < 90.0 and status is not Status.DOCKED:
            dock = Pose2(32.0, 2.6, 0.2) if truck.x < 20.0 else Pose2(32.2, 2.4, 0.25)
            state = VehicleState(x=truck.x, y=truck.y, phi=truck.phi, v=truck.v, delta=truck.delta)
            command = recorder.step(state, now=now, goal=dock, obstacles=[GATE] if now < OPENS else [])
            if command.status is not status:
                status = command.status
                print(f"{now:6.2f} s  x = {truck.x:5.2f} m  {status.value}  {command.diagnostics.reason}")
            assert now >= OPENS or truck.x + 3.6775 < 18.0, "through the gate"
            truck.drive(command)
            now += CYCLE
    error = Pose2(truck.x, truck.y, truck.phi).relative_to(dock)
    print(f"docked: {100 * hypot(error.x, error.y):.1f} cm and {error.phi:.3f} rad off")
    assert command.docked, command.status
    assert error.within((0.05, 0.05, 0.035)), error


if __name__ == "__main__":
    main()
