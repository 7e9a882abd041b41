"""Which cases are the worst, and why."""

from __future__ import annotations

from itertools import chain, zip_longest
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rti_mpcc.report.campaign.columns import Campaign, in_words
from rti_mpcc.report.campaign.figures import time_over_yardstick

ORDER = (
    "Worst are those whose body left the corridor or met an obstacle, the deepest first; then those that did "
    "not dock: worker died, raised, failed, stalled, unfinished, in each the least clearance first. Of the "
    "rest, in turn, the one with the least clearance, and the one with the longest time to dock over its "
    "yardstick."
)
CROSSED, CLOSE, LONG = "crossed a boundary", "least clearance", "longest for its way"


class Worst(NamedTuple):
    """A case by its row, and why it is among the worst."""

    row: int
    why: str


def worst_cases(campaign: Campaign, count: int) -> list[Worst]:
    """The `count` worst, or all, in the order of `ORDER`."""
    clearance = _last_where_unknown(campaign["min_clearance_m"])
    crossed = _by(clearance, campaign.crossed)
    lost = ~campaign.docked & ~campaign.crossed
    # lexsort: its last key counts first.
    unfit = np.lexsort((clearance, campaign.outcome))
    found = [Worst(row, CROSSED) for row in crossed]
    found += [Worst(row, in_words(campaign.outcome_of(row))) for row in unfit.tolist() if lost[row]]
    rest = campaign.docked & ~campaign.crossed
    close = [Worst(row, CLOSE) for row in _by(clearance, rest)]
    long = [Worst(row, LONG) for row in _by(_last_where_unknown(-time_over_yardstick(campaign)), rest)]
    taken: dict[int, Worst] = {}
    for one in chain(found, chain.from_iterable(zip_longest(close, long))):
        if len(taken) >= count:
            break
        taken.setdefault(one.row, one)
    return list(taken.values())


def _by(values: NDArray[np.float64], wanted: NDArray[np.bool_]) -> list[int]:
    """Wanted rows, that of the least value first; equal ones in the order of the cases."""
    return [row for row in np.argsort(values, kind="stable").tolist() if wanted[row]]


def _last_where_unknown(values: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.where(np.isfinite(values), values, np.inf)
