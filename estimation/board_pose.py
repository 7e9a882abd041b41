"""The goal's pose from the pixels of board corners, knowing that board and vehicle stand nearly upright.

Unknown are the goal's pose z = (x, y, phi) in the vehicle frame and, tied to zero by their tolerances, what
mounting and ground get wrong: the height h and the vehicle's tilt w = (roll, pitch). A corner P_i of the goal
frame is seen at

(B1)  q_i = (I - [w]x) (Rz(phi) P_i + (x, y, h) - c),  p_camera = R' q_i,

through the pinhole of Eq. (K2), pi(q_i), and the best pose minimises

(B2)  sum |u_i - pi(q_i)|² / sigma² + h²/sigma_h² + |w|²/sigma_w².

sigma is the corners' own: `COMMON` times the root mean square of their residuals over the degrees of freedom,
not below `Camera.corner_std`. With J the slopes of all pi(q_i) in the six unknowns and T the tolerances,

(B3)  covariance = upper left (3, 3) of (J'J / sigma² + diag(0, 0, 0, T^-2))^-1.

A flat board seen from afar looks nearly the same turned by +alpha or by -alpha out of the plane across the
line of sight. Each start ends in a minimum of its own of (B2). The lowest one is taken; another one, whose
cost is higher by D and which lies d away, adds to the covariance by its chance:

(B4)  covariance += d d' / (1 + exp(D / 2)).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce
from math import exp

import numpy as np

from estimation.camera import Camera, turn
from estimation.types import Array
from geometry import lift

COMMON = 1.55
"""Corners of a row or column lie alike on the pixel grid, and part of their error is the same: the pose's
error is that of independent corners whose errors are so many times larger (measured, see docs/decisions)."""
ITERATIONS = 30
STEP_ENDS = 1e-9
"""The iteration ends where no unknown changes by more [m], [rad]."""
NEAREST = 0.05
"""Nearer to the lens than this, or behind it, a corner cannot be seen [m]."""
SAME_MINIMUM = 1e-4
"""Two starts that end closer together than this have found the same minimum [m], [rad]."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BoardPose:
    """A minimum of Eq. (B2).

    Attributes:
        value: (3,) x, y [m], phi [rad] of the goal in the vehicle frame.
        covariance: (3, 3) of it, Eq. (B3) and (B4).
        residuals: (n, 2) pixel seen minus pixel expected [px].
        cost: Eq. (B2).
    """

    value: Array
    covariance: Array
    residuals: Array
    cost: float


def fit_board(camera: Camera, corners: Array, pixels: Array, starts: Sequence[Array]) -> BoardPose | None:
    """The goal's pose from corners of known place, Eq. (B1) to (B4); None where no start leads to one.

    Args:
        camera: its distortion is not used.
        corners: (n, 3) in the goal frame [m], n >= 4; pixels: (n, 2) without distortion [px].
        starts: (3,) x, y [m], phi [rad] each, near the minima.
    """
    minima = _minima(camera, corners, pixels, starts, camera.corner_std)
    if not minima:
        return None
    # Once more with the corners' own sigma: it sets how much the tolerances count.
    residuals = minima[0].residuals
    own = COMMON * float(np.sqrt(np.sum(residuals**2) / max(residuals.size - 3, 1)))
    if own > camera.corner_std:
        minima = _minima(camera, corners, pixels, [one.value for one in minima], own)
    return reduce(_doubted, minima) if minima else None


def _minima(
    camera: Camera, corners: Array, pixels: Array, starts: Sequence[Array], sigma: float
) -> list[BoardPose]:
    """Where the starts end, the lowest first."""
    found = [_minimum(camera, corners, pixels, start, sigma) for start in starts]
    return sorted((one for one in found if one is not None), key=lambda one: one.cost)


def _doubted(best: BoardPose, other: BoardPose) -> BoardPose:
    """The best minimum, its covariance widened by the chance that the other one is the true one, Eq. (B4)."""
    way = other.value - best.value
    way[2] = lift(float(other.value[2]), float(best.value[2])) - best.value[2]
    if np.abs(way).max() < SAME_MINIMUM:
        return best
    chance = 1.0 / (1.0 + exp(min(0.5 * (other.cost - best.cost), 700.0)))
    return replace(best, covariance=best.covariance + chance * np.outer(way, way))


def _minimum(camera: Camera, corners: Array, pixels: Array, start: Array, sigma: float) -> BoardPose | None:
    """Levenberg-Marquardt on Eq. (B2) from one start, with the corners' `sigma` [px]."""
    tolerances = np.array([camera.height_std, camera.tilt_std, camera.tilt_std])
    tied = np.concatenate([np.zeros(3), tolerances**-2])
    unknown = np.concatenate([start, np.zeros(3)])
    seen = slopes_of_corners(camera, corners, unknown)
    if seen is None:
        return None
    damping, cost = 1e-3, _cost(pixels - seen[0], unknown, tied, sigma)
    for _ in range(ITERATIONS):
        normal = seen[1].T @ seen[1] / sigma**2 + np.diag(tied)
        pull = seen[1].T @ (pixels - seen[0]).ravel() / sigma**2 - tied * unknown
        step = np.linalg.solve(normal + damping * np.diag(np.diag(normal)), pull)
        tried = slopes_of_corners(camera, corners, unknown + step)
        lower = np.inf if tried is None else _cost(pixels - tried[0], unknown + step, tied, sigma)
        if tried is None or lower > cost:
            damping = min(10.0 * damping, 1e6)
        else:
            unknown, seen, cost, damping = unknown + step, tried, lower, max(0.1 * damping, 1e-12)
        if np.abs(step).max() < STEP_ENDS:
            break
    covariance = np.linalg.inv(seen[1].T @ seen[1] / sigma**2 + np.diag(tied))[:3, :3]
    return BoardPose(
        value=unknown[:3], covariance=0.5 * (covariance + covariance.T), residuals=pixels - seen[0], cost=cost
    )


def _cost(residuals: Array, unknown: Array, tied: Array, sigma: float) -> float:
    return float(np.sum(residuals**2)) / sigma**2 + float(tied @ unknown**2)


def slopes_of_corners(camera: Camera, corners: Array, unknown: Array) -> tuple[Array, Array] | None:
    """Pixels (n, 2) of the corners by Eq. (B1), their slopes (2 n, 6); None where one is behind the lens."""
    x, y, phi, height, roll, pitch = unknown.tolist()
    turned = corners @ turn(phi).T
    at = turned + np.array([x, y, height]) - camera.position
    tilted = np.array([[1.0, 0.0, -pitch], [0.0, 1.0, roll], [pitch, -roll, 1.0]])
    to_camera = camera.rotation.T @ tilted
    seen = at @ to_camera.T
    depth = seen[:, 2]
    if not np.isfinite(seen).all() or depth.min() < NEAREST:
        return None
    pixels = seen[:, :2] / depth[:, None] * (camera.fx, camera.fy) + (camera.cx, camera.cy)
    zero, one = np.zeros_like(depth), np.ones_like(depth)
    moved = [(one, zero, zero), (zero, one, zero), (-turned[:, 1], turned[:, 0], zero), (zero, zero, one)]
    ways = [np.column_stack(way) @ to_camera.T for way in moved]
    # -e_i x q, the way a point goes when the vehicle tilts
    ways += [
        np.column_stack([zero, at[:, 2], -at[:, 1]]) @ camera.rotation,
        np.column_stack([-at[:, 2], zero, at[:, 0]]) @ camera.rotation,
    ]
    slopes = np.stack(ways, axis=2)
    flat = (slopes[:, :2] - seen[:, :2, None] / depth[:, None, None] * slopes[:, 2:]) / depth[:, None, None]
    return pixels, (flat * np.array([camera.fx, camera.fy])[None, :, None]).reshape(-1, 6)
