"""Curves of continuous curvature between two poses, many at a time.

A quintic in u = 0 ... 1 that has the position p, unit tangent t of the travel, left normal n and curvature
c = dphi/ds of a motion at either end, and free speeds m there:

    p' = m t,   p'' = m² c n   at u = 0 and u = 1                                                        (1)

Poses come with their curvature as rows (k, 4): x [m], y [m], heading of the vehicle [rad] and
kappa = tan(steering)/wheelbase [1/m]; in the direction d of motion t = d (cos phi, sin phi), c = d kappa.
Points are complex numbers x + iy.
"""

from __future__ import annotations

import numpy as np

from geometry import lift
from rti_mpcc.types import Array, Complex


def quintics(direction: int, begins: Array, ends: Array, speeds: Array) -> Complex:
    """Coefficients (k, 6) of powers of u, equation (1).

    Args:
        direction: +1 forward, -1 reverse.
        begins, ends: (k, 4).
        speeds: (k, 2) m at both ends in shares of the distance between them.
    """
    p_0, p_1 = (rows[:, 0] + 1j * rows[:, 1] for rows in (begins, ends))
    m = speeds * np.abs(p_1 - p_0)[:, None]
    t_0, t_1 = (direction * np.exp(1j * rows[:, 2]) for rows in (begins, ends))
    v_0, v_1 = m[:, 0] * t_0, m[:, 1] * t_1
    a_0 = m[:, 0] ** 2 * direction * begins[:, 3] * 1j * t_0
    a_1 = m[:, 1] ** 2 * direction * ends[:, 3] * 1j * t_1
    p, v, a = p_1 - p_0 - v_0 - 0.5 * a_0, v_1 - v_0 - a_0, a_1 - a_0
    return np.stack(
        [
            p_0,
            v_0,
            0.5 * a_0,
            10.0 * p - 4.0 * v + 0.5 * a,
            -15.0 * p + 7.0 * v - a,
            6.0 * p - 3.0 * v + 0.5 * a,
        ],
        axis=1,
    )


def driven(direction: int, curves: Complex, u: Array, heading: Array) -> tuple[Array, Array]:
    """Poses with curvature (k, m, 4) of curves (k, 6) at u (m,), and dkappa/ds (k, m) [1/m²] there.

    `heading` (k,) is the vehicle's at their begin [rad], from which it is continued.
    """
    order = np.arange(6)
    powers = u[:, None] ** order
    p = curves @ powers.T
    p_1 = (curves[:, 1:] * order[1:]) @ powers[:, :5].T
    p_2 = (curves[:, 2:] * (order[2:] * order[1:5])) @ powers[:, :4].T
    p_3 = (curves[:, 3:] * (order[3:] * order[2:5] * order[1:4])) @ powers[:, :3].T
    speed = np.maximum(np.abs(p_1), 1e-6)
    cross = (p_1.conj() * p_2).imag
    slope = ((p_1.conj() * p_3).imag / speed**3 - 3.0 * cross * (p_1.conj() * p_2).real / speed**5) / speed
    turned = np.unwrap(np.angle(direction * p_1), axis=1)
    phi = turned + (lift(turned[:, 0], heading) - turned[:, 0])[:, None]
    return np.stack([p.real, p.imag, phi, direction * cross / speed**3], axis=-1), direction * slope
