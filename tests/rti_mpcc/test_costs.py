"""What a cycle, a ride and a process cost, in counts: they need no clock, and no quiet machine."""

from __future__ import annotations

import gc
import os
import sys
import tomllib
import tracemalloc
from collections.abc import Callable, Iterator
from functools import wraps
from math import pi
from pathlib import Path
from statistics import median
from types import FrameType
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
from numba.core import config

from benchmarks.encounters import on_lane
from geometry import compiled
from rti_mpcc import ControllerConfig, Pose2, ReferencePath
from rti_mpcc.kernels import make_ready
from rti_mpcc.simulation import load_scenario, simulate
from rti_mpcc.simulation.plant import PlantParameters, PlantState
from tests.processes import ROOT, printed
from tests.rti_mpcc.docking_runs import obeyed
from tests.rti_mpcc.hold_draws import GOAL, SEGMENTS

BOUNDS = tomllib.loads(Path(__file__).with_name("cost_bounds.toml").read_text())
PACKAGES = tuple(f"{ROOT / name}{os.sep}" for name in ("geometry", "estimation", "rti_mpcc"))
WARM, COUNTED = 100, 20


class Ride:
    """The README's first example, a cycle at a time."""

    def __init__(self) -> None:
        path = ReferencePath.from_segments(start=Pose2(0.0, 0.0, pi / 2), segments=SEGMENTS)
        self.config = ControllerConfig(cycle=0.05)
        self.controller = on_lane(path, 5.0, self.config)
        self.parameters = PlantParameters.of(self.config.vehicle, self.config.limits, dead_time=0.0)
        self.plant = PlantState(x=0.0, y=0.0, phi=pi / 2)
        for _ in range(WARM):
            self.cycle()

    def cycle(self, around: Callable[[Callable[[], None]], None] = lambda step: step()) -> None:
        """One cycle; `around` is given the call of `step`."""
        state = self.plant.measured

        def step() -> None:
            self.command = self.controller.step(state, now=self.plant.time, goal=Pose2(*GOAL))

        around(step)
        later = self.plant.time + self.config.cycle
        self.plant = obeyed(self.plant, self.command, self.parameters, later)


@pytest.fixture(scope="module")
def ride() -> Ride:
    make_ready()
    return Ride()


def test_functions_that_a_cycle_calls(ride: Ride) -> None:
    calls: list[list[str]] = []

    def watched(step: Callable[[], None]) -> None:
        names: list[str] = []

        def note(frame: FrameType, event: str, _: Any) -> None:
            if event == "call" and frame.f_code.co_filename.startswith(PACKAGES):
                names.append(frame.f_code.co_filename)

        before = sys.getprofile()
        sys.setprofile(note)
        try:
            step()
        finally:
            sys.setprofile(before)
        calls.append(names)

    for _ in range(COUNTED):
        ride.cycle(watched)
    assert 100 < median(map(len, calls)) <= BOUNDS["cycle"]["function_calls"]
    assert 10 < median(len(set(names)) for names in calls) <= BOUNDS["cycle"]["files"]


@pytest.fixture
def counted() -> Iterator[list[str]]:
    """Names of the kernels that are called meanwhile."""
    calls: list[str] = []

    def counting(name: str, kernel: Callable[..., Any]) -> Callable[..., Any]:
        @wraps(kernel)
        def call(*given: Any) -> Any:
            calls.append(name)
            return kernel(*given)

        return call

    ready = {id(each.compiled): each for each in compiled._KERNELS if each.compiled is not None}
    places = [
        (module, name, ready[id(value)])
        for module in list(sys.modules.values())
        if getattr(module, "__name__", "").startswith(("geometry", "estimation", "rti_mpcc"))
        for name, value in list(vars(module).items())
        if id(value) in ready
    ]
    patches = [
        patch.object(module, name, counting(each.name, each.compiled))
        for module, name, each in places
        if each.compiled is not None
    ]
    for each in patches:
        each.start()
    yield calls
    for each in patches:
        each.stop()


@pytest.mark.skipif(config.DISABLE_JIT, reason="there is nothing compiled")
def test_kernels_that_a_cycle_calls(ride: Ride, counted: list[str]) -> None:
    numbers = []
    for _ in range(COUNTED):
        counted.clear()
        ride.cycle()
        numbers.append(len(counted))
    assert 10 < median(numbers) <= BOUNDS["cycle"]["kernel_calls"]


def test_memory_that_a_cycle_takes(ride: Ride) -> None:
    left, peaks = [], []

    def watched(step: Callable[[], None]) -> None:
        blocks, before = sys.getallocatedblocks(), tracemalloc.get_traced_memory()[0]
        tracemalloc.reset_peak()
        step()
        peaks.append((tracemalloc.get_traced_memory()[1] - before) / 1000.0)
        left.append(sys.getallocatedblocks() - blocks)

    gc.disable()
    tracemalloc.start()
    try:
        for _ in range(COUNTED):
            ride.cycle(watched)
    finally:
        tracemalloc.stop()
        gc.enable()
    assert median(left) <= BOUNDS["cycle"]["blocks_left"]
    assert 1.0 < median(peaks) <= BOUNDS["cycle"]["peak_kilobytes"]


def test_iterations_of_the_qps_of_a_ride() -> None:
    rides = [simulate(load_scenario(name)) for name in ("docking_behind", "docking_inside")]
    iterations = np.concatenate([ride.cycles.iterations for ride in rides])
    assert 0 < iterations.sum() <= BOUNDS["ride"]["qp_iterations"]
    assert iterations.max() <= BOUNDS["ride"]["most_qp_iterations"]


def test_what_a_process_loads_and_compiles() -> None:
    code = (
        "import sys, rti_mpcc; from rti_mpcc import *; from geometry import compiled; "
        "DockingController; print(len(compiled._KERNELS), len(sys.modules))"
    )
    kernels, modules = map(int, printed("-c", code).split())
    assert 10 < kernels <= BOUNDS["process"]["kernels"]
    assert 100 < modules <= BOUNDS["process"]["modules"]
