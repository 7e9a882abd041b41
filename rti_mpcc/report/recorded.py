"""Figures of a recorded ride, as its summary.json has them."""

from __future__ import annotations

from dataclasses import fields, replace
from itertools import pairwise
from typing import Any

import numpy as np

from rti_mpcc.report.ride import Ride, clearance
from rti_mpcc.simulation.metrics import computing, energy, errors_to, named, peaks, rms
from rti_mpcc.simulation.result import Truth, cycle_table
from rti_mpcc.simulation.ride import hard_braking, peak_jerk, turning_points


def recorded_summary(ride: Ride) -> dict[str, Any]:
    """Name to value; None: never reached, or not known. SI units, times of the controller in ms.

    The names are those of `simulation.summary`, but for `recording`, `cycles` and `statuses` (time in each
    [s]). There is no truth: poses, speed and steering are measured, acceleration and steering rate commanded,
    and `docked` is what the controller said. Cycles without a measurement, or at the time of another one,
    count for no motion.
    """
    times, commands = ride.times, [moment.command for moment in ride.moments]
    cycles = cycle_table([(m.time, m.command.diagnostics.step_ms, m.command) for m in ride.moments])
    motion, kept = _measured(ride.motion)
    to_dock = next((moment.time for moment in ride.moments if moment.command.docked), None)
    goal, comfort = commands[-1].goal, ride.config.comfort
    error = dict.fromkeys(named(np.zeros(3)))
    if goal is not None and len(motion.times):
        pose = np.array([[goal.pose.x, goal.pose.y, goal.pose.phi]])
        error |= named(errors_to(pose, motion.poses[-1:])[0])
    spent: dict[str, float] = {}
    for command, (start, end) in zip(commands, pairwise([*times, times[-1]]), strict=True):
        spent[command.status.value] = spent.get(command.status.value, 0.0) + float(end - start)
    moves, clearances = len(motion.times) > 0, clearance(ride).values
    near = clearances[np.isfinite(clearances)]
    return {
        "recording": ride.title,
        "cycles": len(commands),
        "docked": commands[-1].docked,
        "time_to_dock_s": None if to_dock is None else to_dock - float(times[0]),
        "final_error": error,
        "min_clearance_m": float(near.min()) if len(near) else None,
        "direction_changes": len(turning_points(motion.times, motion.v)) if moves else 0,
        "max_steering_rad": float(np.abs(motion.delta).max(initial=0.0)),
        "rms": rms(motion, to_dock) if moves else None,
        "energy": energy(motion, to_dock) if moves else None,
        "peak": {**peaks(motion, to_dock), "jerk": peak_jerk(cycles[kept], ride.config.cycle, to_dock)}
        if moves
        else dict.fromkeys(comfort._fields, 0.0),
        "comfort": comfort._asdict(),
        "hard_braking": hard_braking(motion, cycles[kept], ride.config.comfort_acceleration) if moves else {},
        "distance_m": float(np.trapezoid(np.abs(motion.v), motion.times)),
        **computing(cycles),
        "statuses": spent,
        "ended": commands[-1].status.value,
        "duration_s": float(times[-1] - times[0]),
    }


def _measured(motion: Truth) -> tuple[Truth, np.ndarray[Any, np.dtype[np.bool_]]]:
    """The samples that are finite and later than all before them, and which ones these are."""
    columns = [motion.times[:, None], motion.poses, motion.v[:, None], motion.delta[:, None]]
    kept = np.isfinite(np.concatenate(columns, axis=1)).all(axis=1)
    kept &= np.diff(motion.times, prepend=-np.inf) > 0.0
    return replace(motion, **{each.name: getattr(motion, each.name)[kept] for each in fields(motion)}), kept
