"""Many runs, spread over the cores."""

from __future__ import annotations

import os
from collections.abc import Callable, Generator, Sequence
from contextlib import closing
from dataclasses import dataclass
from signal import SIG_DFL, SIGINT, signal
from typing import Any, TypeVar

from joblib import Parallel, delayed, parallel_config

from rti_mpcc.errors import InputError
from rti_mpcc.kernels import prepare_process
from rti_mpcc.simulation.closed_loop import Controller, simulate
from rti_mpcc.simulation.controllers import driver_of
from rti_mpcc.simulation.metrics import summary
from rti_mpcc.simulation.result import RunResult
from rti_mpcc.simulation.scenario import Scenario

T = TypeVar("T")
R = TypeVar("R")

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
"""A worker has one thread: the matrices are small, and the workers share the cores."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """One run to be driven: see `simulate`."""

    scenario: Scenario
    method: str = "dynamic"
    preset: str = "default"
    seed: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """A case, its run, and the `summary` of that."""

    case: Case
    result: RunResult
    figures: dict[str, Any]


def drive(case: Case, controller: Controller | None = None) -> Outcome:
    """Drive one case, in a prepared process; `controller` is its own, wrapped in something.

    Raises InputError for an unknown method or preset.
    """
    controller = controller or driver_of(case.scenario, preset=case.preset, method=case.method)
    prepare_process()
    result = simulate(
        case.scenario, method=case.method, preset=case.preset, seed=case.seed, controller=controller
    )
    return Outcome(case=case, result=result, figures=summary(result))


def drive_all(
    cases: Sequence[Case], *, jobs: int | None = None, progress: Callable[[int, int], None] | None = None
) -> list[Outcome]:
    """Drive all cases and give their outcomes in the order of the cases, whatever ran when.

    Args:
        jobs: number of cases at a time; default: as many as there are cores. With one job everything runs in
            this process.
        progress: called with (done, in all) after each case.

    Raises InputError for an unknown method or preset, or jobs < 1.
    """
    if jobs is not None and jobs < 1:
        raise InputError(f"jobs = {jobs}: must be >= 1")
    outcomes: dict[int, Outcome] = {}
    with closing(spread(drive, cases, min(jobs or os.cpu_count() or 1, max(len(cases), 1)))) as driven:
        for place, outcome in driven:
            outcomes[place] = outcome
            if progress is not None:
                progress(len(outcomes), len(cases))
    return [outcomes[place] for place in range(len(cases))]


def spread(work: Callable[[T], R], items: Sequence[T], jobs: int) -> Generator[tuple[int, R]]:
    """Place and result of each item's work in `jobs` processes, as they come. To be closed, see `closing`.

    Raises what the work raises; what has not started by then, or when it is closed, is not done any more.
    """
    if jobs == 1:
        yield from ((place, work(item)) for place, item in enumerate(items))
        return
    tasks = (delayed(_placed)(work, place, item) for place, item in enumerate(items))
    with parallel_config("loky", n_jobs=jobs, inner_max_num_threads=1):
        yield from Parallel(return_as="generator_unordered", pre_dispatch="2*n_jobs", batch_size=1)(tasks)


def _placed(work: Callable[[T], R], place: int, item: T) -> tuple[int, R]:
    end_when_interrupted()
    return place, work(item)


def end_when_interrupted() -> None:
    """End a worker by an interrupt: else that would be the result of its run, and the next one started."""
    signal(SIGINT, SIG_DFL)
