"""What there is to be seen of one cycle, and an observer of a controller that keeps it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from estimation import GoalMeasurement
from geometry import Corridor, Pose2, ReferencePath
from rti_mpcc.config import ControllerConfig
from rti_mpcc.docking import DockingController
from rti_mpcc.iteration import Solution
from rti_mpcc.mission import DockingMission
from rti_mpcc.model.footprint import PIECES, body_of
from rti_mpcc.model.layout import PHI, POSE, X, Y
from rti_mpcc.ocp.horizon import read_only
from rti_mpcc.ocp.objectives import StageWeights
from rti_mpcc.ocp.room import OUTWARD
from rti_mpcc.ocp.stage_contacts import NEAR
from rti_mpcc.recording import Recorder
from rti_mpcc.simulation import Controller
from rti_mpcc.types import Array, Command, Source, VehicleState

TIGHT = 0.002
"""A half-plane is active where a disc has so little more than the margin left to it [m]. Of the 906 with a
multiplier in the QPs of docking_inside and docking_behind this finds 99 %, and 113 others besides."""
_FROM_QP = (Source.SOLUTION, Source.SHIFTED_PLAN)


@dataclass(frozen=True, slots=True, kw_only=True)
class Inside:
    """What the QP of a cycle was solved with.

    Attributes:
        times: (N+1,) of its stages [s].
        slack: (N,) corridor slack of stages 1..N [m].
        weights: of its stages.
    """

    times: Array
    slack: Array
    weights: StageWeights


@dataclass(frozen=True, slots=True, kw_only=True)
class ObservedCycle:
    """One cycle as it was seen.

    Attributes:
        state: measured.
        command: what came of it.
        inside: of the cycle's last QP that was solved; None where none was, or it is not known.
        path, corridor: that the controller was on; None where it had none yet, or it is not known.
    """

    state: VehicleState
    command: Command
    inside: Inside | None
    path: ReferencePath | None = None
    corridor: Corridor | None = None

    @property
    def planned(self) -> ReferencePath | None:
        """The way, where it was planned; None on a path that was given."""
        return None if self.corridor is None or self.corridor.area is None else self.path


@dataclass(frozen=True, slots=True, kw_only=True)
class ActivePlanes:
    """Half-planes that hold a plan: normal · (p - point) >= 0 is allowed near them.

    Attributes:
        points: (k, 2) on the boundaries [m].
        normals: (k, 2) unit normals into the allowed side.
    """

    points: Array
    normals: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class CycleView:
    """What is shown of one cycle.

    Attributes:
        time: of the cycle [s].
        pose: (3,) of the rear axle, x [m], y [m], phi [rad]: true in a simulated run, else measured.
        goal: (3,) the true goal; None where it is not known, as in a recording.
        aim: (3,) what the active part was made to end in.
        obstacles: polygons (m, 2) [m] there at that time.
        planes: active half-planes of the plan.
        lack: (N,) what stages 1..N of the plan lack of the corridor's margin [m].
        observed: the cycle's plan, status, figures, weights.
    """

    time: float
    pose: Array
    goal: Array | None
    aim: Array
    obstacles: tuple[Array, ...]
    planes: ActivePlanes
    lack: Array
    observed: ObservedCycle


class Observer:
    """Steps a controller and keeps what was seen of each cycle, for pictures.

    Args:
        controller: a `DockingController`, a mission or `Recorder` around one, or any other, of which nothing
            is seen but its commands.

    Attributes:
        controller: as given; observed: what was seen of each cycle.
    """

    def __init__(self, controller: Controller) -> None:
        self.observed: list[ObservedCycle] = []
        self.controller = controller
        core: object = controller
        while isinstance(core, Recorder | DockingMission):
            core = core.controller
        self._core = core if isinstance(core, DockingController) else None

    def step(
        self,
        state: VehicleState,
        *,
        now: float,
        goal: Pose2 | None = None,
        measurements: Sequence[GoalMeasurement] = (),
        obstacles: Sequence[ArrayLike] | None = None,
        **clock: Any,
    ) -> Command:
        """One cycle, looked at. Arguments, result and errors are those of the controller's `step`."""
        before = self._solution()
        told: dict[str, Any] = {"goal": goal, "measurements": measurements, "obstacles": obstacles}
        command = self.controller.step(state, now=now, **told, **clock)
        after = self._solution()
        seen = observed_cycle(state, command, after if after is not before else None)
        path = None if self._core is None else self._core.path
        if self._core is not None and path is not None:
            seen = replace(seen, path=path, corridor=self._core.corridor)
        self.observed.append(seen)
        return command

    def _solution(self) -> Solution | None:
        return None if self._core is None else self._core.state.plans.solution


def observed_cycle(state: VehicleState, command: Command, solution: Solution | None) -> ObservedCycle:
    """What was seen of a cycle; `solution` is that of its own QP, or None."""
    if solution is None:
        return ObservedCycle(state=state, command=command, inside=None)
    inside = Inside(times=solution.trajectory.times, slack=solution.slack, weights=solution.weights)
    return ObservedCycle(state=state, command=command, inside=inside)


def view_of(
    observed: ObservedCycle,
    *,
    time: float,
    pose: Array,
    goal: Array | None,
    corridor: Corridor | None,
    config: ControllerConfig,
    obstacles: tuple[Array, ...] | None = None,
) -> CycleView:
    """The view of a cycle at `time` [s]; `pose` and `goal` as in `CycleView`.

    Args:
        corridor: as it was then; None where the controller had no path yet.
        obstacles: there then; None: those of the corridor.
    """
    planes, lack = held_by(observed.command, corridor, config)
    if obstacles is None:
        obstacles = () if corridor is None else corridor.obstacles
    told = observed.command.diagnostics.aim
    aim = np.array([told.x, told.y, told.phi])
    read_only(aim)
    return CycleView(
        time=time,
        pose=pose,
        goal=goal,
        aim=aim,
        obstacles=obstacles,
        planes=planes,
        lack=lack,
        observed=observed,
    )


def held_by(
    command: Command, corridor: Corridor | None, config: ControllerConfig
) -> tuple[ActivePlanes, Array]:
    """Active half-planes of a plan, and what its stages 1..N lack of the margin (N,) [m].

    Each piece of the body has one for each side at each stage, as in the QP. It is active if the piece is
    nearer to it than margin + `TIGHT` where the plan has it; what the plan lacks of the margin is its exact
    slack. A motion that is no solution of a QP (braking, standing) has none active.
    """
    states = command.trajectory.states[1:]
    of_qp = command.source in _FROM_QP and bool(np.isfinite(states).all())
    if corridor is None or not of_qp:
        return _planes(np.zeros((0, 2)), np.zeros((0, 2))), np.zeros(len(states))
    margin, body = config.clearance.wanted, body_of(config.vehicle, PIECES)
    within = margin + NEAR
    part = command.diagnostics.part
    found = corridor.contacts(part, body, states[:, :POSE], within=within, outward=OUTWARD)
    active = found.apart < margin + TIGHT
    lack = np.maximum(margin - found.apart, 0.0).reshape(len(states), -1).max(axis=1)
    read_only(lack)
    turn = np.exp(1j * states[:, PHI])[:, None, None]
    place = (states[:, X] + 1j * states[:, Y])[:, None, None]
    normal = (found.normal * turn)[active]
    point = (place + found.at * turn)[active] - found.apart[active] * normal
    return _planes(point.view(np.float64).reshape(-1, 2), normal.view(np.float64).reshape(-1, 2)), lack


def _planes(points: Array, normals: Array) -> ActivePlanes:
    read_only(points, normals)
    return ActivePlanes(points=points, normals=normals)
