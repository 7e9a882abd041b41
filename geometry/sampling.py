"""Points along something long: how many there may be, how densely it is sampled, which say nothing."""

from __future__ import annotations

from math import inf

import numpy as np
import shapely
from numpy.typing import ArrayLike

from geometry.arrays import Array, Index
from geometry.errors import InputError

SPACING = 0.05  # [m] at most, between samples
_BLOCK = 10_000  # points at a time
_MERGED = 1e-6  # [m] samples nearer to each other are one
_CROWDED = 4  # points of a line in each SPACING, above which it is thinned
_THINNED = 1e-5  # [m] no point that is left out is farther from the line than this
MOST = 1_000_000
"""Places along one thing: 50 km of a corridor, 250 km of waypoints. They take some 100 MB meanwhile."""


def steps(lengths: ArrayLike, spacing: float, what: str, refuse: type[InputError] = InputError) -> Index:
    """Return the number of steps (n,), at least 1 each, of at most `spacing` [m] along lengths (n,) [m].

    Raises `refuse` if `what` has more than MOST together, or the spacing is not finite and > 0.
    """
    if not 0.0 < spacing < inf:
        raise refuse(f"spacing = {spacing}: must be > 0 m and finite.")
    with np.errstate(over="ignore"):
        wanted = np.ceil(np.atleast_1d(np.asarray(lengths, dtype=np.float64)) / spacing)
    wanted = np.maximum(wanted, 1.0)
    total = float(wanted.sum())
    if not total <= MOST:
        length = float(np.sum(lengths))
        raise refuse(
            f"{what} is {length:g} m long: at most {MOST * spacing:g} m are allowed, {MOST} places "
            f"{spacing:g} m apart."
        )
    return wanted.astype(np.int64)


def number_steps(counts: Index) -> tuple[Index, Index]:
    """Return of all steps, counts (n,) of them one after the other, their owner and their number in it.

    Both are of shape (sum(counts),).
    """
    owner = np.repeat(np.arange(counts.size), counts)
    return owner, np.arange(owner.size) - np.repeat(np.cumsum(counts) - counts, counts)


def thin_out(line: Array) -> Array:
    """Drop of a polyline (m, 2) points that repeat the one before, and of one of far too many, as a scan has
    them, those that it runs straight past."""
    # In blocks: what a route of many kilometres takes meanwhile stays small.
    blocks = (line[i : i + _BLOCK + 1] for i in range(0, len(line) - 1, _BLOCK))
    kept = np.concatenate([np.ones(1, dtype=np.bool_), *(_lengths(some) > _MERGED for some in blocks)])
    line = line if kept.all() else line[kept]
    if len(line) < _CROWDED or len(line) <= _CROWDED * _lengths(line).sum() / SPACING:
        return line
    return np.asarray(shapely.get_coordinates(shapely.LineString(line).simplify(_THINNED)))


def _lengths(line: Array) -> Array:
    return np.asarray(np.hypot(*np.diff(line, axis=0).T))
