"""Marks what lies in this directory as acceptance and writes its figures to runs/acceptance.json.

Figures travel with the test reports, so they arrive complete also where xdist workers run the tests. The
collecting process has to know this file: name the directory, as `make acceptance` does.
"""

from __future__ import annotations

import json
import math
import platform
import subprocess
from collections.abc import Generator, Iterator, Mapping, MutableMapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest

PROPERTY = "acceptance_figure"


class Figures(MutableMapping[str, Any]):
    """The running test's figures by name; numbers, text, and lists and mappings of them.

    One object serves the whole session and files what is set under the test that is running, also from a
    fixture of wider scope (then under the test that set it up). Non-finite numbers become null.
    """

    def __init__(self) -> None:
        self.test: pytest.Item | None = None

    def __setitem__(self, name: str, value: Any) -> None:
        properties = self._properties()
        properties[:] = [entry for entry in properties if not _holds(entry, name)]
        properties.append((PROPERTY, [name, plain(value)]))

    def __getitem__(self, name: str) -> Any:
        for entry in self._properties():
            if _holds(entry, name):
                return entry[1][1]
        raise KeyError(name)

    def __delitem__(self, name: str) -> None:
        self[name]
        properties = self._properties()
        properties[:] = [entry for entry in properties if not _holds(entry, name)]

    def __iter__(self) -> Iterator[str]:
        return iter([value[0] for key, value in self._properties() if key == PROPERTY])

    def __len__(self) -> int:
        return sum(key == PROPERTY for key, _ in self._properties())

    def _properties(self) -> list[tuple[str, Any]]:
        if self.test is None:
            raise RuntimeError("figures can be set only while an acceptance test runs")
        return self.test.user_properties


def _holds(entry: tuple[str, Any], name: str) -> bool:
    return entry[0] == PROPERTY and entry[1][0] == name


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
            "commit": git(self.root, "rev-parse", "HEAD"),
            "uncommitted_changes": bool(git(self.root, "status", "--porcelain")),
            "date": datetime.now(UTC).isoformat(timespec="seconds"),
            "python": platform.python_version(),
            "machine": platform.machine(),
            "counts": {outcome: outcomes.count(outcome) for outcome in sorted(set(outcomes))},
            "tests": dict(sorted(self.tests.items())),
        }
        target = self.root / "runs" / "acceptance.json"
        target.parent.mkdir(exist_ok=True)
        target.write_text(json.dumps(content, indent=2, allow_nan=False) + "\n", encoding="utf-8")


def git(root: Path, *arguments: str) -> str | None:
    """Standard output of git; None where there is no git or no repository."""
    try:
        done = subprocess.run(["git", *arguments], cwd=root, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return None
    return done.stdout.strip()


FIGURES = pytest.StashKey[Figures]()


def pytest_configure(config: pytest.Config) -> None:
    config.stash[FIGURES] = Figures()
    if not hasattr(config, "workerinput"):  # an xdist worker hands its reports on
        config.pluginmanager.register(Record(config.rootpath))


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if Path(__file__).parent in item.path.parents:
            item.add_marker("acceptance")


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, object, object]:
    recorder = item.config.stash[FIGURES]
    recorder.test = item
    try:
        return (yield)
    finally:
        recorder.test = None


@pytest.fixture(scope="session")
def figures(pytestconfig: pytest.Config) -> Figures:
    """Figures of the running test: `figures["time_to_tolerance_s"] = 21.3`. A MutableMapping[str, Any]."""
    return pytestconfig.stash[FIGURES]
