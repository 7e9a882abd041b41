"""The number of places at which something long is looked at: bounded, whatever its length."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from geometry.arrays import Index
from geometry.errors import InputError

MOST = 1_000_000
"""Places along one thing: 50 km of a corridor, 250 km of waypoints. They take some 100 MB meanwhile."""


def steps(lengths: ArrayLike, spacing: float, what: str, refuse: type[InputError] = InputError) -> Index:
    """Return the number of steps (n,), at least 1 each, of at most `spacing` [m] along lengths (n,) [m].

    Args:
        lengths, spacing: see above; what: is as long as that, for the message; refuse: the error to raise.

    Raises:
        InputError: of the class `refuse`, if they are more than MOST together, or the spacing is not > 0.
    """
    if not spacing > 0.0:
        raise refuse(f"spacing = {spacing}: must be > 0 m.")
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


def spread(counts: Index) -> tuple[Index, Index]:
    """Return of all steps, counts (n,) of them one after the other, their owner and their number in it.

    Both are of shape (sum(counts),).
    """
    owner = np.repeat(np.arange(counts.size), counts)
    return owner, np.arange(owner.size) - np.repeat(np.cumsum(counts) - counts, counts)
