"""Docking problems drawn from a seed, each proven dockable without the controller.

A course is a scenario like any other: `save_scenario` writes it for `rti-mpcc run FILE`. What
is drawn from is a `CourseRange`: its defaults are the courses of the report, `CAMPAIGN` is wider.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi
from typing import Any

import numpy as np

from benchmarks.problems.dockable import find_witness
from geometry import Pose2, ReferencePath
from rti_mpcc.config import Vehicle
from rti_mpcc.errors import InputError, ScenarioError
from rti_mpcc.simulation.scenario import Scenario, scenario_from_dict

DRAWS = 200
"""So many draws of one course before it is given up."""
DIGITS = 4
"""Of all that is drawn, so that a saved course is readable."""
Span = tuple[float, float]
Tables = dict[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class CourseRange:
    """What courses are drawn from, evenly between two bounds or up to one.

    Attributes:
        prefix: names are <prefix>_<seed>_<index>.
        pieces: number of arcs of a route, fewest and most; length: of a route [m].
        shortest_piece: [m].
        curvature: largest of an arc [1/m]; turn: largest of an arc [rad], which bends long ones less.
        cusp_share: of the courses with two arcs or more, those that change direction once.
        half_width: of the corridor, each side drawn by itself [m].
        narrowings, obstacles: most of them; there may be fewer.
        narrow_length: of a narrowing along the route [m].
        narrow_room: beside a body on the route, at either side of a narrowing [m].
        obstacle_size: side of a square [m]; obstacle_room: beside a body on the route [m].
        inside, behind: the goal is up to so far before or behind the end of the route [m].
        beside, turned: and up to so far beside it [m] and turned [rad], to either side.
    """

    prefix: str = "course"
    pieces: tuple[int, int] = (1, 3)
    length: Span = (20.0, 45.0)
    shortest_piece: float = 5.0
    curvature: float = 0.2
    turn: float = 1.6
    cusp_share: float = 0.0
    half_width: Span = (3.0, 5.0)
    narrowings: int = 1
    narrow_length: Span = (1.0, 3.0)
    narrow_room: Span = (0.3, 1.5)
    obstacles: int = 0
    obstacle_size: Span = (0.5, 2.0)
    obstacle_room: Span = (0.5, 2.0)
    inside: float = 2.0
    behind: float = 2.0
    beside: float = 2.0
    turned: float = 0.4


CAMPAIGN = CourseRange(
    prefix="campaign",
    length=(10.0, 60.0),
    shortest_piece=3.0,
    turn=pi,
    cusp_share=0.5,
    half_width=(2.2, 5.0),
    narrowings=2,
    obstacles=2,
    inside=3.0,
    behind=6.0,
)
"""The docking problems of campaigns."""


def drawn_course(seed: int, index: int, within: CourseRange | None = None) -> Scenario:
    """Course number `index` of a seed, always the same: drawn until scenario checks and proof accept it.

    Four in a row are the four kinds: the last part forward or in reverse, the goal inside or behind the end.

    Raises InputError for a negative seed or index, or where nothing can be docked in within DRAWS draws.
    """
    for name, value in (("seed", seed), ("index", index)):
        if value < 0:
            raise InputError(f"{name} = {value}: must be >= 0")
    random = np.random.default_rng([seed, index])
    for _ in range(DRAWS):
        try:
            course = scenario_from_dict(_tables(random, seed, index, within or CourseRange()))
        except ScenarioError:
            continue
        if find_witness(course) is not None:
            return course
    raise InputError(f"course {index} of seed {seed}: none of {DRAWS} draws can be docked in")


def _tables(random: np.random.Generator, seed: int, index: int, within: CourseRange) -> Tables:
    """One draw as the tables of a scenario file."""
    direction, behind = (1, -1)[index % 2], index // 2 % 2 == 1
    segments = _segments(random, direction, within)
    start = [_number(random, -50.0, 50.0), _number(random, -50.0, 50.0), _number(random, -pi, pi)]
    path = ReferencePath.from_segments(
        Pose2(*start), [(s["direction"], s["curvature"], s["length"]) for s in segments]
    )
    half = 0.5 * Vehicle().width
    left, right = _number(random, *within.half_width), -_number(random, *within.half_width)
    narrowings = [
        _narrowing(random, path.length, half, within) for _ in range(random.integers(within.narrowings + 1))
    ]
    obstacles = [_obstacle(random, path, half, within) for _ in range(random.integers(within.obstacles + 1))]
    far = _number(random, 0.0, within.behind if behind else within.inside)
    listed = {"narrowings": narrowings, "obstacles": obstacles}
    offset = [
        far * direction if behind else -far * direction,
        _number(random, -within.beside, within.beside),
        _number(random, -within.turned, within.turned),
    ]
    return {
        "name": f"{within.prefix}_{seed}_{index:02d}",
        "description": _described(segments, far, behind, offset),
        "path": {"start": start, "segments": segments},
        "corridor": {"left": left, "right": right, **{key: rows for key, rows in listed.items() if rows}},
        "goal": {"offset": offset},
        "simulation": {"cycle": 0.05, "dead_time": 0.18},
    }


def _segments(random: np.random.Generator, direction: int, within: CourseRange) -> list[Tables]:
    """Arcs, the last ones driven in `direction`, maybe some before them the other way."""
    count = int(random.integers(within.pieces[0], within.pieces[1] + 1))
    spare = random.uniform(*within.length) - count * within.shortest_piece
    lengths = within.shortest_piece + spare * random.dirichlet(np.ones(count))
    cusp = int(random.integers(1, count)) if count > 1 and random.uniform() < within.cusp_share else 0
    segments = []
    for i, length in enumerate(lengths.tolist()):
        sharpest = min(within.curvature, within.turn / length)
        segments.append(
            {
                "direction": -direction if i < cusp else direction,
                "curvature": _number(random, -sharpest, sharpest),
                "length": round(length, DIGITS),
            }
        )
    return segments


def _narrowing(random: np.random.Generator, length: float, half: float, within: CourseRange) -> Tables:
    """Somewhere on the route, on one side or on both; `half` is that of the body's width [m]."""
    begin = _number(random, 0.0, 0.9 * length)
    end = min(begin + _number(random, *within.narrow_length), length)
    left, right = (half + _number(random, *within.narrow_room) for _ in range(2))
    sides = {"left": round(left, DIGITS), "right": -round(right, DIGITS)}
    kept = (["left"], ["right"], ["left", "right"])[int(random.integers(3))]
    return {"from": begin, "to": round(end, DIGITS), **{side: sides[side] for side in kept}}


def _obstacle(
    random: np.random.Generator, path: ReferencePath, half: float, within: CourseRange
) -> list[list[float]]:
    """A square beside the route, its nearest edge along it."""
    theta = random.uniform(0.0, path.length)
    foot = next(part for part in path.parts if theta <= part.end).pose(theta)
    side = 1.0 if random.uniform() < 0.5 else -1.0
    near = half + random.uniform(*within.obstacle_room)
    size = random.uniform(*within.obstacle_size)
    square = [(-0.5 * size, near), (0.5 * size, near), (0.5 * size, near + size), (-0.5 * size, near + size)]
    corners = [foot.compose(Pose2(along, side * across, 0.0)) for along, across in square]
    return [[round(corner.x, DIGITS), round(corner.y, DIGITS)] for corner in corners]


def _number(random: np.random.Generator, low: float, high: float) -> float:
    return round(float(random.uniform(low, high)), DIGITS)


def _described(segments: Sequence[Tables], far: float, behind: bool, offset: Sequence[float]) -> str:
    first, last = ("forward" if segments[i]["direction"] > 0 else "reverse" for i in (0, -1))
    way = last if first == last else f"{first}, then {last}"
    place = "behind" if behind else "inside"
    return f"{way}, goal {far:.1f} m {place} the end, {offset[1]:.1f} m beside it, {offset[2]:.2f} rad turned"
