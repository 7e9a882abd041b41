"""Marks what lies in this directory as acceptance and writes its figures to runs/acceptance.json.

Figures travel with the test reports, so they arrive complete also where xdist workers run the tests. The
collecting process has to know this file: name the directory, as `make acceptance` does.
"""

from __future__ import annotations

import json
import math
import platform
from collections.abc import Callable, Iterator, Mapping
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from benchmarks.tables import git
from rti_mpcc.simulation import RunResult, load_scenario, simulate

PROPERTY = "acceptance_figure"


def plain(value: Any) -> Any:
    """`value` in terms of JSON; numpy scalars and arrays as numbers and lists, non-finite numbers as None."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    if value is None or isinstance(value, bool | int | str):
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(key): plain(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [plain(entry) for entry in value]
    raise TypeError(f"figure {value!r} is no number, text, list or mapping")


class Record:
    """What the collecting process learns from the reports of the tests."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.tests: dict[str, dict[str, Any]] = {}

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if "acceptance" not in report.keywords:
            return
        test = self.tests.setdefault(report.nodeid, {"outcome": "passed", "duration_s": 0.0, "figures": {}})
        test["duration_s"] = round(test["duration_s"] + report.duration, 3)
        if report.outcome != "passed" and test["outcome"] != "failed":
            test["outcome"] = report.outcome
        test["figures"].update(value for key, value in report.user_properties if key == PROPERTY)

    def pytest_sessionfinish(self) -> None:
        if not self.tests:
            return
        outcomes = [test["outcome"] for test in self.tests.values()]
        content = {
            "commit": git("rev-parse", "HEAD", root=self.root),
            "uncommitted_changes": bool(git("status", "--porcelain", root=self.root)),
            "date": datetime.now(UTC).isoformat(timespec="seconds"),
            "python": platform.python_version(),
            "machine": platform.machine(),
            "counts": {outcome: outcomes.count(outcome) for outcome in sorted(set(outcomes))},
            "tests": dict(sorted(self.tests.items())),
        }
        target = self.root / "runs" / "acceptance.json"
        target.parent.mkdir(exist_ok=True)
        target.write_text(json.dumps(content, indent=2, allow_nan=False) + "\n", encoding="utf-8")


def pytest_configure(config: pytest.Config) -> None:
    if not hasattr(config, "workerinput"):  # an xdist worker hands its reports on
        config.pluginmanager.register(Record(config.rootpath))


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if Path(__file__).parent in item.path.parents:
            item.add_marker("acceptance")


@pytest.fixture
def figures(record_property: Callable[[str, object], None]) -> Iterator[dict[str, Any]]:
    """Figures of the running test by name: numbers, text, and lists and mappings of them."""
    found: dict[str, Any] = {}
    yield found
    for name, value in found.items():
        record_property(PROPERTY, [name, plain(value)])


@pytest.fixture(scope="session")
def undisturbed() -> Callable[[str], RunResult]:
    """A scenario as it is built in, driven once."""
    return cache(lambda name: simulate(load_scenario(name)))
