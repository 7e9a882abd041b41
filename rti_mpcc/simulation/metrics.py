"""The figures of a run, as summary.json has them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from math import inf, isfinite
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from estimation import GoalEstimate, GoalStatus, Judgement, Outcome
from geometry import Corridor, Pose2, wrap
from geometry.outline import shape_of
from rti_mpcc.config import Comfort, Vehicle
from rti_mpcc.course.docking_time import expected_docking_time
from rti_mpcc.errors import ConfigError
from rti_mpcc.model.footprint import body_of, body_polygons, clearances
from rti_mpcc.simulation import ride
from rti_mpcc.simulation.goal_feed import GoalSource
from rti_mpcc.simulation.plant import SAME_TIME
from rti_mpcc.simulation.result import DOCK_TIME, STANDSTILL_SPEED, Cycles, RunResult, Truth
from rti_mpcc.types import Array, Source, Status
from rti_mpcc.world.surroundings import area_along

TIMED = ("cycle_ms", "feedback_ms", "deadline_misses")  # figures of `summary` that differ from run to run
_ERRORS = ("longitudinal_m", "lateral_m", "heading_rad")
_TOUCHES = 1e-9  # [m], the least depth of a body that shapely finds in contact
_ENDS_BY_BRAKING = (Status.SETTLING, Status.DOCKED, Status.CHANGING_DIRECTION, Status.WAITING)


def summary(result: RunResult) -> dict[str, Any]:
    """Name to value; what was never reached or measured is None. SI units, times of the controller in ms."""
    truth = result.truth
    errors = errors_to(truth.goals, truth.poses)
    inside = np.all(np.abs(errors) <= result.config.goal_tolerance, axis=1)
    standing = inside & (np.abs(truth.v) <= STANDSTILL_SPEED)
    to_tolerance = float(truth.times[np.argmax(inside)]) if inside.any() else None
    to_dock = time_to_dock(truth.times, standing)
    gain, comfort = result.scenario.simulation.acceleration_gain, result.config.comfort_acceleration
    bound = 0.0 if to_dock is None else ride.energy_bound(truth, to_dock)
    clearance = float(np.min(body_clearances(result)))
    # The vehicle is to stand at its goal at the end of the last docking, or of the run.
    ends = [record.end for record in result.mission if record.kind == "dock" and record.end is not None]
    end = int(truth.rows_at(ends[-1:])[0]) if ends else -1
    return {
        "scenario": result.scenario.name,
        "method": result.method,
        "preset": result.preset,
        "seed": result.seed,
        "docked": to_dock is not None and bool(standing[end]),
        "time_to_tolerance_s": to_tolerance,
        "time_to_dock_s": to_dock,
        "final_error": named(errors[end]),
        "min_clearance_m": clearance if isfinite(clearance) else None,
        "direction_changes": len(ride.turning_points(truth.times, truth.v)),
        "max_steering_rad": float(np.max(np.abs(truth.delta))),
        "rms": rms(truth, to_tolerance),
        "energy": energy(truth, to_tolerance),
        "energy_to_dock": energy(truth, to_dock),
        # Over the least possible; none if the vehicle did not dock or move.
        "energy_ratio": energy(truth, to_dock)["acceleration"] / bound if bound > 0.0 else None,
        "peak": {
            **peaks(truth, to_dock),
            "jerk": ride.peak_jerk(result.cycles, result.scenario.simulation.cycle, to_dock, gain),
        },
        "comfort": result.config.comfort._asdict(),
        "hard_braking": ride.hard_braking(truth, result.cycles, comfort, gain),
        "expected_time_s": _expected_time(result),
        "distance_m": float(np.trapezoid(np.abs(truth.v), truth.times)),
        **computing(result.cycles),
        **_planning(result),
        **_mission(result),
        "goal": goal_summary(result),
        "ended": result.ended,
        "duration_s": float(truth.times[-1]),
    }


def untimed(figures: Mapping[str, Any]) -> dict[str, Any]:
    """The figures of `summary` that are the same each time."""
    same = {name: value for name, value in figures.items() if name not in TIMED}
    if "planning" in same:
        same["planning"] = {name: value for name, value in same["planning"].items() if name != "seconds"}
    return same


def errors_to(goals: Array, poses: Array) -> Array:
    """(n, 3) longitudinal [m], lateral [m], heading [rad]: poses (n, 3) in the frames of goals (n, 3)."""
    difference = poses - goals
    c, s = np.cos(goals[:, 2]), np.sin(goals[:, 2])
    longitudinal = c * difference[:, 0] + s * difference[:, 1]
    lateral = -s * difference[:, 0] + c * difference[:, 1]
    return np.stack([longitudinal, lateral, wrap(difference[:, 2])], axis=-1)


def goal_estimates(goals: Sequence[GoalEstimate | None]) -> Array:
    """(m, 3) estimates of the goal x [m], y [m], heading [rad]; NaN where there is none."""
    poses = [goal.pose if goal else None for goal in goals]
    rows = [(pose.x, pose.y, pose.phi) if pose else (np.nan,) * 3 for pose in poses]
    return np.reshape(np.array(rows, dtype=np.float64), (-1, 3))


def detections_of(cycles: Cycles) -> list[Judgement]:
    """All detections that the controller was given, in order of arrival."""
    return [judged for given in cycles.detections for judged in given]


def goal_summary(result: RunResult) -> dict[str, Any] | None:
    """How well the goal was known; None in a run without a detector, figures of an unused filter are None.

    A detection that started an estimate is accepted. The mean NIS of the accepted ones is 3 where the filter
    knows its noise.
    """
    cycles, judgements = result.cycles, detections_of(result.cycles)
    if not result.detector:
        return None
    outcomes = [judged.outcome for judged in judgements]
    counts = {
        "detections": len(outcomes),
        "accepted": sum(judged.accepted for judged in judgements),
        "rejected": outcomes.count(Outcome.REJECTED),
        "refused": outcomes.count(Outcome.REFUSED),
    }
    estimates = goal_estimates(cycles.goal)
    known = np.flatnonzero(np.isfinite(estimates).all(axis=1))[-1:]
    error = errors_to(result.truth.goals[result.truth.rows_at(cycles.times[known])], estimates[known])
    nis = [each.nis for each in judgements if each.outcome is Outcome.ACCEPTED and each.nis is not None]
    seen = [goal is not None and goal.status is not GoalStatus.SEARCHING for goal in cycles.goal]
    last = cycles.goal[-1] if len(seen) else None
    return {
        "source": result.goal_source.value,
        **(counts if result.goal_source is GoalSource.DETECTED else dict.fromkeys(counts)),
        "first_seen_s": float(cycles.times[seen.index(True)]) if any(seen) else None,
        "estimate_error": named(error[0]) if len(known) else dict.fromkeys(_ERRORS),
        "mean_nis": float(np.mean(nis)) if nis else None,
        "final_status": None if last is None else last.status.value,
    }


def time_to_dock(times: Array, standing: NDArray[np.bool_]) -> float | None:
    """Start of the first DOCK_TIME in which the vehicle stands inside tolerance throughout [s]."""
    for first, last in ride.spells(standing):
        if times[last] - times[first] >= DOCK_TIME - SAME_TIME:
            return float(times[first])
    return None


def named(error: Array) -> dict[str, float]:
    """Errors (3,) by the names that they have in summary.json."""
    return dict(zip(_ERRORS, error.tolist(), strict=True))


def _mission(result: RunResult) -> dict[str, Any]:
    """Each step with its true error at its end: at a dock against its true pose."""
    if result.mission_result is None:
        return {}
    truth, steps = result.truth, []
    for record in result.mission:
        goal, error = record.goal, None
        if goal is not None and record.end is not None:
            row = truth.rows_at([record.end])
            if record.dock is not None:
                goal = Pose2(*truth.goals[row[0]].tolist()).compose(goal.relative_to(record.dock))
            error = named(errors_to(np.array([[goal.x, goal.y, goal.phi]]), truth.poses[row])[0])
        steps.append(
            {
                "step": record.place,
                "kind": record.kind,
                "attempt": record.attempt,
                "begin_s": record.begin,
                "end_s": record.end,
                "result": record.result.value,
                "reason": record.reason,
                "final_error": error,
            }
        )
    return {"mission": steps, "mission_result": result.mission_result.value}


def body_clearances(result: RunResult) -> Array:
    """(n,) signed clearance [m] of the body to the active part's boundaries and the obstacles of the time.

    In an area, and once the vehicle has left the given path for a planned route: to all boundaries. How deep
    the body is in something is measured as the controller does it; whether it touches anything, and how far
    it is from all else, by shapely, too: the smaller of the two counts. Wholly beyond a boundary: `_along`.
    """
    truth, vehicle, corridor, area = result.truth, result.config.vehicle, result.corridor, result.area
    distances = np.empty(len(truth.times))
    leaves = -inf if corridor is None else result.paths[1][0] if len(result.paths) > 1 else inf
    planned = truth.times >= leaves
    if corridor is not None and planned.any():
        first = corridor.with_obstacles(result.obstacles[0][1])
        area = area_along(result.paths[0][1], first, result.config)
    starts = [start for start, _ in result.obstacles]
    scenes = np.searchsorted(starts, truth.times + SAME_TIME, side="right") - 1
    parts = np.where(planned, -1, truth.part)
    for scene, part in np.unique(np.stack([scenes, parts]), axis=1).T.tolist():
        rows, outlines = (scenes == scene) & (parts == part), result.obstacles[scene][1]
        poses = truth.poses[rows]
        if part < 0:
            assert area is not None
            solid = area.with_obstacles(outlines)
            lines = [] if solid.boundary is None else [np.vstack((solid.boundary, solid.boundary[:1]))]
            apart = solid.signed_distances(body_of(vehicle), poses)
            distances[rows] = _judged(apart, poses, vehicle, lines, solid.obstacles)
        else:
            assert corridor is not None
            distances[rows] = _along(corridor.with_obstacles(outlines), part, poses, vehicle)
    return distances


def _along(corridor: Corridor, part: int, poses: Array, vehicle: Vehicle) -> Array:
    """Signed distances (n,) [m] of the body at `poses` (n, 3) to the boundaries of a part and the obstacles.

    A body that is wholly beyond a boundary is as deep in it as its farthest corner.
    """
    apart: Array = clearances(poses, corridor, part, vehicle).min(axis=1)
    corners = body_polygons(poses, vehicle)
    beyond = corridor.walls[part].grid.beyond(corners.reshape(-1, 2)).reshape(corners.shape[:2])
    outside = beyond.min(axis=1) > 0.0
    apart[outside] = np.minimum(apart, -beyond.max(axis=1))[outside]
    lines = [line for side in corridor.lines(part) for line in side]
    return _judged(apart, poses, vehicle, lines, corridor.obstacles)


def _judged(
    apart: Array, poses: Array, vehicle: Vehicle, lines: Iterable[Array], outlines: Iterable[Array]
) -> Array:
    """Signed distances (n,) [m] of the body at `poses` (n, 3), none larger than shapely says.

    `lines`: boundaries (k, 2); `outlines`: of obstacles (k, 2), lines of two points and single points.
    """
    things = [shapely.linestrings(line) for line in lines if len(line) > 1]
    tree = shapely.STRtree([*things, *map(shape_of, outlines)])
    if not len(tree):
        return apart
    bodies = shapely.polygons(body_polygons(poses, vehicle))
    _, seen = tree.query_nearest(bodies, all_matches=False, return_distance=True)
    return np.minimum(apart, np.where(seen > 0.0, seen, -_TOUCHES))


def rms(truth: Truth, until: float | None) -> dict[str, float]:
    """Root of the time mean of the square up to `until` [s] (None: the whole run); 0 over no time."""
    values = {"steering": _square_integral(truth.times, truth.delta, until), **energy(truth, until)}
    time = truth.times[-1] - truth.times[0] if until is None else until - truth.times[0]
    return {name: float(np.sqrt(value / time)) if time > 0.0 else 0.0 for name, value in values.items()}


def energy(truth: Truth, until: float | None) -> dict[str, float]:
    """Integral of the square up to `until` [s] (None: the whole run).

    Acceleration and steering rate are means over each step and so counted as constant in it; the lateral
    acceleration is sampled and integrated by trapezoids.
    """
    steps = np.diff(truth.times) * (True if until is None else truth.times[1:] <= until + SAME_TIME)
    return {
        "steering_rate": float(steps @ truth.steering_rate[:-1] ** 2),
        "acceleration": float(steps @ truth.acceleration[:-1] ** 2),
        "lateral_acceleration": _square_integral(truth.times, truth.lateral_acceleration, until),
    }


def _square_integral(times: Array, values: Array, until: float | None) -> float:
    count = ride.samples_until(times, until)
    return float(np.trapezoid(values[:count] ** 2, times[:count]))


def peaks(truth: Truth, until: float | None) -> dict[str, float]:
    """Largest absolute values up to `until` [s] (None: the whole run) of what has a comfort value."""
    count = max(ride.samples_until(truth.times, until), 1)
    names = (name for name in Comfort._fields if name != "jerk")
    return {name: float(np.abs(getattr(truth, name)[:count]).max()) for name in names}


def _expected_time(result: RunResult) -> float | None:
    """The docking time that the controller expects before the run; None where none is known before."""
    path = result.given_path
    try:
        goal, along = result.scenario.planned_goal(), result.corridor
        seconds = inf if path is None else expected_docking_time(path, result.config, goal, corridor=along)
    except ConfigError:
        return None
    return seconds if isfinite(seconds) else None


def _planning(result: RunResult) -> dict[str, Any]:
    """How routes were planned: length and cusps are those of the first one."""
    if result.planning_seconds is None:
        return {}
    planned = result.paths if result.area is not None else result.paths[1:]
    length = cusps = None
    if planned:
        parts = planned[0][1].parts
        length = planned[0][1].length - parts[0].start
        # Between parts the vehicle may also stop to turn its wheels.
        cusps = sum(one.direction != other.direction for one, other in pairwise(parts))
    found = {"seconds": result.planning_seconds, "replans": result.replans}
    return {"planning": {**found, "length_m": length, "cusps": cusps}}


def computing(cycles: Cycles) -> dict[str, Any]:
    """Over all cycles; the times leave the first cycle out."""
    iterations = _percentiles(cycles.iterations[cycles.solved])
    return {
        "cycle_ms": _percentiles(cycles.step_ms[1:]),
        "feedback_ms": _percentiles(cycles.feedback_ms[1:]),
        "solver": {
            "iterations_p50": iterations["p50"],
            "iterations_p95": iterations["p95"],
            "failures": int(np.count_nonzero(cycles.failed)),
            "interior_point_cycles": int(np.count_nonzero(cycles.interior_point)),
        },
        "fallback_cycles": sum(map(_is_fallback, cycles.source, cycles.status)),
        "deadline_misses": int(np.count_nonzero(cycles.deadline_missed)),
    }


def _is_fallback(source: Source, status: Status) -> bool:
    """Whether a substitute was driven in place of a plan; braking to rest at the goal or cusp is none."""
    if status in (Status.FAILED, Status.BLOCKED) or source is Source.SHIFTED_PLAN:
        return True
    return source is Source.BRAKING and status not in _ENDS_BY_BRAKING


def _percentiles(values: Array) -> dict[str, float | None]:
    names = {"p50": 50, "p95": 95, "p99": 99, "max": 100}
    return {name: float(np.percentile(values, q)) if len(values) else None for name, q in names.items()}
