"""Time: a test may take `timeout` of pyproject.toml, ten times that in acceptance; a cycle takes none."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import count
from pathlib import Path

import pytest

LONGER = 10.0


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    timeout = float(config.getini("timeout") or 0.0)
    for item in items:
        if item.get_closest_marker("acceptance") and not item.get_closest_marker("timeout"):
            item.add_marker(pytest.mark.timeout(LONGER * timeout))


@pytest.fixture(scope="session", autouse=True)
def _time_stands() -> Iterator[None]:
    """Let no deadline pass where a machine is slow: what is driven would depend on it. Slices of a route
    search take a microsecond."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("rti_mpcc.clock.perf_counter", lambda: 0.0)
        patch.setattr("rti_mpcc.route_planner.planner.perf_counter", count(0.0, 1e-6).__next__)
        yield


@pytest.fixture
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of its own, in which the test runs."""
    monkeypatch.chdir(tmp_path)
    return tmp_path
