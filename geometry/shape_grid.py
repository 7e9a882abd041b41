"""Many convex shapes in a uniform grid, and the signed distances of bodies to them.

Each cell names the shapes that reach into it. A body asks the cells around it only, and of these shapes only
those whose bounding circle is near enough to the body's bounding box to be nearer than what was found before.
All is computed in the frame of the body: numbers stay small wherever in the world it is.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, hypot, inf, sin
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from geometry.arrays import Array, Index, locked, locked_record
from geometry.compiled import Array1, Array2, Index1, IndexOut1, Out1, Out2, inner, kernel
from geometry.convex import VALUE, WITNESS, distance_between
from geometry.validation import to_rows

_CELLS = 4  # for each shape, and some more
SAME = 1e-9  # of a distance, by which two are told from one another
MOST_TIED = 8  # shapes as near as the nearest one that are told from one another; at a vertex these are two
_LONG = 8.0  # mean lengths of a shape that a cell is long


class Body(NamedTuple):
    """A rigid body of convex pieces, in its own frame: at pose (0, 0, 0).

    Attributes:
        corners: (k, 2) of all pieces [m]; starts: (pieces + 1,) where each begins.
        middle, half: (2,) of its bounding box; middles, halves: (pieces, 2) of those of the pieces [m].
        pieces: number of them.
    """

    corners: Array2
    starts: Index1
    middle: Array1
    half: Array1
    middles: Array2
    halves: Array2
    pieces: int

    @classmethod
    def of(cls, *pieces: ArrayLike) -> Body:
        """Build from convex pieces (m_i, 2), counter-clockwise [m]."""
        rings = [np.array(piece, dtype=np.float64).reshape(-1, 2) for piece in pieces]
        boxes = np.array([(ring.min(axis=0), ring.max(axis=0)) for ring in rings])
        low, high = boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)
        middles, halves = 0.5 * boxes.sum(axis=1), 0.5 * (boxes[:, 1] - boxes[:, 0])
        box = 0.5 * (low + high), 0.5 * (high - low)
        return locked_record(cls, np.concatenate(rings), _starts(rings), *box, middles, halves, len(rings))

    def __reduce__(self) -> tuple[Any, ...]:
        return locked_record, (Body, *self)

    def trailing(self, direction: int) -> Array:
        """How far (pieces,) each piece reaches behind the origin, driven in this direction of x, or 0 [m]."""
        ahead = direction * self.corners[:, 0]
        return np.maximum(-np.minimum.reduceat(ahead, self.starts[:-1]), 0.0)


class BodyFrame(NamedTuple):
    """Where a body is: its place x, y [m], and cosine and sine of its heading."""

    x: float
    y: float
    c: float
    s: float


class ShapeGrid(NamedTuple):
    """Convex shapes, each of one of several owners.

    Attributes:
        corners: (k, 2) of all shapes [m]; starts: (shapes + 1,) where each begins.
        owner: (shapes,) whose each is; owners: number of owners.
        circles: (shapes, 3) bounding circles x, y, radius [m].
        origin: (2,) of the grid [m]; cell: length of its cells [m]; counts: (2,) of them along x and y.
        begins: (cells + 1,) where the shapes of each cell begin in `members`.
        largest: most corners of a shape.
    """

    corners: Array2
    starts: Index1
    owner: Index1
    owners: int
    circles: Array2
    origin: Array1
    cell: float
    counts: Index1
    begins: Index1
    members: Index1
    largest: int

    @classmethod
    def of_shapes(cls, shapes: Sequence[Array], owner: ArrayLike = 0, owners: int = 1) -> ShapeGrid:
        """Build from convex shapes (m_i, 2), see geometry.convex [m], and whose each is, below `owners`.

        Many shapes of m corners may come as one array (k, m, 2).
        """
        corners = np.concatenate([np.zeros((0, 2)), *(each.reshape(-1, 2) for each in shapes)])
        starts = _starts(shapes)
        each = np.broadcast_to(np.asarray(owner, dtype=np.int64), len(starts) - 1)
        return cls._of(corners, starts, each.copy(), owners)

    @classmethod
    def of_lines(cls, *owned: Sequence[Array]) -> ShapeGrid:
        """Build from the polylines (m_i, 2), m_i >= 1 [m], of each owner; their segments are the shapes."""
        lines = [line for each in owned for line in each]
        longer = [line if len(line) > 1 else np.repeat(line, 2, axis=0) for line in lines]
        ends = [np.stack((line[:-1], line[1:]), axis=1) for line in longer]
        owner = np.repeat(np.arange(len(owned)), [len(each) for each in owned])
        return cls.of_shapes(ends, np.repeat(owner, [len(each) for each in ends]), len(owned))

    @classmethod
    def _of(cls, corners: Array, starts: Index, owner: Index, owners: int) -> ShapeGrid:
        first = starts[:-1]
        middles = 0.5 * (np.minimum.reduceat(corners, first) + np.maximum.reduceat(corners, first))
        off = corners - np.repeat(middles, np.diff(starts), axis=0)
        circles = np.column_stack([middles, np.maximum.reduceat(np.hypot(off[:, 0], off[:, 1]), first)])
        low, high = np.zeros(2), np.zeros(2)
        if len(corners):
            low, high = corners.min(axis=0), corners.max(axis=0)
        size, most = high - low, _CELLS * len(owner) + 64
        mean = 2.0 * float(circles[:, 2].mean()) if len(owner) else 0.0
        cell = max(_LONG * mean, float(np.sqrt(size[0] * size[1] / most)), float(size.max()) / most) or 1.0
        counts = (size / cell).astype(np.int64) + 1
        inside, largest = np.zeros(int(counts[0] * counts[1]), np.int64), int(np.diff(starts).max(initial=1))
        none = np.zeros((2, 0), np.int64)
        grid = locked_record(cls, corners, starts, owner, owners, circles, low, cell, counts, *none, largest)
        _enter(grid, inside, np.zeros(0, np.int64))
        begins = np.concatenate(([0], np.cumsum(inside)))
        members = np.empty(begins[-1], dtype=np.int64)
        _enter(grid, begins[:-1].copy(), members)
        return grid._replace(begins=locked(begins), members=locked(members))

    def __reduce__(self) -> tuple[Any, ...]:
        return ShapeGrid._of, (self.corners, self.starts, self.owner, self.owners)

    def with_shapes(self, more: Sequence[Array]) -> ShapeGrid:
        """Return a grid with more convex shapes (m_i, 2) [m], of the first owner."""
        corners = np.concatenate([self.corners, *more])
        starts = np.concatenate((self.starts, self.starts[-1] + _starts(more)[1:]))
        return ShapeGrid._of(corners, starts, np.pad(self.owner, (0, len(more))), self.owners)

    def moved(self, by: Array) -> ShapeGrid:
        """Return the same shapes, in the same cells, moved by (2,) [m]."""
        circles = self.circles + np.array([by[0], by[1], 0.0])
        corners, origin = self.corners + by, self.origin + by
        return self._replace(corners=locked(corners), circles=locked(circles), origin=locked(origin))

    def beyond(self, points: Array, within: float = inf) -> Array:
        """Return how far points (n, >= 2) are to the right of the nearest line [m]; 0 to the left of it.

        Of a grid of lines. 0 as well where none is `within` [m], and beyond an open end.
        """
        found = np.zeros(len(points))
        beyond_lines(self, points, within, found)
        return found

    def signed_distances(self, body: Body, poses: Array, within: float = inf) -> Array:
        """Return the signed distances (n, owners) [m] of a body at `poses` (n, 3) to what each owner has.

        The least of those of its shapes and the body's pieces; +inf without any nearer than `within` [m].

        Raises InputError for poses of another shape, or not finite.
        """
        poses = to_rows(poses, 3, "poses")
        found = np.empty((len(poses), self.owners))
        signed_distances_to(self, body, poses, within, found)
        return found


def _starts(shapes: Sequence[Array]) -> Index:
    sizes = np.array([each.shape[-2] for each in shapes], dtype=np.int64)
    times = np.array([len(each) if each.ndim == 3 else 1 for each in shapes], dtype=np.int64)
    return np.concatenate(([0], np.cumsum(np.repeat(sizes, times))))


POINT = Body.of([(0.0, 0.0)])


@kernel
def _enter(grid: ShapeGrid, begins: IndexOut1, members: IndexOut1) -> None:
    """Enter each shape into the cells it reaches into, at `begins`, which moves on; without any `members`
    only count them there."""
    corners, starts, origin, cell, counts = grid.corners, grid.starts, grid.origin, grid.cell, grid.counts
    for i in range(len(starts) - 1):
        first, stop = starts[i], starts[i + 1]
        low, high = corners[first, 1], corners[first, 1]
        for k in range(first + 1, stop):
            low, high = min(low, corners[k, 1]), max(high, corners[k, 1])
        last_row = cell_at(high, origin[1], cell, counts[1])
        for row in range(cell_at(low, origin[1], cell, counts[1]), last_row + 1):
            left, right = _span(corners, first, stop, origin[1] + row * cell, cell)
            last_column = cell_at(right, origin[0], cell, counts[0])
            for column in range(cell_at(left, origin[0], cell, counts[0]), last_column + 1):
                at = row * counts[0] + column
                if len(members) > 0:
                    members[begins[at]] = i
                begins[at] += 1


@inner
def cell_at(x: float, origin: float, cell: float, count: int) -> int:
    """The cell along one axis that x is in, or the nearest one."""
    return int(min(max((x - origin) / cell, 0.0), count - 0.5))


@inner
def cells_around(frame: BodyFrame, body: Body, grid: ShapeGrid, within: float) -> tuple[int, int, int, int]:
    """First and last row, first and last column of the cells within reach of a body."""
    x, y, c, s = frame
    middle, half, origin, cell, counts = body.middle, body.half, grid.origin, grid.cell, grid.counts
    at_x, at_y = x + c * middle[0] - s * middle[1], y + s * middle[0] + c * middle[1]
    reach_x = abs(c) * half[0] + abs(s) * half[1] + within
    reach_y = abs(s) * half[0] + abs(c) * half[1] + within
    return (
        cell_at(at_y - reach_y, origin[1], cell, counts[1]),
        cell_at(at_y + reach_y, origin[1], cell, counts[1]),
        cell_at(at_x - reach_x, origin[0], cell, counts[0]),
        cell_at(at_x + reach_x, origin[0], cell, counts[0]),
    )


@inner
def _span(corners: Array, first: int, stop: int, bottom: float, cell: float) -> tuple[float, float]:
    """From where to where along x the edges of a shape are in the row of cells above `bottom`, and a little
    more against rounding."""
    slack = 1e-6 * cell
    low, high = bottom - slack, bottom + cell + slack
    left, right = inf, -inf
    for k in range(first, stop):
        j = k + 1 if k + 1 < stop else first
        x_0, y_0, x_1, y_1 = corners[k, 0], corners[k, 1], corners[j, 0], corners[j, 1]
        if max(y_0, y_1) < low or min(y_0, y_1) > high:
            continue
        begin, end = 0.0, 1.0
        rise = y_1 - y_0
        if abs(rise) > slack:
            a, b = (low - y_0) / rise, (high - y_0) / rise
            begin, end = max(min(a, b), 0.0), min(max(a, b), 1.0)
        x_a, x_b = x_0 + begin * (x_1 - x_0), x_0 + end * (x_1 - x_0)
        left, right = min(left, min(x_a, x_b) - slack), max(right, max(x_a, x_b) + slack)
    return left, right


@kernel
def signed_distances_to(grid: ShapeGrid, body: Body, poses: Array2, within: float, found: Out2) -> None:
    """Write what `ShapeGrid.signed_distances` returns into `found` (n, owners)."""
    shape, witness, middle = np.empty((grid.largest, 2)), np.empty(WITNESS), body.middle
    near = np.empty_like(grid.members)
    for n in range(len(poses)):
        for j in range(len(found[n])):
            found[n, j] = within
        frame = BodyFrame(poses[n, 0], poses[n, 1], cos(poses[n, 2]), sin(poses[n, 2]))
        for i in near[: shapes_near(frame, body, grid, within, near)]:
            least, count = found[n, grid.owner[i]], grid.starts[i + 1] - grid.starts[i]
            ahead, aside = seen_from(frame, grid.circles[i, 0], grid.circles[i, 1])
            if is_off(ahead - middle[0], aside - middle[1], body.half, least + grid.circles[i, 2]):
                continue  # now that others are nearer
            in_frame(grid.corners, grid.starts[i], count, frame, shape)
            for j in range(len(body.starts) - 1):
                piece = body.corners[body.starts[j] : body.starts[j + 1]]
                distance_between(piece, shape[:count], least, witness)
                least = min(least, witness[VALUE])
            found[n, grid.owner[i]] = least
        for j in range(len(found[n])):
            if found[n, j] >= within:
                found[n, j] = inf


@inner
def shapes_near(frame: BodyFrame, body: Body, grid: ShapeGrid, within: float, near: Index) -> int:
    """Put the shapes that may be nearer to a body than `within` into `near`, and say how many these are.

    A shape in several rows of cells is there several times, which does no harm.
    """
    middle, count = body.middle, 0
    first_row, last_row, first_column, last_column = cells_around(frame, body, grid, within)
    for row in range(first_row, last_row + 1):
        # What is in neighbouring cells of a row stands in one piece.
        first_cell, last_cell = row * grid.counts[0] + first_column, row * grid.counts[0] + last_column
        for i in grid.members[grid.begins[first_cell] : grid.begins[last_cell + 1]]:
            ahead, aside = seen_from(frame, grid.circles[i, 0], grid.circles[i, 1])
            if not is_off(ahead - middle[0], aside - middle[1], body.half, within + grid.circles[i, 2]):
                near[count] = i
                count += 1
    return count


@inner
def is_off(x: float, y: float, half: Array, limit: float) -> bool:
    """Whether a point is no nearer than `limit` to the box of half lengths `half` around (0, 0)."""
    dx, dy = abs(x) - half[0], abs(y) - half[1]
    least = max(dx, dy)  # at most as much as the signed distance, and soon known
    off: bool = least >= limit or hypot(max(dx, 0.0), max(dy, 0.0)) + min(least, 0.0) >= limit
    return off


@inner
def seen_from(frame: BodyFrame, x: float, y: float) -> tuple[float, float]:
    """A point as it is seen from a body: along and across it [m]."""
    dx, dy = x - frame.x, y - frame.y
    return frame.c * dx + frame.s * dy, frame.c * dy - frame.s * dx


@inner
def in_frame(corners: Array, first: int, count: int, frame: BodyFrame, shape: Array) -> None:
    """The corners of a shape as they are seen from a body, into `shape` (at least `count`, 2)."""
    for j in range(count):
        shape[j, 0], shape[j, 1] = seen_from(frame, corners[first + j, 0], corners[first + j, 1])


@inner
def is_new(i: int, tied: Index, count: int) -> bool:
    """Whether the i-th shape is none of the first `count` that are `tied`, and another one has room."""
    return count < MOST_TIED and not is_among(i, tied, count)


@inner
def is_among(i: int, met: Index, count: int) -> bool:
    """Whether the i-th shape is one of the first `count` that were `met`: it may be in several cells."""
    for k in range(count):  # noqa: SIM110 - numba compiles no generators here
        if met[k] == i:
            return True
    return False


@kernel
def beyond_lines(grid: ShapeGrid, points: Array2, within: float, found: Out1) -> None:
    """Write what `ShapeGrid.beyond` returns into `found` (n,), which is 0 before."""
    corners, circles, origin, cell, counts = grid.corners, grid.circles, grid.origin, grid.cell, grid.counts
    if len(circles) == 0:
        return
    tied = np.empty(MOST_TIED, np.int64)
    size = cell * (counts[0] + counts[1])
    for n in range(len(points)):
        x, y = points[n, 0], points[n, 1]
        outside_x = max(origin[0] - x, x - origin[0] - cell * counts[0], 0.0)
        outside_y = max(origin[1] - y, y - origin[1] - cell * counts[1], 0.0)
        reach = min(max(outside_x, outside_y) + cell, within)
        searched, least, side, ties, ends = 0, within, 0.0, 0, 0
        # Within more and more of the cells, until nothing outside of them can be nearer.
        while searched == 0 or (least > reach and reach < 2.0 * (size + outside_x + outside_y)):
            reach = 2.0 * reach if searched > 0 else reach
            searched += 1
            last_row = cell_at(y + reach, origin[1], cell, counts[1])
            for row in range(cell_at(y - reach, origin[1], cell, counts[1]), last_row + 1):
                first_cell = row * counts[0] + cell_at(x - reach, origin[0], cell, counts[0])
                last_cell = row * counts[0] + cell_at(x + reach, origin[0], cell, counts[0])
                for k in range(grid.begins[first_cell], grid.begins[last_cell + 1]):
                    i = grid.members[k]
                    dx, dy, far = circles[i, 0] - x, circles[i, 1] - y, least + circles[i, 2]
                    if max(abs(dx), abs(dy)) > far or hypot(dx, dy) > far:
                        continue
                    edge_x = corners[2 * i + 1, 0] - corners[2 * i, 0]
                    edge_y = corners[2 * i + 1, 1] - corners[2 * i, 1]
                    to_x, to_y = x - corners[2 * i, 0], y - corners[2 * i, 1]
                    length = hypot(edge_x, edge_y)
                    if length == 0.0:
                        continue
                    along = (to_x * edge_x + to_y * edge_y) / length
                    left = (edge_x * to_y - edge_y * to_x) / length
                    over = max(-along, along - length, 0.0)
                    distance = hypot(over, left)
                    if distance < least * (1.0 - SAME):
                        least, side, ties, ends = distance, 0.0, 0, 0
                    if distance <= least * (1.0 + SAME) and is_new(i, tied, ties):
                        # At a vertex both its segments tell, at an open end there is only one.
                        tied[ties] = i
                        side += left
                        ties += 1
                        ends += over > 0.0
        if side < 0.0 and not (ties == 1 and ends == 1):
            found[n] = least
