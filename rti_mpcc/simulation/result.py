"""A simulated run: the truth, what the controller did, and what it was run with."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from geometry import Area, Corridor, ReferencePath
from geometry.arrays import locked
from rti_mpcc.config import ControllerConfig
from rti_mpcc.errors import InputError
from rti_mpcc.mission.state import StepRecord
from rti_mpcc.simulation.goal_feed import GoalSource
from rti_mpcc.simulation.plant import SAME_TIME, PlantParameters
from rti_mpcc.simulation.scenario import Scenario
from rti_mpcc.types import Array, Command, MissionResult

STANDSTILL_SPEED = 0.02  # slower than this [m/s] is standing
DOCK_TIME = 0.5  # so long [s] inside tolerance and standing is docked


@dataclass(frozen=True, slots=True, kw_only=True)
class Truth:
    """The truth at each of n plant steps. All arrays are read-only."""

    times: Array  # (n,) [s]
    poses: Array  # (n, 3) x [m], y [m], continuous phi [rad] of the rear axle
    v: Array  # (n,) speed [m/s]
    delta: Array  # (n,) steering angle as measured [rad]
    theta: Array  # (n,) progress along the route [m], restarts with each one
    part: NDArray[np.int64]  # (n,) index of the route's active part
    acceleration: Array  # (n,) of the drive [m/s²], mean from this step to the next
    steering_rate: Array  # (n,) of the steering [rad/s], likewise
    lateral_acceleration: Array  # (n,) v times the yaw rate [m/s²]
    goals: Array  # (n, 3) the true goal x [m], y [m], phi [rad]

    @classmethod
    def of(cls, samples: Sequence[Sequence[float]], parameters: PlantParameters) -> Truth:
        """The truth from samples of t, x, y, phi, v, delta, theta, part, goal x, y, phi."""
        table = np.array(samples)
        times, v, delta = table[:, 0], table[:, 4], table[:, 5]
        yaw_rate = v * np.tan(delta + parameters.steering_offset) / parameters.wheelbase
        columns: dict[str, NDArray[Any]] = {
            "times": times,
            "poses": table[:, 1:4],
            "v": v,
            "delta": delta,
            "theta": table[:, 6],
            "part": table[:, 7].astype(np.int64),
            "acceleration": _slopes(times, v),
            "steering_rate": _slopes(times, delta),
            "lateral_acceleration": v * yaw_rate,
            "goals": table[:, 8:11],
        }
        return cls(**{name: locked(np.array(column)) for name, column in columns.items()})

    def rows_at(self, times: ArrayLike) -> NDArray[np.int64]:
        """(k,) the sample at each of `times` (k,) [s], or the first one after it."""
        rows = np.searchsorted(self.times, np.asarray(times) - SAME_TIME)
        return np.minimum(rows, len(self.times) - 1).astype(np.int64)


Cycles = np.recarray[Any, Any]  # the table of the cycles, see `cycle_table`
_COMMAND = {
    "acceleration": float,
    "steering_rate": float,
    "speed": float,
    "steering": float,
    "status": object,
    "source": object,
}
_DIAGNOSTICS = {
    "objective": object,
    "cause": object,
    "reason": object,
    "iterations": int,
    "failed": bool,
    "interior_point": bool,
    "deadline_missed": bool,
    "feedback_ms": float,
    "goal": object,
    "detections": object,
}


def cycle_table(cycles: Sequence[tuple[float, float, Command]]) -> Cycles:
    """A read-only row for each cycle (time [s], wall time of all of step() [ms], command).

    Columns are attributes, such as `cycles.status`: `times`; `step_ms`; `solved`, whether a QP was given to
    the solver; some fields of `Command` and `Diagnostics` by their names.
    """
    rows = []
    for time, step_ms, command in cycles:
        told = command.diagnostics
        sent = (getattr(command, name) for name in _COMMAND)
        more = (getattr(told, name) for name in _DIAGNOSTICS)
        rows.append((time, step_ms, told.solver_status != "", *sent, *more))
    kinds = {"times": float, "step_ms": float, "solved": bool, **_COMMAND, **_DIAGNOSTICS}
    table = np.array(rows, dtype=list(kinds.items())).view(np.recarray)
    table.flags.writeable = False
    return table


def _slopes(times: Array, values: Array) -> Array:
    """(n,) mean slope from each sample to the next; the last one repeated."""
    if len(times) < 2:
        return np.zeros(len(times))
    slopes = np.diff(values) / np.diff(times)
    return np.append(slopes, slopes[-1])


@dataclass(frozen=True, slots=True, kw_only=True)
class RunResult:
    """A whole run."""

    scenario: Scenario
    preset: str
    method: str
    seed: int
    goal_source: GoalSource
    config: ControllerConfig
    detector: bool  # whether there was a detector of the goal
    # (From time [s], route) in order of time: the given path, then the planned routes.
    paths: tuple[tuple[float, ReferencePath], ...]
    # (From time [s], outlines (k, 2) [m] beside those of the area) in order of time.
    obstacles: tuple[tuple[float, tuple[Array, ...]], ...]
    corridor: Corridor | None  # along the given path
    area: Area | None  # in place of a path and its corridor
    planning_seconds: float | None  # of all searches for a route; None along a path that was not left
    replans: int  # number of times that the controller replanned
    truth: Truth
    cycles: Cycles
    ended: str  # "docked", "mission over", "stopped" or "duration"
    mission: tuple[StepRecord, ...] = ()  # all steps that were started
    mission_result: MissionResult | None = None  # None without a mission

    @property
    def path(self) -> ReferencePath:
        """The last route. Raises InputError where none was found."""
        if not self.paths:
            raise InputError(f"{self.scenario.name}: no route was found")
        return self.paths[-1][1]

    @property
    def given_path(self) -> ReferencePath | None:
        """The path of the scenario; None in an area."""
        return self.paths[0][1] if self.area is None else None

    @property
    def title(self) -> str:
        """The scenario and its preset, with the method where that is not the usual one."""
        methods = "" if self.method == "dynamic" else f"{self.method}, "
        return f"{self.scenario.name} ({methods}{self.preset})"


def all_succeeded(result: MissionResult | None, log: Sequence[StepRecord]) -> bool:
    """Whether a mission ended and the last try of each step succeeded; True where there was none.

    A mission that continues after a failed step (`then="continue"`) succeeds, but not with all of its steps.
    """
    last_tries = {record.place: record.result for record in log}
    succeeded = MissionResult.SUCCEEDED
    return result in (None, succeeded) and all(each is succeeded for each in last_tries.values())
