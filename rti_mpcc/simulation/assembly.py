"""From what the loop noted down to the read-only arrays of a run."""

from __future__ import annotations

from collections.abc import Sequence
from math import nan
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from geometry import Pose2
from rti_mpcc.simulation.plant import PlantParameters
from rti_mpcc.simulation.result import Cycles, Tracking, Truth
from rti_mpcc.types import Array, Command


def assemble_truth(samples: Sequence[Sequence[float]], parameters: PlantParameters) -> Truth:
    """The truth from samples of t, x, y, phi, v, delta, theta, part, goal x, y, phi."""
    table = np.array(samples)
    times, v, delta = table[:, 0], table[:, 4], table[:, 5]
    yaw_rate = v * np.tan(delta + parameters.steering_offset) / parameters.wheelbase
    return Truth(
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


def _slopes(times: Array, values: Array) -> Array:
    """(n,) mean slope from each sample to the next; the last one repeated."""
    if len(times) < 2:
        return np.zeros(len(times))
    slopes = np.diff(values) / np.diff(times)
    return np.append(slopes, slopes[-1])


def assemble_cycles(times: Sequence[float], commands: Sequence[Command], step_ms: Sequence[float]) -> Cycles:
    """The record of the cycles; `step_ms` is the wall time of each step()."""
    notes = [command.diagnostics for command in commands]
    weights = [note.weights for note in notes]
    return Cycles(
        times=_kept(times),
        acceleration=_kept([command.acceleration for command in commands]),
        steering_rate=_kept([command.steering_rate for command in commands]),
        speed=_kept([command.speed for command in commands]),
        steering=_kept([command.steering for command in commands]),
        status=tuple(command.status for command in commands),
        source=tuple(command.source for command in commands),
        objective=tuple(note.objective for note in notes),
        cause=tuple(note.cause for note in notes),
        reason=tuple(note.reason for note in notes),
        weights=_rows([[w.lag, w.contouring, w.progress_reward, w.goal_position] for w in weights], 4),
        iterations=_kept([note.iterations for note in notes], np.int64),
        solved=_kept([note.solver_status != "" for note in notes], np.bool_),
        failed=_kept([note.failed for note in notes], np.bool_),
        iteration_limit=_kept([note.iteration_limit for note in notes], np.bool_),
        feedback_ms=_kept([note.feedback_ms for note in notes]),
        solve_ms=_kept([note.solve_ms for note in notes]),
        step_ms=_kept(step_ms),
        deadline_missed=_kept([note.deadline_missed for note in notes], np.bool_),
    )


def assemble_tracking(times: Sequence[float], commands: Sequence[Command]) -> Tracking:
    """What the cycles at `times` [s] made of the goal."""
    notes = [command.diagnostics for command in commands]
    goals = [note.goal for note in notes]
    unknown = np.full((3, 3), nan)
    covariances = [goal.covariance if goal else None for goal in goals]
    given = [(time, judged) for time, note in zip(times, notes, strict=True) for judged in note.detections]
    return Tracking(
        aims=_rows([_triple(note.aim) for note in notes], 3),
        estimates=_rows([_triple(goal.pose if goal else None) for goal in goals], 3),
        covariances=_kept(np.reshape([unknown if one is None else one for one in covariances], (-1, 3, 3))),
        status=tuple(goal.status if goal else None for goal in goals),
        detections=tuple(judged for _, judged in given),
        arrivals=_kept([time for time, _ in given]),
    )


def _triple(pose: Pose2 | None) -> list[float]:
    return [nan, nan, nan] if pose is None else [pose.x, pose.y, pose.phi]


def _rows(values: Sequence[list[float]], width: int) -> Array:
    """(n, width), also where every cycle was lost and n is 0."""
    return _kept(np.reshape(values, (-1, width)))


def _kept(values: ArrayLike, kind: type[np.generic] = np.float64) -> NDArray[Any]:
    array = np.array(values, dtype=kind)
    array.flags.writeable = False
    return array
