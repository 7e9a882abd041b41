"""Drives of which it is known that they are clear: pieces of constant curvature, and the ground they are on.

A drive is a chain of pieces (direction d, curvature kappa [1/m], length l [m]). With phi the heading of the
vehicle, s the way within the piece and sinc(a) = sin(a)/a its poses are

    phi(s) = phi_0 + d kappa s,   x(s) = x_0 + d s sinc(kappa s/2) cos(phi_0 + d kappa s/2), y likewise   (1)

Every piece may begin with a stop, at which the wheels are turned; so the curvature may step between pieces.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import acos
from typing import Any, NamedTuple

import numpy as np
import shapely

from geometry import Pose2, ReferencePath, lift
from rti_mpcc.config import Vehicle
from rti_mpcc.model.footprint import body_polygons
from rti_mpcc.types import Array

SPACING = 0.04
"""Between the bodies at which a way is looked at while a drive is being made [m]."""
LEAST = 0.05
"""Pieces that end where something is in the way are at least so long [m]."""
_CHUNK = 40  # bodies looked at together, before those behind them
_SWEPT = 0.2  # [m] between the bodies whose hulls make up the swept area


class Piece(NamedTuple):
    """Part of a drive: direction (+1 forward, -1 reverse), curvature [1/m], positive to the left when driven
    forward, length [m]."""

    direction: int
    curvature: float
    length: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Drive:
    """Pieces that are driven one after the other.

    Attributes:
        begin, end: poses of the middle of the rear axle; `end` follows from the others by (1).
        pieces: in the order in which they are driven.
    """

    begin: Pose2
    end: Pose2
    pieces: tuple[Piece, ...] = ()

    @classmethod
    def at(cls, pose: Pose2, pieces: Iterable[Piece] = ()) -> Drive:
        """Return the drive from a pose along pieces."""
        drive = cls(begin=pose, end=pose)
        for piece in pieces:
            drive = drive.on(*piece)
        return drive

    def on(self, direction: int, curvature: float, length: float) -> Drive:
        """Return this drive and one more piece; this one where its length [m] is next to nothing."""
        if length < 1e-6:
            return self
        piece = Piece(int(direction), float(curvature), float(length))
        end = Pose2(*_poses(self.end, piece, np.array([length]))[0].tolist())
        return Drive(begin=self.begin, end=end, pieces=(*self.pieces, piece))

    @property
    def length(self) -> float:
        """[m], there and back."""
        return sum(piece.length for piece in self.pieces)

    @property
    def cusps(self) -> int:
        """How often the direction changes."""
        return sum(a.direction != b.direction for a, b in pairwise(self.pieces))

    @property
    def path(self) -> ReferencePath:
        """The same way as a reference path, computed by geometry."""
        return ReferencePath.from_segments(self.begin, self.pieces)

    def back(self) -> Drive:
        """Return the drive from its end to its begin along the same poses."""
        return Drive.at(self.end, (piece._replace(direction=-piece.direction) for piece in self.pieces[::-1]))

    def mirrored(self) -> Drive:
        """Return the drive with left and right exchanged, at the x axis."""
        begin = Pose2(self.begin.x, -self.begin.y, -self.begin.phi)
        return Drive.at(begin, (piece._replace(curvature=-piece.curvature) for piece in self.pieces))

    def poses(self, spacing: float) -> Array:
        """Poses (n, 3) x, y [m], heading [rad], at most `spacing` [m] apart, with the ends of all pieces."""
        rows, pose = [np.array([[self.begin.x, self.begin.y, self.begin.phi]])], self.begin
        for piece in self.pieces:
            count = int(np.ceil(piece.length / spacing))
            rows.append(_poses(pose, piece, np.linspace(0.0, piece.length, count + 1)[1:]))
            pose = Pose2(*rows[-1][-1].tolist())
        return np.concatenate(rows)

    def swept(self, vehicle: Vehicle) -> Any:
        """The area (shapely) that the body of a vehicle covers, to about a centimetre."""
        bodies = body_polygons(self.poses(_SWEPT), vehicle)
        pairs = np.concatenate((bodies[:-1], bodies[1:]), axis=1) if len(bodies) > 1 else bodies
        return shapely.union_all(shapely.convex_hull(shapely.multipoints(pairs)))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Ground:
    """What stands, and a vehicle that keeps its distance to it.

    Attributes:
        vehicle: its body; curvature: the largest of its drives [1/m].
        clearance: distance of the body to all that stands [m].
        standing: tree (shapely) of obstacles and of the lines of the boundary.
    """

    vehicle: Vehicle
    curvature: float
    clearance: float
    standing: Any

    @classmethod
    def of(
        cls,
        vehicle: Vehicle,
        curvature: float,
        clearance: float,
        obstacles: Sequence[Array],
        boundary: Array | None = None,
    ) -> Ground:
        """Ground with obstacles (m, 2) and within a boundary (m, 2) [m]."""
        return cls(
            vehicle=vehicle,
            curvature=curvature,
            clearance=clearance,
            standing=shapely.STRtree(list(standing(obstacles, boundary))),
        )

    def free(self, pose: Pose2) -> bool:
        """Whether the body has its clearance at a pose."""
        return self._blocked(np.array([[pose.x, pose.y, pose.phi]])) is None

    def free_length(self, pose: Pose2, direction: int, curvature: float, length: float) -> float:
        """How far a piece from a pose is clear [m]: `length` itself where all of it is."""
        piece = Piece(direction, curvature, length)
        ways = np.linspace(0.0, length, int(np.ceil(length / SPACING)) + 1)
        for begin in range(0, ways.size, _CHUNK):
            blocked = self._blocked(_poses(pose, piece, ways[begin : begin + _CHUNK]))
            if blocked is not None:
                return float(ways[max(begin + blocked - 1, 0)])
        return length

    def driven(self, drive: Drive, direction: int, curvature: float, length: float) -> Drive | None:
        """A drive and one more piece, None where that is not clear."""
        if self.free_length(drive.end, direction, curvature, length) < length:
            return None
        return drive.on(direction, curvature, length)

    def turned(self, drive: Drive, heading: float, direction: int, *, moves: int) -> Drive | None:
        """Turn to a heading [rad] (this branch) by arcs at full lock, each until something is near.

        Directions alternate and the turn is the same in all; the first piece goes in `direction`. None where
        it takes more than `moves` of them, or gets nowhere.
        """
        stuck = 0
        for _ in range(moves):
            left = heading - drive.end.phi
            curvature = float(np.copysign(self.curvature, left)) * direction
            wanted = abs(left) / self.curvature
            length = self.free_length(drive.end, direction, curvature, wanted)
            if length >= wanted:
                return drive.on(direction, curvature, wanted)
            stuck = 0 if length >= LEAST else stuck + 1
            if stuck == 2:
                return None
            drive = drive.on(direction, curvature, length if length >= LEAST else 0.0)
            direction = -direction
        return None

    def shifted(self, drive: Drive, lateral: float, direction: int) -> Drive | None:
        """Move sideways by `lateral` [m], positive to the left of the vehicle, by two arcs at full lock."""
        turn = min(acos(max(1.0 - 0.5 * abs(lateral) * self.curvature, -1.0)), 1.2)
        straight = max(abs(lateral) - 2.0 * (1.0 - np.cos(turn)) / self.curvature, 0.0) / np.sin(turn or 1.0)
        bend, arc = float(np.copysign(self.curvature, lateral)), turn / self.curvature
        found: Drive | None = drive
        for curvature, length in ((bend, arc), (0.0, float(straight)), (-bend, arc)):
            found = found and self.driven(found, direction, curvature, length)
        return found

    def leaving(
        self,
        random: np.random.Generator,
        drive: Drive,
        direction: int,
        reach: tuple[float, float],
        headings: Sequence[float],
        *,
        moves: int,
    ) -> Drive | None:
        """Leave a narrow place: straight by some length within `reach` [m], then turned to one of `headings`
        [rad]; of some ways that are tried one with the fewest pieces."""
        most = self.free_length(drive.end, direction, 0.0, reach[1])
        found: list[Drive] = []
        for length in random.permutation(np.linspace(reach[0], reach[1], 13)):
            if length > most or len(found) == 3:
                continue
            for heading in random.permutation(np.array(headings)):
                out = drive.on(direction, 0.0, float(length))
                way = self.turned(out, float(lift(heading, out.end.phi)), direction, moves=moves)
                found += [way] if way else []
        return min(found, key=lambda way: len(way.pieces), default=None)

    def wandered(
        self, random: np.random.Generator, drive: Drive, direction: int, reach: float, pieces: int = 2
    ) -> Drive:
        """Drive on in a direction by up to `reach` [m], straight and on arcs, not quite up to what stands."""
        for _ in range(pieces):
            length = float(random.uniform(0.1, 1.0)) * reach / pieces
            sharpest = min(0.8 * self.curvature, 0.4 / length)
            curvature = float(random.choice([0.0, 1.0]) * random.uniform(-sharpest, sharpest))
            free = self.free_length(drive.end, direction, curvature, length)
            free = free if free == length else 0.7 * free
            drive = drive.on(direction, curvature, free if free > 0.2 else 0.0)
        return drive

    def _blocked(self, poses: Array) -> int | None:
        """The first of poses (n, 3) at which the body is too near to something."""
        bodies = shapely.polygons(body_polygons(poses, self.vehicle))
        hit = self.standing.query(bodies, predicate="dwithin", distance=self.clearance)[0]
        return int(hit.min()) if hit.size else None


def standing(obstacles: Sequence[Array], boundary: Array | None) -> Iterator[Any]:
    """All that stands, as shapes (shapely): obstacles (m, 2), and the lines of a boundary (m, 2) [m]."""
    yield from map(shapely.Polygon, obstacles)
    if boundary is not None:
        yield from shapely.linestrings(np.stack((boundary, np.roll(boundary, -1, axis=0)), axis=1))


def _poses(pose: Pose2, piece: Piece, ways: Array) -> Array:
    """Poses (n, 3) by (1) on a piece that begins at `pose`, after ways (n,) [m]."""
    half = 0.5 * piece.direction * piece.curvature * ways
    chord = piece.direction * ways * np.sinc(half / np.pi)
    middle = pose.phi + half
    return np.column_stack(
        [pose.x + chord * np.cos(middle), pose.y + chord * np.sin(middle), pose.phi + 2.0 * half]
    )
