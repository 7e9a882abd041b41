"""Where each quantity stands in a state and in a control. No bare column number appears elsewhere.

Kernels read these numbers (geometry.compiled).
"""

from __future__ import annotations

from typing import Final

X: Final = 0
"""x of the rear axle [m]."""
Y: Final = 1
"""y of the rear axle [m]."""
PHI: Final = 2
"""heading [rad]."""
POSE: Final = 3
"""So many of the first quantities are the pose."""
V: Final = 3
"""speed [m/s]."""
DELTA: Final = 4
"""steering angle [rad]."""
THETA: Final = 5
"""progress along the route [m]."""
STATES: Final = 6

A: Final = 0
"""acceleration [m/s²]."""
DELTA_DOT: Final = 1
"""steering rate [rad/s]."""
THETA_DOT: Final = 2
"""virtual progress [m/s]."""
CONTROLS: Final = 3
