"""One direction of motion of a route: a chain of exact constant-curvature pieces.

Kinematics in the arc length theta, d the direction of motion and phi the heading of the vehicle:

    dx/dtheta = d cos(phi),   dy/dtheta = d sin(phi),   dphi/dtheta = d kappa               (1)

so kappa = tan(steering)/wheelbase of a vehicle on the path, whichever way it drives. Over a piece of length s
the heading turns by 2 h = d kappa s and the chord is s sin(h)/h long in the direction phi + h:

    x(s) = x_0 + d s sinc(h) cos(phi_0 + h)                                                 (2)

exact on arcs and straights alike (Drake's PiecewiseConstantCurvatureTrajectory states the same chain).
Theta counts along the whole route. At a knot the following piece speaks, at the end of the part the last.
Behind both ends a part goes on straight along the tangent of that end (curvature 0).
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from functools import partial
from math import atan2, ceil, cos, inf, isfinite, isnan, nan, pi, sin
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from geometry.arrays import Array, locked_record
from geometry.compiled import Array1, Out2, inner, kernel
from geometry.errors import InputError, PathError
from geometry.pose import Pose2
from geometry.sampling import steps
from geometry.validation import Validated, to_float, to_floats, validate, validated

# 90 deg are met up to rounding: a candidate put exactly on that limit has to pass.
_HEADING_LIMIT: Final = 0.5 * pi + 1e-9


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PathReference:
    """Path poses at n arc lengths.

    Attributes:
        x, y: (n,) position [m].
        phi: (n,) heading of the vehicle, continuous over the whole route, not wrapped [rad].
        slope: (n,) dphi/dtheta = d kappa [rad/m].
    """

    x: Array
    y: Array
    phi: Array
    slope: Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PathPart(Validated, error=PathError):
    """A part of a route that is driven in one direction.

    Attributes:
        direction: +1 forward, -1 reverse.
        knots: (m+1,) theta where pieces meet, strictly increasing [m].
        curvatures: (m,) kappa of each piece, positive = steered to the left [1/m].
        x, y: (m+1,) position at the knots [m].
        phi: (m+1,) heading of the vehicle at the knots [rad].
        start, end: theta of the first and of the last pose [m].
        arcs: all of this, as kernels take it.
    """

    direction: int
    knots: Array
    curvatures: Array
    x: Array
    y: Array
    phi: Array
    start: float = field(init=False)
    end: float = field(init=False)
    arcs: Arcs = field(init=False)

    def __post_init__(self) -> None:
        validate(self)
        if self.knots.ndim != 1 or self.knots.size < 2:
            raise PathError(f"PathPart.knots = {self.knots.tolist()}: must be two or more numbers")
        arrays = self.knots, self.curvatures, self.x, self.y, self.phi
        object.__setattr__(self, "arcs", locked_record(Arcs, *arrays, float(self.direction)))
        object.__setattr__(self, "start", float(self.knots[0]))
        object.__setattr__(self, "end", float(self.knots[-1]))

    def __reduce__(self) -> tuple[Any, ...]:  # kernels refuse other arrays than closed ones: of copies, too
        given = {each.name: getattr(self, each.name) for each in fields(self) if each.init}
        return partial(PathPart, **given), ()

    @property
    def first(self) -> Pose2:
        """Vehicle pose at `start`."""
        return Pose2(float(self.x[0]), float(self.y[0]), float(self.phi[0]))

    @property
    def last(self) -> Pose2:
        """Vehicle pose at `end`."""
        return Pose2(float(self.x[-1]), float(self.y[-1]), float(self.phi[-1]))

    @validated(late=True)
    def places(self, spacing: float) -> Array:
        """Return theta (n,) from start to end [m], even, at most `spacing` [m] apart.

        Raises:
            PathError: they are too many, see geometry.sampling, or the spacing is not finite and > 0.
        """
        count = int(steps(self.end - self.start, spacing, "a part of the path", PathError)[0])
        return np.linspace(self.start, self.end, count + 1)

    @validated(late=True)
    def reference(self, theta: ArrayLike) -> PathReference:
        """Return the path poses at theta (n,) [m]: exact within, straight behind both ends.

        Equations (1), (2) of this module.
        """
        theta = to_floats(theta).reshape(-1)
        x, y, phi, slope = found = np.empty((4, theta.size))
        _reference(self.arcs, theta, found)
        return PathReference(x=x, y=y, phi=phi, slope=slope)

    @validated(late=True)
    def curvature(self, theta: ArrayLike) -> Array:
        """Return kappa (n,) [1/m] at theta (n,) [m]; 0 behind both ends."""
        return self.direction * self.reference(theta).slope

    @validated(late=True)
    def pose(self, theta: float) -> Pose2:
        """Return the vehicle pose at theta [m]."""
        return Pose2(*pose_at(self.arcs, to_float(theta)))

    @validated(late=True)
    def progress(self, pose: Pose2, theta: float) -> float:
        """Return the theta of a pose that projects to `theta` [m]: beyond an end along the tangent."""
        if theta >= self.end:
            return self.end + max(0.0, self.direction * pose.relative_to(self.last).x)
        if theta <= self.start:
            return self.start + min(0.0, self.direction * pose.relative_to(self.first).x)
        return theta

    @validated(late=True)
    def project(
        self,
        x: float,
        y: float,
        *,
        near: float | None = None,
        reach: float = 2.0,
        heading: float | None = None,
    ) -> float:
        """Return the theta in [start, end] of the path point closest to (x, y) [m].

        Args:
            x, y: the point [m].
            near: theta of the last projection [m]; then only [near - reach, near + reach] is searched, so
                that progress cannot jump where the path comes near itself. Without it the whole part is
                searched.
            reach: half length of that window [m], >= 0.
            heading: vehicle heading [rad]; then only path points within 90 deg of it count, unless there
                are none.

        Raises:
            InputError: a number is not finite or reach is negative.
        """
        for name, value in (("x", x), ("y", y), ("near", near), ("reach", reach), ("heading", heading)):
            if value is not None and not isfinite(value):
                raise InputError(f"{name} = {value}: a projection needs finite numbers.")
        if reach < 0.0:
            raise InputError(f"reach = {reach}: must be >= 0 m.")
        low, high = self.start, self.end
        if near is not None:
            low, high = min(max(near - reach, low), high), min(max(near + reach, low), high)
        heading = nan if heading is None else float(heading)
        return _closest(self.arcs, float(x), float(y), low, high, heading)


class Arcs(NamedTuple):
    """A `PathPart` as kernels take it."""

    knots: Array1
    curvatures: Array1
    x: Array1
    y: Array1
    phi: Array1
    direction: float


@kernel
def _reference(arcs: Arcs, theta: Array1, found: Out2) -> None:
    """Rows of `found`: x, y, phi, slope."""
    for j in range(len(theta)):
        found[0, j], found[1, j], found[2, j], found[3, j] = _reference_at(arcs, theta[j])


@kernel
def pose_at(arcs: Arcs, theta: float) -> tuple[float, float, float]:
    """Return x, y, phi at theta [m], as `PathPart.pose` does."""
    x, y, heading, _ = _reference_at(arcs, theta)
    return x, y, heading


@inner
def _reference_at(arcs: Arcs, theta: float) -> tuple[float, float, float, float]:
    """Equations (1), (2): x, y, phi, slope."""
    knots, curvatures, x, y, phi, direction = arcs
    i = _piece_at(knots, theta)
    inside = min(max(theta, knots[0]), knots[-1])
    s, slope, beyond = inside - knots[i], direction * curvatures[i], theta - inside
    half = 0.5 * slope * s
    chord = direction * s * (sin(half) / half if half != 0.0 else 1.0)
    heading = phi[i] + 2.0 * half
    return (
        x[i] + chord * cos(phi[i] + half) + direction * beyond * cos(heading),
        y[i] + chord * sin(phi[i] + half) + direction * beyond * sin(heading),
        heading,
        slope if beyond == 0.0 else 0.0,
    )


@kernel
def _closest(arcs: Arcs, x: float, y: float, lowest: float, highest: float, wanted: float) -> float:
    """Return the theta in [lowest, highest] of the point of a part that is closest to (x, y) [m].

    In the frame of a piece's first pose (u along the travel, w to its left) an arc of slope k = dphi/dtheta
    is nearest or farthest where

        theta - theta_0 = atan2(k u, 1 - k w)/k,          u on a straight,                             (3)

    the nearest being the branch atan2 gives. Besides it, only the ends of the window on that piece can be
    closest and, if a heading within 90 deg of the `wanted` one [rad] is, the two places where it is 90 deg
    off; NaN: any heading. Of equals the first wins.
    """
    knots, curvatures, begin_x, begin_y, heading, direction = arcs
    wants = not isnan(wanted)
    best_square, best_theta, any_square, any_theta = inf, lowest, inf, lowest
    for i in range(_piece_at(knots, lowest), len(curvatures)):
        if knots[i] > highest:
            break
        phi, k = heading[i], direction * curvatures[i]
        c, s = direction * cos(phi), direction * sin(phi)
        dx, dy = x - begin_x[i], y - begin_y[i]
        u, w = c * dx + s * dy, c * dy - s * dx
        low = max(knots[i], lowest) - knots[i]
        high = max(min(knots[i + 1], highest) - knots[i], low)
        for candidate in range(5 if wants and k != 0.0 else 3):
            if candidate == 0:
                local = low
            elif candidate == 1:
                local = high
            elif k == 0.0:
                local = min(max(u, low), high)
            elif candidate == 2:
                local = _into(atan2(k * u, 1.0 - k * w) / k, k, low, high)
            else:
                side = -0.5 * pi if candidate == 3 else 0.5 * pi
                local = _into((wanted - phi + side) / k, k, low, high)
            half = 0.5 * k * local
            chord = local * (sin(half) / half if half != 0.0 else 1.0)
            square = (u - chord * cos(half)) ** 2 + (w - chord * sin(half)) ** 2
            theta = local + knots[i]
            if square < any_square or (square == any_square and theta < any_theta):
                any_square, any_theta = square, theta
            if wants:
                off = phi + k * local - wanted
                if abs(off - 2.0 * pi * round(off / (2.0 * pi))) > _HEADING_LIMIT:
                    continue
                if square < best_square or (square == best_square and theta < best_theta):
                    best_square, best_theta = square, theta
    found = best_theta if best_square < inf else any_theta
    return min(max(found, lowest), highest)


@inner
def _piece_at(knots: Array1, theta: float) -> int:
    """The last piece that begins at theta or before."""
    first, last = 0, len(knots) - 2
    while first < last:
        middle = (first + last + 1) // 2
        if knots[middle] <= theta:
            first = middle
        else:
            last = middle - 1
    return first


@inner
def _into(value: float, k: float, low: float, high: float) -> float:
    """The first value + j 2 pi/|k| that is >= low, cut at high."""
    period = 2.0 * pi / abs(k)
    turns = ceil((low - value) / period)
    return min(max(value + turns * period if turns != 0 else value, low), high)
