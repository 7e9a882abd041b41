"""What was promised about speed (issues 6 and 21), set against what was measured."""

from __future__ import annotations

from math import log

import numpy as np

from benchmarks.figures import Target, distribution
from benchmarks.measured import Measured
from benchmarks.speed_tables import referenced
from benchmarks.sweeps import LENGTHS, POINTS, cost_at
from benchmarks.workload import later, solving


def targets(found: Measured) -> list[Target]:
    """All of them, in the order in which they were promised."""
    return [*_speed(found), *_accuracy(found), *_growth(found), *_standing(found)]


def _speed(found: Measured) -> list[Target]:
    yardstick = found.yardstick.p50
    cycle, feedback, first = (
        distribution(later(found.rounds)["step_ms"]),
        distribution(solving(found.rounds)["feedback_ms"]),
        distribution(found.rounds.loc[[0], "step_ms"]),
    )
    rows = [
        ("cycle p50", cycle.p50, 0.38),
        ("cycle p95", cycle.p95, 0.65),
        ("cycle p99", cycle.p99, 0.90),
        ("feedback phase p50", feedback.p50, 0.12),
        ("feedback phase p99", feedback.p99, 0.35),
        ("first cycle of a drive p50", first.p50, 1.5),
        ("first cycle of a drive max", first.max, 8.0),
    ]
    timed = [
        Target(f"{name} / yardstick", value / yardstick, bound, note=f"{value:.2f} ms")
        for name, value, bound in rows
    ]
    late = Target(
        "updates of P or A after the measurement",
        float(found.counts.late_matrix_updates),
        0.0,
        digits=0,
        note=f"of {found.counts.matrix_updates}",
    )
    return [*timed, late]


def _accuracy(found: Measured) -> list[Target]:
    entries = referenced(found.entries)
    acceleration = float(entries["acceleration"].quantile(0.95))
    rate = float(entries["steering_rate"].quantile(0.95))
    slow = max(found.loops, key=lambda run: run["time_apart"])
    near = max(found.loops, key=lambda run: run["clearance_apart_m"])
    return [
        Target("error of the first acceleration, p95 [m/s²]", acceleration, 0.002, digits=4),
        Target("error of the first steering rate, p95 [rad/s]", rate, 0.0082, digits=4),
        Target(
            "T, shipped against tight settings [%]",
            100.0 * slow["time_apart"],
            2.0,
            note=slow["scenario"],
        ),
        Target(
            "clearance, shipped against tight settings [m]",
            near["clearance_apart_m"],
            0.02,
            digits=3,
            note=near["scenario"],
        ),
    ]


def _growth(found: Measured) -> list[Target]:
    rows = found.sweeps
    stages = cost_at(rows, "stages", 200) / cost_at(rows, "stages", 70)
    length = cost_at(rows, "path length", LENGTHS[-1]) / cost_at(rows, "path length", LENGTHS[0])
    points = cost_at(rows, "boundary points", POINTS[-1]) / cost_at(rows, "boundary points", POINTS[0])
    return [
        Target("cost at N = 200 / at N = 70", stages, 3.2),
        Target("cost on 10 km / on 30 m", length, 1.10),
        Target(
            "cost with 100,000 boundary points / with 300",
            points,
            log(POINTS[-1]) / log(POINTS[0]),
            note="the bound is the ratio of the logarithms",
        ),
    ]


def _standing(found: Measured) -> list[Target]:
    longest = found.standing[max(found.standing)]
    short = found.standing[min(found.standing)]
    built = np.sum([longest[name] for name in ("path_s", "corridor_s", "controller_s")], axis=0)
    own = [np.subtract(one["running_mb"], one["route_mb"]) for one in found.standing.values()]
    loaded = found.imported["loaded"]
    return [
        Target("import [s]", float(np.median(found.imported["seconds"])), 0.7),
        Target(
            "unwanted libraries that the import loads",
            float(len(loaded)),
            0.0,
            digits=0,
            note=", ".join(loaded),
        ),
        Target(
            "construction of a controller on a 10 km route [s]",
            float(np.median(longest["controller_s"])),
            0.5,
            digits=3,
        ),
        Target("construction of path, corridor and controller of 10 km [s]", float(np.median(built)), 0.5),
        Target("memory, running on 30 m [MB]", max(short["running_mb"]), 250.0, digits=0),
        Target("memory, running on 10 km [MB]", max(longest["running_mb"]), 250.0, digits=0),
        Target(
            "memory of the controller itself [MB]", float(max(each.max() for each in own)), 20.0, digits=1
        ),
    ]
