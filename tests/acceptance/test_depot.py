"""A map that flickers costs a vehicle in a depot little time, and it docks."""

from __future__ import annotations

from math import inf

import pytest

from benchmarks.depot import driven

LONGER = 1.15


@pytest.mark.parametrize("seed", range(100, 120))
def test_a_depot_that_flickers_is_driven_through_as_one_that_stands_still(seed: int) -> None:
    still = driven(seed, flickers=False).seconds
    assert still < inf
    assert driven(seed, flickers=True).seconds <= LONGER * still
