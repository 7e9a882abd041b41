"""A controller by the script, and a short scenario to drive with it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from estimation import GoalMeasurement
from geometry import Pose2, ReferencePath
from rti_mpcc.simulation import Scenario, scenario_from_dict
from rti_mpcc.simulation.result import Cycles
from rti_mpcc.types import (
    Array,
    Command,
    Diagnostics,
    EffectiveWeights,
    Objective,
    Obstacle,
    Source,
    Status,
    Trajectory,
    VehicleState,
)


def with_columns(cycles: Cycles, **columns: Any) -> Cycles:
    """The table of cycles with other columns."""
    other = cycles.copy()
    for name, values in columns.items():
        other[name] = values
    return other


Script = Callable[[float, VehicleState], tuple[float, float]]


def still(now: float, state: VehicleState) -> tuple[float, float]:
    return 0.0, 0.0


def forward(now: float, state: VehicleState) -> tuple[float, float]:
    return 1.0, 0.0


@dataclass(kw_only=True)
class Scripted:
    """Commands by a function of time and measured state; keeps all that it was told."""

    script: Script
    status: Callable[[float], Status] = lambda now: Status.FOLLOWING
    source: Callable[[float], Source] = lambda now: Source.SOLUTION
    part: Callable[[float], int] = lambda now: 0
    iterations: Callable[[float], int] = lambda now: 10
    docked: Callable[[float], bool] = lambda now: True
    given: list[tuple[float, VehicleState, Pose2 | None, Any]] = field(default_factory=list)
    detections: list[tuple[GoalMeasurement, ...]] = field(default_factory=list)

    def step(
        self,
        state: VehicleState,
        *,
        now: float,
        goal: Pose2 | None = None,
        measurements: Sequence[GoalMeasurement] = (),
        obstacles: Sequence[Array | Obstacle] | None = None,
    ) -> Command:
        self.given.append((now, state, goal, obstacles))
        self.detections.append(tuple(measurements))
        acceleration, steering_rate = self.script(now, state)
        return Command(
            acceleration=acceleration,
            steering_rate=steering_rate,
            speed=state.v,
            steering=state.delta,
            status=self.status(now),
            source=self.source(now),
            docked=self.docked(now),
            trajectory=Trajectory(times=np.zeros(2), states=np.zeros((2, 6)), controls=np.zeros((1, 3))),
            diagnostics=self._diagnostics(now),
        )

    def _diagnostics(self, now: float) -> Diagnostics:
        solver: dict[str, Any] = {"residuals": (0.0, 0.0), "slack": 0.0, "detections": ()}
        times: dict[str, Any] = {"prepare_ms": 1.0, "feedback_ms": 0.5, "solve_ms": 0.25, "step_ms": 1.5}
        return Diagnostics(
            theta=0.0,
            part=self.part(now),
            objective=Objective.CONTOURING,
            weights=EffectiveWeights(lag=1.0, contouring=2.0, progress_reward=3.0, goal_position=4.0),
            time_to_go=None,
            failed=self.status(now) is Status.FAILED,
            solver_status="solved" if self.iterations(now) else "",
            iterations=self.iterations(now),
            reason="",
            target=Pose2(0.0, 0.0, 0.0),
            goal=None,
            deadline_missed=False,
            **solver,
            **times,
        )


@dataclass(kw_only=True)
class ScriptedPlanner(Scripted):
    """The same, in an area: it is on a path by a function of time."""

    planned: Callable[[float], ReferencePath | None]
    path: ReferencePath | None = None
    replans: int = 0
    planning_seconds: float = 0.25

    def step(self, state: VehicleState, *, now: float, **given: Any) -> Command:
        path = self.planned(now)
        self.replans += self.path is not None and path is not self.path
        self.path = path
        return super().step(state, now=now, **given)


def straight_tables() -> dict[str, Any]:
    """10 m straight ahead along x, 3 m to both sides, goal at the end."""
    return {
        "name": "straight",
        "path": {"start": [0, 0, 0], "segments": [{"direction": 1, "curvature": 0, "length": 10}]},
        "corridor": {"left": 3, "right": -3},
    }


@pytest.fixture
def tables() -> dict[str, Any]:
    return straight_tables()


@pytest.fixture
def straight() -> Scenario:
    return scenario_from_dict(straight_tables())


def area_tables() -> dict[str, Any]:
    """A hall of 30 m by 12 m with a box in it, to be crossed along x."""
    return {
        "name": "hall",
        "start": {"pose": [0.0, 0.0, 0.0]},
        "area": {
            "boundary": [[-5.0, -6.0], [25.0, -6.0], [25.0, 6.0], [-5.0, 6.0]],
            "obstacles": [[[8.0, 2.0], [10.0, 2.0], [10.0, 4.0], [8.0, 4.0]]],
        },
        "goal": {"pose": [15.0, 0.0, 0.0]},
    }


def write_map(
    folder: Path, cells: NDArray[np.uint8], resolution: float, origin: tuple[float, float, float]
) -> Path:
    """yard.yaml, a map of these cells, rows from the top; `resolution`: of one [m]."""
    rows, columns = cells.shape
    (folder / "yard.pgm").write_bytes(f"P5\n{columns} {rows}\n255\n".encode() + cells.tobytes())
    entries = f"image: yard.pgm\nresolution: {resolution}\norigin: {list(origin)}\n"
    (folder / "yard.yaml").write_text(f"{entries}negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.2\n")
    return folder / "yard.yaml"


def write_yard(folder: Path) -> None:
    """A map of 40 m by 12 m, free but for its rim."""
    cells = np.full((12, 40), 254, dtype=np.uint8)
    cells[[0, -1]] = cells[:, [0, -1]] = 0
    write_map(folder, cells, 1.0, (-10, -6, 0))


def camera_tables(**camera: Any) -> dict[str, Any]:
    """4 m in reverse to a board that a camera sees."""
    return {
        "name": "seen",
        "path": {"start": [4.0, 0.3, 0.05], "segments": [{"direction": -1, "curvature": 0.0, "length": 4.0}]},
        "corridor": {"left": 3.0, "right": -3.0},
        "goal": {"measurement": {"initial_offset": [0.2, 0.1, 0.05], "rate": 5.0}, "camera": camera},
        "simulation": {"cycle": 0.05, "duration": 40.0},
    }


@pytest.fixture
def hall() -> Scenario:
    return scenario_from_dict(area_tables())
