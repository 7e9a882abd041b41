"""Where each quantity stands in a state and in a control. No bare column number appears elsewhere.

Kernels read these numbers (geometry.compiled).
"""

from __future__ import annotations

X, Y, PHI, V, DELTA, THETA, STATES = range(7)
"""Of a state: place of the rear axle [m], heading [rad], speed [m/s], steering angle [rad], progress along
the route [m]; how many these are."""
POSE = 3
"""So many of the first quantities are the pose."""
A, DELTA_DOT, THETA_DOT, CONTROLS = range(4)
"""Of a control: acceleration [m/s²], steering rate [rad/s], virtual progress [m/s]; how many these are."""
