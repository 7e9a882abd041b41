"""A short form of benchmarks/soak.py: what a controller holds does not grow with its cycles."""

from __future__ import annotations

import gc
import tracemalloc

import pytest

from benchmarks.soak import GROWTH, Shuttle, failed

WARM_UP, CYCLES = 420, 520
"""The first change of direction comes after about 390 cycles, the first wall, which makes the QP larger,
after 600."""


def held(shuttle_cycles: list[int]) -> list[int]:
    """Memory [bytes] that Python objects take after each of these counts of cycles, none of which failed."""
    found = []
    shuttle = Shuttle.of(shuttle_cycles[-1])
    tracemalloc.start()
    try:
        for cycle, (command, _) in enumerate(shuttle.drive(shuttle_cycles[-1]), start=1):
            assert not failed(command), command.diagnostics.reason
            if cycle in shuttle_cycles:
                gc.collect()
                found.append(tracemalloc.get_traced_memory()[0])
    finally:
        tracemalloc.stop()
    return found


@pytest.mark.acceptance
def test_memory_is_flat_once_it_is_warm_and_no_cycle_fails() -> None:
    warm, later = held([WARM_UP, CYCLES])
    assert later <= (1.0 + GROWTH) * warm
