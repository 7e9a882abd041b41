"""A route: one-direction parts that meet at cusps."""

from __future__ import annotations

import csv
from array import array
from collections.abc import Sequence
from dataclasses import dataclass
from io import TextIOWrapper
from itertools import pairwise
from math import isfinite, nan
from os import PathLike

import numpy as np
from numpy.typing import ArrayLike, NDArray

from geometry import interpolation
from geometry.arrays import Array, Index
from geometry.errors import PathError, shown
from geometry.files import TABLE, File, opened
from geometry.part import PathPart, PathReference
from geometry.pose import Pose2
from geometry.validation import Validated, to_rows, validate, validated

_COLUMNS = ("x", "y", "heading", "direction")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ReferencePath(Validated, error=PathError):
    """A route, cut at its cusps into parts of one direction.

    Theta [m] counts along the whole route and grows over cusps. Position and vehicle heading are continuous.

    Attributes:
        parts: in the order in which they are driven; part i ends at the theta where part i + 1 starts.
    """

    parts: tuple[PathPart, ...]

    def __post_init__(self) -> None:
        validate(self)
        if not self.parts:
            raise PathError("parts is empty: a path needs at least one part.")

    @property
    def length(self) -> float:
        """Theta of the last pose [m]."""
        return self.parts[-1].end

    @property
    def start(self) -> Pose2:
        """First vehicle pose."""
        return self.parts[0].first

    @property
    def end(self) -> Pose2:
        """Last vehicle pose; its heading is continued from the start, not wrapped."""
        return self.parts[-1].last

    @property
    def cusps(self) -> tuple[float, ...]:
        """Theta where the direction of motion changes [m]."""
        return tuple(part.end for part in self.parts[:-1])

    @property
    def max_curvature(self) -> float:
        """Largest |kappa| of the route [1/m]."""
        return max(float(np.abs(part.curvatures).max()) for part in self.parts)

    @classmethod
    @validated(PathError)
    def from_segments(cls, start: Pose2, segments: Sequence[tuple[int, float, float]]) -> ReferencePath:
        """Build a route from segments (direction, curvature [1/m], length [m]), driven in order.

        The kinematics are those of geometry.part, equation (1): the heading is the vehicle's, direction -1
        reverses.

        Raises:
            PathError: no segment; direction not 1 or -1; curvature not finite; length not finite and
                positive.
        """
        rows = list(segments)
        if not rows:
            raise PathError("segments is empty: a path needs at least one segment.")
        for i, (direction, curvature, length) in enumerate(rows):
            _check_direction(f"segments[{i}]", direction)
            if not isfinite(curvature):
                raise PathError(f"segments[{i}]: curvature = {curvature} must be a finite number.")
            if not (isfinite(length) and length > 0.0):
                raise PathError(f"segments[{i}]: length = {length} must be finite and > 0 m.")
        directions = np.array([int(row[0]) for row in rows])
        curvatures, lengths = np.array([row[1:] for row in rows], dtype=np.float64).T.copy()
        return cls._from_pieces(start, directions, curvatures, lengths)

    @classmethod
    @validated(PathError)
    def from_poses(
        cls, poses: Sequence[Pose2] | ArrayLike, directions: int | Sequence[int] | NDArray[np.integer]
    ) -> ReferencePath:
        """Build a route through vehicle poses, two arcs with common tangents per interval (biarcs).

        Args:
            poses: Pose2s or an array (n, 3) of x, y [m], heading [rad] (any branch).
            directions: one for all; or (n-1,), one for each interval; or (n,), one for each row. With rows,
                the interval between two rows of different direction belongs to the one its chord agrees
                with, so a direction may hold for the way to the row or from it. A cusp may also be listed
                as two rows.

        Raises:
            PathError: fewer than two poses; a number that is not finite; a direction other than 1 and -1;
                repeated points; a heading more than 90 deg away from the way to or from a neighbour.
        """
        rows = _pose_rows(poses)
        rows, intervals = interpolation.pose_intervals(rows, _direction_rows(directions, len(rows)))
        return cls._from_pieces(Pose2(*rows[0]), *interpolation.biarcs(rows, intervals))

    @classmethod
    @validated(PathError)
    def from_waypoints(
        cls, points: ArrayLike, direction: int | Sequence[int] | NDArray[np.integer] = 1
    ) -> ReferencePath:
        """Build a smooth route through points: a chord-length Akima spline per direction, drawn by biarcs.

        It swings nowhere: between points in a line it is straight, whatever comes after them.

        Args:
            points: (n, 2) positions of the rear axle [m].
            direction: one for all; or (n-1,) for the intervals; or (n,) for the rows, where the cusp is the
                row next to the change at which the way turns back more sharply, or is listed as two rows.

        Raises:
            PathError: as `from_poses`, a cusp where the two ways do not turn back, or a route of more than
                250 km.
        """
        rows = _rows(points, 2, "points")
        poses, intervals = interpolation.spline_poses(rows, _direction_rows(direction, len(rows)))
        return cls.from_poses(poses, intervals)

    @classmethod
    @validated(PathError)
    def from_csv(cls, file: str | PathLike[str]) -> ReferencePath:
        """Read a route from a CSV file with the columns x, y [m], heading [rad], direction (1 or -1).

        The header is required, further columns are ignored, rows are as in `from_poses`.

        Raises:
            PathError: the file cannot be read, lacks a column or holds something that is no number (the
                message names file, row and column), or `from_poses` refuses what it says.
        """
        poses, directions = _read_poses(file)
        try:
            return cls.from_poses(poses, directions)
        except PathError as error:
            raise PathError(f"{file}: {error}") from error

    @validated(PathError)
    def sample(self, spacing: float) -> tuple[PathReference, ...]:
        """Return the poses of each part, evenly spaced and at most `spacing` [m] apart, for drawing.

        Raises:
            PathError: spacing is not finite and positive, or so small that the poses are far too many.
        """
        return tuple(part.reference(part.places(spacing)) for part in self.parts)

    @classmethod
    def _from_pieces(
        cls, start: Pose2, directions: Index, curvatures: Array, lengths: Array
    ) -> ReferencePath:
        """Chain m pieces from the start pose and cut them where the direction changes."""
        knots = np.concatenate(([0.0], np.cumsum(lengths)))
        lasting = np.diff(knots) > 0.0
        if not lasting.all():  # shorter than theta is rounded by
            return cls._from_pieces(start, directions[lasting], curvatures[lasting], lengths[lasting])
        half = 0.5 * directions * curvatures * lengths
        phi = start.phi + np.concatenate(([0.0], np.cumsum(2.0 * half)))
        chord = directions * lengths * np.sinc(half / np.pi)
        x = start.x + np.concatenate(([0.0], np.cumsum(chord * np.cos(phi[:-1] + half))))
        y = start.y + np.concatenate(([0.0], np.cumsum(chord * np.sin(phi[:-1] + half))))
        cuts = [0, *(np.flatnonzero(np.diff(directions)) + 1).tolist(), len(lengths)]
        return cls(
            parts=tuple(
                PathPart(
                    direction=int(directions[a]),
                    knots=knots[a : b + 1],
                    curvatures=curvatures[a:b],
                    x=x[a : b + 1],
                    y=y[a : b + 1],
                    phi=phi[a : b + 1],
                )
                for a, b in pairwise(cuts)
            )
        )


def _check_direction(where: str, direction: float) -> None:
    if direction not in (1, -1):
        raise PathError(f"{where}: direction = {direction} must be 1 (forward) or -1 (reverse).")


def _rows(values: ArrayLike, width: int, name: str) -> Array:
    rows = to_rows(values, width, name, PathError)
    if len(rows) < 2:
        raise PathError(f"{name} has {len(rows)} row(s), a path needs at least 2.")
    return rows


def _pose_rows(poses: Sequence[Pose2] | ArrayLike) -> Array:
    if isinstance(poses, Sequence) and all(isinstance(pose, Pose2) for pose in poses):
        values = [(each.x, each.y, each.phi) for each in poses if isinstance(each, Pose2)]
        poses = np.array(values).reshape(-1, 3)
    return _rows(poses, 3, "poses")  # type: ignore[arg-type]


def _direction_rows(directions: int | Sequence[int] | NDArray[np.integer], n: int) -> Index:
    values = np.asarray(directions)
    if values.ndim == 0:
        values = np.full(n - 1, values)
    if values.shape not in ((n,), (n - 1,)):
        raise PathError(f"directions has shape {values.shape}, it must be a number, ({n},) or ({n - 1},).")
    bad = np.flatnonzero(~np.isin(values, (1, -1)))
    if bad.size:
        _check_direction(f"directions[{bad[0]}]", values[bad[0]])
    return values.astype(np.int64)


def _read_poses(file: File) -> tuple[Array, Index]:
    """Vehicle poses (n, 3) [m, m, rad] and directions (n,) of a CSV file; the header is row 1."""
    try:
        with TextIOWrapper(opened(file, TABLE), encoding="utf-8-sig", newline="") as stream:
            lines = enumerate(csv.reader(stream), start=1)
            filled = ((i, row) for i, row in lines if any(map(str.strip, row)))
            header = [name.strip() for name in next(filled, (1, []))[1]]
            for name in _COLUMNS:
                if name not in header:
                    raise PathError(f"{file}: column {name} is missing, a path needs {', '.join(_COLUMNS)}.")
            columns = {name: header.index(name) for name in _COLUMNS}
            values = array("d")  # a row at a time: as text it takes far more
            for i, row in filled:
                values.extend(
                    _number(f"{file}: row {i}, column {name}", row, columns[name]) for name in _COLUMNS
                )
                if values[-1] not in (1.0, -1.0):
                    raise PathError(f"{file}: row {i}, column direction: {values[-1]:g} must be 1 or -1.")
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise PathError(f"{file}: cannot be read ({error}).") from error
    rows = np.array(values).reshape(-1, len(_COLUMNS))
    return rows[:, :3].copy(), rows[:, 3].astype(np.int64)


def _number(where: str, row: list[str], column: int) -> float:
    text = row[column].strip() if column < len(row) else ""
    try:
        value = float(text)
    except ValueError:
        value = nan
    if not isfinite(value):
        raise PathError(f"{where}: {shown(text)} is not a finite number.")
    return value
