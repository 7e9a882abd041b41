"""One cycle of a controller as pages, pictures and logs show it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from geometry import Corridor, ReferencePath
from geometry.outline import corners_of, drawn_shape, shape_of
from rti_mpcc.types import Array, Command, VehicleState
from rti_mpcc.world.obstacles import TrackedObstacle


@dataclass(frozen=True, slots=True, kw_only=True)
class Moment:
    """One cycle of a ride at `time` [s].

    Attributes:
        pose: (3,) of the rear axle x [m], y [m], heading [rad], true in a simulated ride, else measured.
        state: as measured; command: with its plan.
        goal: (3,) the true one; None where it is not known, as in a recording.
        route, corridor: of the controller in this cycle; None where there was none yet.
        obstacles: outlines (k, 2) [m] beside those of the area.
        moving: of each one that moves, as the controller knows it: x, y [m] of its middle, velocity [m/s] and
            turn rate [rad/s].
    """

    time: float
    pose: Array
    state: VehicleState
    command: Command
    goal: Array | None
    route: ReferencePath | None
    corridor: Corridor | None
    obstacles: tuple[Array, ...]
    moving: tuple[tuple[float, float, float, float, float], ...] = ()

    @property
    def weights(self) -> tuple[float, ...]:
        """The effective weights in the order of `draw.WEIGHTS`."""
        weights = self.command.diagnostics.weights
        return weights.lag, weights.contouring, weights.progress_reward, weights.goal_position


def wrapped(controller: object) -> list[Any]:
    """The controller, the one that it is wrapped around, and so on."""
    found = [controller]
    while (inner := getattr(found[-1], "controller", None)) is not None:
        found.append(inner)
    return found


def moment_of(controller: object, state: VehicleState, command: Command, time: float) -> Moment:
    """The cycle at `time` [s] that a controller, a mission or a wrapper around one has just made."""
    core: Any = wrapped(controller)[-1]
    route = getattr(core, "path", None)
    corridor = None if route is None else core.corridor
    return Moment(
        time=time,
        pose=np.array([state.x, state.y, state.phi]),
        state=state,
        command=command,
        goal=None,
        route=route,
        corridor=corridor,
        obstacles=() if corridor is None else corridor.obstacles,
        moving=tuple(map(_motion, core.state.area.tracked.moving)) if hasattr(core, "state") else (),
    )


def _motion(obstacle: TrackedObstacle) -> tuple[float, float, float, float, float]:
    middle = obstacle.shape.centroid
    return middle.x, middle.y, *obstacle.velocity.tolist(), obstacle.turn_rate


def widened(outlines: Sequence[Array]) -> list[Array]:
    """Polygons (k, 2) [m], with lines and points widened so that they are seen."""
    return [each if len(each) > 2 else corners_of(drawn_shape(shape_of(each))) for each in outlines]
