"""Central differences for tests of slopes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rti_mpcc.types import Array


def slopes(function: Callable[[Array], Array], at: Array, step: float = 1e-6) -> Array:
    """d function / d at, (..., n) for `at` (n,), by central differences."""
    columns = []
    for j in range(len(at)):
        shift = np.zeros_like(at)
        shift[j] = step
        above, below = np.asarray(function(at + shift)), np.asarray(function(at - shift))
        columns.append((above - below) / (2.0 * step))
    return np.stack(columns, axis=-1)
