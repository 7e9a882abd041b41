"""All kernels are ready before the first cycle, which is told once, and compute what they do uncompiled."""

from __future__ import annotations

import json
import logging
import sys
from collections.abc import Iterator

import numpy as np
import pytest
from numba.core import config

from geometry import compiled
from rti_mpcc.kernels import make_ready
from tests.processes import printed

SECONDS = 1.5
DRIVE = f"""
import json, sys
from rti_mpcc.simulation import changed, load_scenario, simulate
result = simulate(changed(load_scenario(sys.argv[1]), {{"simulation.duration": {SECONDS}}}))
cycles = result.cycles
print(json.dumps([*cycles.speed, *cycles.steering, *map(float, cycles.iterations)]))
"""


def driven(scenario: str, **environment: str) -> list[float]:
    """Commands and iterations of the cycles of the first seconds."""
    found: list[float] = json.loads(printed("-c", DRIVE, scenario, **environment))
    return found


@pytest.mark.skipif(config.DISABLE_JIT, reason="there is nothing compiled")
@pytest.mark.parametrize("scenario", ["docking_behind", "docking_inside"])
def test_a_vehicle_is_driven_alike_uncompiled(scenario: str) -> None:
    uncompiled = driven(scenario, NUMBA_DISABLE_JIT="1")
    assert len(uncompiled) > 3 * SECONDS / 0.1
    np.testing.assert_allclose(driven(scenario), uncompiled, rtol=1e-6, atol=1e-6)


@pytest.fixture
def missing(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Kernels that are not on disk, of which nothing is compiled in truth."""
    names = ["one", "two", "three"]

    def build() -> Iterator[str]:
        while names:
            yield names.pop()

    monkeypatch.setattr(compiled, "load", lambda: len(names))
    monkeypatch.setattr(compiled, "build", build)
    return names


def test_compiling_is_told_once(missing: list[str], caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.INFO, logger="rti_mpcc"):
        assert make_ready() == 3
        assert make_ready() == 0
    told, then = caplog.messages
    assert told.startswith("compiling 3 kernels, ")
    assert then == f"the compiled kernels are kept in {compiled.directory()}"


def test_on_a_terminal_a_count_shows_how_far_it_is(
    missing: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    assert make_ready() == 3
    out, err = capsys.readouterr()
    assert out == ""
    shown = [line.rstrip() for line in err.split("\r")[1:]]
    assert shown == [
        f"compiled {k} of 3 kernels: {name}" for k, name in enumerate(("three", "two", "one"), 1)
    ]
    assert err.endswith("\n")
