"""A simulated run: the truth, what the controller did, and what it was run with."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import nan
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from estimation import GoalStatus, Judgement
from geometry import Area, Corridor, PathPart, Pose2, ReferencePath
from rti_mpcc.config import ControllerConfig
from rti_mpcc.errors import InputError
from rti_mpcc.planning.agenda import StepRecord
from rti_mpcc.simulation.goal_feed import GoalSource
from rti_mpcc.simulation.plant import SAME_TIME, PlantParameters
from rti_mpcc.simulation.scenario import Scenario
from rti_mpcc.types import Array, Command, MissionResult, Objective, Reason, Source, Status

STANDSTILL_SPEED = 0.02
"""Slower than this [m/s] is standing."""
DOCK_TIME = 0.5
"""So long [s] inside tolerance and standing is docked."""


def cusps_of(parts: Iterable[PathPart]) -> int:
    """How often the direction changes; the vehicle may also stop between parts to turn its wheels."""
    return sum(before.direction != after.direction for before, after in pairwise(parts))


@dataclass(frozen=True, slots=True, kw_only=True)
class Truth:
    """The truth at every plant step. All arrays are read-only.

    Attributes:
        times: (n,) [s].
        poses: (n, 3) x [m], y [m], phi [rad] of the rear axle; phi is continuous.
        v, delta: (n,) speed [m/s], steering angle as measured [rad].
        theta: (n,) progress along the route [m]; anew from 0 along each one that is planned, 0 before.
        part: (n,) index of the active one-direction part of it.
        acceleration, steering_rate: (n,) what the actuators did [m/s²], [rad/s], mean from this step to the
            next; the last entry repeats the one before.
        lateral_acceleration: (n,) v times the yaw rate [m/s²].
        goals: (n, 3) the true goal x [m], y [m], phi [rad].
    """

    times: Array
    poses: Array
    v: Array
    delta: Array
    theta: Array
    part: NDArray[np.int64]
    acceleration: Array
    steering_rate: Array
    lateral_acceleration: Array
    goals: Array

    @classmethod
    def of(cls, samples: Sequence[Sequence[float]], parameters: PlantParameters) -> Truth:
        """The truth from samples of t, x, y, phi, v, delta, theta, part, goal x, y, phi."""
        table = np.array(samples)
        times, v, delta = table[:, 0], table[:, 4], table[:, 5]
        yaw_rate = v * np.tan(delta + parameters.steering_offset) / parameters.wheelbase
        return cls(
            times=_kept(times),
            poses=_kept(table[:, 1:4]),
            v=_kept(v),
            delta=_kept(delta),
            theta=_kept(table[:, 6]),
            part=_kept(table[:, 7], np.int64),
            acceleration=_kept(_slopes(times, v)),
            steering_rate=_kept(_slopes(times, delta)),
            lateral_acceleration=_kept(v * yaw_rate),
            goals=_kept(table[:, 8:11]),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Cycles:
    """Time [s], command and diagnostics of the m cycles, (m,) each. All arrays are read-only.

    Attributes:
        speed, steering: planned values for interfaces that take those [m/s], [rad].
        weights: (m, 4) lag, contouring, progress reward, goal position, as they act on the first stage.
        solved: whether a QP was given to the solver; failed: its result was refused; iteration_limit: a QP
            used up its iterations.
        step_ms: wall time of all of step(), as the caller sees it.
    """

    times: Array
    acceleration: Array
    steering_rate: Array
    speed: Array
    steering: Array
    status: tuple[Status, ...]
    source: tuple[Source, ...]
    objective: tuple[Objective, ...]
    cause: tuple[Reason, ...]
    reason: tuple[str, ...]
    weights: Array
    iterations: NDArray[np.int64]
    solved: NDArray[np.bool_]
    failed: NDArray[np.bool_]
    iteration_limit: NDArray[np.bool_]
    feedback_ms: Array
    solve_ms: Array
    step_ms: Array
    deadline_missed: NDArray[np.bool_]

    @classmethod
    def of(cls, times: Sequence[float], commands: Sequence[Command], step_ms: Sequence[float]) -> Cycles:
        """The record of the cycles; `step_ms` is the wall time of each step()."""
        notes = [command.diagnostics for command in commands]
        weights = [note.weights for note in notes]
        arrays: dict[str, Any] = {
            **_columns(commands, np.float64, "acceleration", "steering_rate", "speed", "steering"),
            **_columns(notes, np.float64, "feedback_ms", "solve_ms"),
            **_columns(notes, np.int64, "iterations"),
            **_columns(notes, np.bool_, "failed", "iteration_limit", "deadline_missed"),
            "weights": _rows([[w.lag, w.contouring, w.progress_reward, w.goal_position] for w in weights], 4),
            "solved": _kept([note.solver_status != "" for note in notes], np.bool_),
        }
        words: dict[str, Any] = {
            **{name: tuple(getattr(command, name) for command in commands) for name in ("status", "source")},
            **{
                name: tuple(getattr(note, name) for note in notes)
                for name in ("objective", "cause", "reason")
            },
        }
        return cls(times=_kept(times), step_ms=_kept(step_ms), **arrays, **words)


@dataclass(frozen=True, slots=True, kw_only=True)
class Tracking:
    """The goal as the controller knew it in each of its m cycles. Arrays are read-only.

    Attributes:
        aims: (m, 3) the pose that the active part was to end in x [m], y [m], phi [rad].
        estimates: (m, 3) the goal by the filter; NaN without one.
        covariances: (m, 3, 3) of the estimates; NaN without one.
        status: m of the filter; None without a filter.
        detections: all that were given, in order of arrival; arrivals: (k,) the cycle's time of each [s].
    """

    aims: Array
    estimates: Array
    covariances: Array
    status: tuple[GoalStatus | None, ...]
    detections: tuple[Judgement, ...]
    arrivals: Array

    @classmethod
    def of(cls, times: Sequence[float], commands: Sequence[Command]) -> Tracking:
        """The goal in the cycles at `times` [s]."""
        notes = [command.diagnostics for command in commands]
        goals = [note.goal for note in notes]
        covariances, unknown = [goal.covariance if goal else None for goal in goals], np.full((3, 3), nan)
        given = [
            (time, judged) for time, note in zip(times, notes, strict=True) for judged in note.detections
        ]
        return cls(
            aims=_rows([_triple(note.aim) for note in notes], 3),
            estimates=_rows([_triple(goal.pose if goal else None) for goal in goals], 3),
            covariances=_kept(np.reshape([unknown if c is None else c for c in covariances], (-1, 3, 3))),
            status=tuple(goal.status if goal else None for goal in goals),
            detections=tuple(judged for _, judged in given),
            arrivals=_kept([time for time, _ in given]),
        )


def _slopes(times: Array, values: Array) -> Array:
    """(n,) mean slope from each sample to the next; the last one repeated."""
    if len(times) < 2:
        return np.zeros(len(times))
    slopes = np.diff(values) / np.diff(times)
    return np.append(slopes, slopes[-1])


def _columns(rows: Sequence[object], kind: type[np.generic], *names: str) -> dict[str, NDArray[Any]]:
    return {name: _kept([getattr(row, name) for row in rows], kind) for name in names}


def _triple(pose: Pose2 | None) -> list[float]:
    return [nan, nan, nan] if pose is None else [pose.x, pose.y, pose.phi]


def _rows(values: Sequence[list[float]], width: int) -> Array:
    """(n, width), also where every cycle was lost and n is 0."""
    return _kept(np.reshape(values, (-1, width)))


def _kept(values: ArrayLike, kind: type[np.generic] = np.float64) -> NDArray[Any]:
    array = np.array(values, dtype=kind)
    array.flags.writeable = False
    return array


@dataclass(frozen=True, slots=True, kw_only=True)
class Planning:
    """How ways were planned in a run in an area.

    Attributes:
        seconds: that all searches took [s].
        replans: how often another way was planned than the first one.
    """

    seconds: float = 0.0
    replans: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class RunResult:
    """A whole run.

    Attributes:
        scenario, preset, method, seed: what was asked for.
        goal_source: how the controller knew the goal.
        config: the controller's settings.
        paths: (from time [s], route) in order of time: the one that was given, then those that were planned.
        corridors: (from time [s], corridor) in order of time; more than one where obstacles came and went;
            none in an area.
        area: where the vehicle was; None along a path.
        besides: (from time [s], obstacles (k, 2) [m] that were there besides those of the area) likewise.
        planning: of the ways in an area; None along a path, but where the vehicle left it for planned ones.
        truth, cycles: what happened; tracking: of the goal, None in a run without a detector.
        mission: all steps of the mission that were begun; mission_result: what all of it came to. None of
            either without one.
        ended: why the run ended: "docked", "mission over", "stopped" or "duration".
    """

    scenario: Scenario
    preset: str
    method: str
    seed: int
    goal_source: GoalSource
    config: ControllerConfig
    paths: tuple[tuple[float, ReferencePath], ...]
    corridors: tuple[tuple[float, Corridor], ...]
    area: Area | None
    besides: tuple[tuple[float, tuple[Array, ...]], ...]
    planning: Planning | None
    truth: Truth
    cycles: Cycles
    tracking: Tracking | None
    ended: str
    mission: tuple[StepRecord, ...] = ()
    mission_result: MissionResult | None = None

    @property
    def path(self) -> ReferencePath:
        """The route, of several the last one. Raises InputError where none was found."""
        if not self.paths:
            raise InputError(f"{self.scenario.name}: no way was found")
        return self.paths[-1][1]

    @property
    def given_path(self) -> ReferencePath | None:
        """The path of the scenario; None in an area."""
        return self.paths[0][1] if self.area is None else None

    def on_last_part(self, rows: NDArray[np.int64]) -> NDArray[np.bool_]:
        """(k,) whether the vehicle was on the last part of its route at samples `rows` (k,) of the truth."""
        begins = np.array([begin for begin, _ in self.paths])
        lasts = np.array([-1, *(len(path.parts) - 1 for _, path in self.paths)])
        place = np.searchsorted(begins, self.truth.times[rows] + SAME_TIME, side="right")
        found: NDArray[np.bool_] = self.truth.part[rows] == lasts[place]
        return found

    @property
    def title(self) -> str:
        """What was run, in short: the scenario, its preset, and the method where it is another than usual."""
        methods = "" if self.method == "dynamic" else f"{self.method}, "
        return f"{self.scenario.name} ({methods}{self.preset})"
