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

from dataclasses import dataclass
from math import cos, isfinite, sin

import numpy as np
from numpy.typing import ArrayLike, NDArray

from geometry.arrays import Array
from geometry.compiled import Array1, Out2, inner, kernel
from geometry.doors import Admitted, admit, door, to_float, to_floats
from geometry.errors import InputError, PathError
from geometry.pose import Pose2
from geometry.projection import closest, piece_at
from geometry.sampling import MOST, steps


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PathReference:
    """Path poses at n arc lengths.

    Attributes:
        x: (n,) position [m].
        y: (n,) position [m].
        phi: (n,) heading of the vehicle, continuous over the whole route, not wrapped [rad].
        slope: (n,) dphi/dtheta = d kappa [rad/m].
    """

    x: Array
    y: Array
    phi: Array
    slope: Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PathPart(Admitted, error=PathError):
    """A part of a route that is driven in one direction.

    Attributes:
        direction: +1 forward, -1 reverse.
        knots: (m+1,) theta where pieces meet, strictly increasing [m].
        curvatures: (m,) kappa of each piece, positive = steered to the left [1/m].
        x, y: (m+1,) position at the knots [m].
        phi: (m+1,) heading of the vehicle at the knots [rad].
    """

    direction: int
    knots: Array
    curvatures: Array
    x: Array
    y: Array
    phi: Array

    def __post_init__(self) -> None:
        admit(self)
        for values in (self.knots, self.curvatures, self.x, self.y, self.phi):
            values.setflags(write=False)

    @property
    def start(self) -> float:
        """Theta of the first pose [m]."""
        return float(self.knots[0])

    @property
    def end(self) -> float:
        """Theta of the last pose [m]."""
        return float(self.knots[-1])

    @property
    def first(self) -> Pose2:
        """Vehicle pose at `start`."""
        return Pose2(self.x[0], self.y[0], self.phi[0])

    @property
    def last(self) -> Pose2:
        """Vehicle pose at `end`."""
        return Pose2(self.x[-1], self.y[-1], self.phi[-1])

    @door(late=True)
    def places(self, spacing: float, *, least: int = 1) -> Array:
        """Return theta (n,) from start to end [m], even, at most `spacing` [m] apart, with `least` steps.

        Raises:
            PathError: they are too many, see geometry.sampling, or the spacing is not > 0.
        """
        if not 1 <= least <= MOST:
            raise PathError(f"least = {least}: must be 1 to {MOST}.")
        count = max(int(steps(self.end - self.start, spacing, "a part of the path", PathError)[0]), least)
        return np.linspace(self.start, self.end, count + 1)

    @door(late=True)
    def reference(self, theta: ArrayLike) -> PathReference:
        """Return the path poses at theta (n,) [m]: exact within, straight behind both ends.

        Equations (1), (2) of this module.
        """
        theta = to_floats(theta).reshape(-1)
        found = np.empty((4, theta.size))
        _reference(self.knots, self.curvatures, self.x, self.y, self.phi, float(self.direction), theta, found)
        x, y, phi, slope = found
        return PathReference(x=x, y=y, phi=phi, slope=slope)

    @door(late=True)
    def curvature(self, theta: ArrayLike) -> Array:
        """Return kappa (n,) [1/m] at theta (n,) [m]; 0 behind both ends."""
        theta = np.atleast_1d(to_floats(theta))
        inside = (theta >= self.knots[0]) & (theta <= self.knots[-1])
        return np.where(inside, self.curvatures[self._piece(theta)], 0.0)

    @door(late=True)
    def pose(self, theta: float) -> Pose2:
        """Return the vehicle pose at theta [m]."""
        given = self.knots, self.curvatures, self.x, self.y, self.phi, float(self.direction)
        return Pose2(*_pose(*given, to_float(theta)))

    @door(late=True)
    def progress(self, pose: Pose2, theta: float) -> float:
        """Return the theta of a pose that projects to `theta` [m]: beyond an end along the tangent."""
        if theta >= self.end:
            return self.end + max(0.0, self.direction * pose.relative_to(self.last).x)
        if theta <= self.start:
            return self.start + min(0.0, self.direction * pose.relative_to(self.first).x)
        return theta

    @door(late=True)
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
        start, end = self.start, self.end
        low, high = start, end
        if near is not None:
            low, high = min(max(near - reach, start), end), min(max(near + reach, start), end)
        return closest(
            float(x), float(y), self.knots, self.curvatures, self.x, self.y, self.phi,
            float(self.direction), low, high, heading is not None, 0.0 if heading is None else float(heading),
        )  # fmt: skip

    def _piece(self, theta: Array) -> NDArray[np.intp]:
        """Index (n,) of the piece that speaks at theta (n,)."""
        return np.searchsorted(self.knots[1:-1], theta, side="right")


@kernel
def _reference(
    knots: Array1,
    curvatures: Array1,
    x: Array1,
    y: Array1,
    phi: Array1,
    direction: float,
    theta: Array1,
    found: Out2,
) -> None:
    """Rows of `found`: x, y, phi, slope."""
    for j in range(len(theta)):
        found[0, j], found[1, j], found[2, j], found[3, j] = _reference_at(
            knots, curvatures, x, y, phi, direction, theta[j]
        )


@kernel
def _pose(
    knots: Array1, curvatures: Array1, x: Array1, y: Array1, phi: Array1, direction: float, theta: float
) -> tuple[float, float, float]:
    found_x, found_y, heading, _ = _reference_at(knots, curvatures, x, y, phi, direction, theta)
    return found_x, found_y, heading


@inner
def _reference_at(
    knots: Array, curvatures: Array, x: Array, y: Array, phi: Array, direction: float, theta: float
) -> tuple[float, float, float, float]:
    """Equations (1), (2): x, y, phi, slope."""
    i = piece_at(knots, theta)
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
