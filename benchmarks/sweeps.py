"""How the cost of a cycle grows: with stages, the length of the path, the points of its boundaries.

Every variant is driven in closed loop for 10 s, several times over, all variants in turn. The drives are
deterministic, so each cycle has several times, the least of which is nearest to what the program costs; the
figures are percentiles over the cycles of these.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from time import perf_counter

import numpy as np

from benchmarks.figures import Distribution, distribution
from geometry import Corridor, Pose2, ReferencePath
from rti_mpcc import ControllerConfig, DockingController, Limits, prepare_process
from rti_mpcc.simulation import load_scenario
from rti_mpcc.simulation.plant import PlantParameters, PlantState, advance, issue
from rti_mpcc.types import Array

CYCLES, WARM_UP = 200, 20
"""Cycles of a drive, and how many of them from the first one on are left out."""
SCENARIO = "docking_behind"
"""Whose first 10 s, a planned arrival between narrowings, are driven with other stages."""
STAGES = (20, 35, 50, 70, 100, 140, 200)
LENGTHS = (30, 100, 300, 1000, 3000, 10_000)
"""Of the winding path [m], multiples of 10."""
POINTS = (300, 1000, 3000, 10_000, 30_000, 100_000)
"""Of the boundaries of the shortest path, which run the same whatever their number."""
WINDING = ((0.05, 2.5), (-0.05, 5.0), (0.05, 2.5))
"""Curvature [1/m] and length [m] of the segments of every 10 m."""
HALF_WIDTH = 2.5
SPEED, ARRIVAL_HORIZON = 0.5, 3.0
"""Speed limit [m/s] and longest arrival [s] on the winding path: plans stay within 5 m, on the shortest one
too, so that all of them see the same of it and none arrives."""
DEAD_TIME = 0.18


@dataclass(slots=True, kw_only=True)
class Variant:
    """One size of a series.

    Attributes:
        series, size: what varies, and how large it is.
        build: makes a fresh controller.
        start: of the vehicle, at rest; goal: to make for, None for the path's end.
        step_ms: a row a drive, times of all its cycles; iterations: of the solvers, of one drive.
    """

    series: str
    size: int
    build: Callable[[], DockingController]
    start: Pose2
    goal: Pose2 | None = None
    step_ms: list[Array] = field(default_factory=list)
    iterations: Array = field(default_factory=lambda: np.empty(0))

    def drive(self, cycles: int = CYCLES) -> None:
        """Once more, with a fresh controller."""
        controller = self.build()
        config = controller.config
        parameters = PlantParameters.of(config.vehicle, config.limits, dead_time=config.dead_time)
        plant = PlantState(x=self.start.x, y=self.start.y, phi=self.start.phi)
        took, iterations = np.empty(cycles), np.empty(cycles)
        prepare_process()
        for cycle in range(cycles):
            plant = advance(plant, parameters, round(cycle * config.cycle, 9))
            begun = perf_counter()
            command = controller.step(plant.measured, now=plant.time, goal=self.goal)
            took[cycle] = 1e3 * (perf_counter() - begun)
            iterations[cycle] = command.diagnostics.iterations
            a, rate = command.acceleration, command.steering_rate
            plant = issue(plant, parameters, acceleration=a, steering_rate=rate)
        self.step_ms.append(took)
        self.iterations = iterations

    @property
    def found(self) -> Distribution:
        """Over the cycles behind the warm-up, of the least time that each took [ms]."""
        return distribution(np.min(self.step_ms, axis=0)[WARM_UP:])

    @property
    def iterations_p50(self) -> float:
        """Median of the solvers' iterations a cycle."""
        return float(np.median(self.iterations[WARM_UP:]))


def winding(length: int) -> ReferencePath:
    """A path of `length` [m] that winds about a straight line."""
    segments = [(1, curvature, way) for _ in range(length // 10) for curvature, way in WINDING]
    return ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), segments)


def middle(path: ReferencePath) -> Pose2:
    """Where the path begins anew, in its middle or just before it."""
    return path.parts[0].pose(10.0 * (path.length // 20.0))


def with_points(corridor: Corridor, points: int) -> Corridor:
    """The same boundaries, of `points` points in all or as many as they have."""
    sizes = [len(line) for walls in corridor.walls for line in walls.both]
    upto = np.round(points * np.cumsum(sizes) / sum(sizes)).astype(np.int64)
    shares = iter(np.diff(upto, prepend=0).tolist())
    walls = [
        replace(
            part,
            left=tuple(denser(line, next(shares)) for line in part.left),
            right=tuple(denser(line, next(shares)) for line in part.right),
        )
        for part in corridor.walls
    ]
    return replace(corridor, walls=tuple(walls))


def denser(line: Array, points: int) -> Array:
    """A polyline (k, 2) with its own points and more between them, at least `points` in all or its own."""
    way = np.cumsum(np.hypot(*np.diff(line, axis=0).T))
    added = np.round(max(points - len(line), 0) * way / way[-1]).astype(np.int64)
    pieces = 1 + np.diff(added, prepend=0)
    at = np.concatenate([i + np.arange(count) / count for i, count in enumerate(pieces)] + [[len(pieces)]])
    knots = np.arange(len(line))
    return np.column_stack([np.interp(at, knots, line[:, 0]), np.interp(at, knots, line[:, 1])])


def sparse_corridor(path: ReferencePath) -> Corridor:
    """Few points: a polygon beside the path and beyond both of its ends."""
    reference = path.parts[0].reference(np.linspace(-6.0, path.length + 6.0, POINTS[0] // 4))
    normal = HALF_WIDTH * np.column_stack([-np.sin(reference.phi), np.cos(reference.phi)])
    line = np.column_stack([reference.x, reference.y])
    return Corridor.from_polygon(path, np.concatenate([line - normal, (line + normal)[::-1]]))


def with_stages(stages: int) -> Variant:
    """`SCENARIO` with so many stages."""
    scenario = load_scenario(SCENARIO)
    config, path = scenario.controller_config("default").changed(stages=stages), scenario.build_path()
    corridor = scenario.build_corridor(path)
    return Variant(
        series="stages",
        size=stages,
        build=lambda: DockingController(path, corridor, config),
        start=path.start,
        goal=scenario.goal_pose(),
    )


def on_winding(series: str, size: int, path: ReferencePath, corridor: Corridor) -> Variant:
    """From the middle of a winding path, in a cruise that never comes to its arrival."""
    limits = Limits(speed=SPEED)
    config = ControllerConfig(
        dead_time=DEAD_TIME, arrival_horizon=ARRIVAL_HORIZON, limits=limits, deadline=None
    )
    return Variant(
        series=series,
        size=size,
        build=lambda: DockingController(path, corridor, config),
        start=middle(path),
    )


def variants(*, quick: bool = False) -> list[Variant]:
    """All of them; `quick`: the ends of each series, and the middle of the stages, only."""

    def few(sizes: Sequence[int]) -> Sequence[int]:
        return (sizes[0], sizes[-1]) if quick else sizes

    rows = [with_stages(stages) for stages in ((20, 70, 200) if quick else STAGES)]
    for length in few(LENGTHS):
        path = winding(length)
        corridor = Corridor.from_offsets(path, left=HALF_WIDTH, right=-HALF_WIDTH)
        rows.append(on_winding("path length", length, path, corridor))
    path = winding(LENGTHS[0])
    sparse = sparse_corridor(path)
    for points in few(POINTS):
        corridor = with_points(sparse, points)
        rows.append(on_winding("boundary points", points, path, corridor))
    return rows


def sweep(rows: Sequence[Variant], *, passes: int, between: Callable[[], None]) -> None:
    """Drive all variants in turn: a machine that slows down slows all of them. `between` comes after each."""
    for _ in range(passes):
        for variant in rows:
            variant.drive()
            between()


def series(rows: Sequence[Variant], name: str) -> list[Variant]:
    """Those of one series, in the order of their sizes."""
    return sorted((row for row in rows if row.series == name), key=lambda row: row.size)


def cost_at(rows: Sequence[Variant], name: str, size: int) -> float:
    """p50 of one variant [ms]. Raises LookupError where it was not driven."""
    for row in rows:
        if (row.series, row.size) == (name, size):
            return row.found.p50
    raise LookupError(f"{name} {size} was not driven")
