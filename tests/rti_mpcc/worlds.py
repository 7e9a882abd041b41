"""Routes, corridors and settings drawn at random for the property tests: from tame to hardly drivable."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import shapely

from geometry import Corridor, Narrowing, Pose2, ReferencePath, RtiMpccError
from rti_mpcc import ControllerConfig, GoalTracking, Limits, SolverSettings
from rti_mpcc.types import Array

WORLDS = 200
"""So many routes with corridors there are."""
OF_ONE_PART = range(0, WORLDS, 3)
"""Those without a cusp."""
STEERABLE = 0.24
"""Largest curvature that the default vehicle can drive [1/m]."""
HALF_WIDTH = 1.04
"""Least half width of a corridor [m]; half the body's is 1.0345 m."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class World:
    """A route and its corridor."""

    path: ReferencePath
    corridor: Corridor

    def pose(self, share: float) -> Pose2:
        """On the route, at a share of its length from 0 to 1."""
        theta = share * self.path.length
        return next(part for part in self.path.parts if theta <= part.end).pose(theta)


@lru_cache(maxsize=WORLDS)
def world(number: int) -> World:
    """World 0 is straight and wide; the others are drawn, until geometry takes what was drawn."""
    if number == 0:
        path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 20.0)])
        return World(path=path, corridor=Corridor.from_offsets(path, left=5.0, right=-5.0))
    rng = np.random.default_rng(number)
    while True:
        path = _route(rng, 1 + number % 3)
        try:
            return World(path=path, corridor=_corridor(rng, path))
        except RtiMpccError:
            continue


def _route(rng: np.random.Generator, parts: int) -> ReferencePath:
    """Each part of one to three bends, 0.5 to 60 m long; some cannot be steered."""
    direction, segments = int(rng.choice([-1, 1])), []
    for _ in range(parts):
        for _ in range(rng.integers(1, 4)):
            curvature = rng.choice([0.0, rng.uniform(-1.0, 1.0), rng.uniform(-1.5, 1.5)]) * STEERABLE
            segments.append((direction, float(curvature), float(0.5 * 120.0 ** rng.uniform(0.0, 1.0))))
        direction = -direction
    x, y = rng.uniform(-50.0, 50.0, size=2)
    return ReferencePath.from_segments(Pose2(x, y, rng.uniform(-10.0, 10.0)), segments)


def _corridor(rng: np.random.Generator, path: ReferencePath) -> Corridor:
    first = path.parts[0]
    obstacles = []
    for size in rng.uniform(0.1, 3.0, size=rng.integers(0, 3)):
        along, across = rng.uniform(-6.0, 6.0, size=2)
        obstacles.append(box(first.pose(rng.uniform(0.0, first.end)), along, across, size))
    if rng.random() < 0.25:
        line = np.concatenate([np.stack([s.x, s.y], axis=-1) for s in path.sample(0.5)])
        outline = shapely.buffer(shapely.LineString(line), rng.uniform(1.5, 8.0))
        return Corridor.from_polygon(path, shapely.get_coordinates(outline.exterior), obstacles=obstacles)
    left, right = HALF_WIDTH * 8.0 ** rng.uniform(0.0, 1.0, size=2)
    narrowings = []
    for _ in range(rng.integers(0, 3)):
        start = rng.uniform(0.0, 0.9 * path.length)
        end = rng.uniform(start + 0.01, path.length)
        narrowings.append(Narrowing(start, end, left=rng.uniform(HALF_WIDTH, left)))
    return Corridor.from_offsets(path, left=left, right=-right, narrowings=narrowings, obstacles=obstacles)


def box(pose: Pose2, along: float, across: float, size: float) -> Array:
    """Corners (4, 2) [m] of a square whose middle lies beside a pose."""
    corners = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)]
    placed = [pose.compose(Pose2(along + size * a, across + size * b, 0.0)) for a, b in corners]
    return np.array([[corner.x, corner.y] for corner in placed])


@dataclass(frozen=True, slots=True, kw_only=True)
class Setting:
    """What is drawn of a configuration; see `ControllerConfig`."""

    preset: str = "default"
    cycle: float = 0.05
    dead_time: float = 0.0
    stages: int = 10
    required: bool = False
    deadline: float | None = None
    speed: float = 10.0
    iterations: int = 100

    def config(self) -> ControllerConfig:
        """The configuration."""
        presets: dict[str, Any] = {
            "default": ControllerConfig,
            "paper": ControllerConfig.paper,
            "paper_printed": ControllerConfig.paper_printed,
        }
        made: ControllerConfig = presets[self.preset](
            cycle=self.cycle,
            dead_time=self.dead_time,
            stages=self.stages,
            goal_tracking=GoalTracking(required=self.required),
            deadline=self.deadline,
            limits=Limits(speed=self.speed),
            solver=SolverSettings(max_iterations=self.iterations),
        )
        return made
