"""The study of many controllers steps each of them, whatever the number of threads."""

from __future__ import annotations

import pytest

from benchmarks.fleet import HEADER, SCENARIO, speed_row, stepped
from benchmarks.workload import record


@pytest.mark.parametrize("threads", [1, 2])
def test_each_controller_of_a_fleet_is_stepped_as_it_was_recorded(threads: int) -> None:
    found = stepped(record(SCENARIO, 4), 3, threads)  # a command that differs raises
    assert found.cycles == 3 * 3
    assert found.cpu > 0.0
    assert len(speed_row(3, found._replace(wall=1.0), found._replace(wall=1.0), 2.0)) == len(HEADER)
