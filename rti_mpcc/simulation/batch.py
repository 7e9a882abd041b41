"""Many runs, spread over the cores."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

from geometry.errors import check_extra
from rti_mpcc.errors import InputError
from rti_mpcc.kernels import prepare_process
from rti_mpcc.simulation.closed_loop import Controller, driver_of, simulate
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
    method: str | None = None
    preset: str = "default"
    seed: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class DrivenCase:
    """A case, its run, and the `summary` of that."""

    case: Case
    result: RunResult
    figures: dict[str, Any]


def drive(case: Case, controller: Controller | None = None) -> DrivenCase:
    """Drive one case, in a prepared process, by its own controller or a wrapped one. Raises InputError."""
    options: dict[str, Any] = {"method": case.method, "preset": case.preset}
    controller = controller or driver_of(case.scenario, **options)
    prepare_process()
    result = simulate(case.scenario, seed=case.seed, controller=controller, **options)
    return DrivenCase(case=case, result=result, figures=summary(result))


def checked_jobs(jobs: int | None) -> int:
    """The number of processes, by default that of the cores. Raises InputError for jobs < 1."""
    if jobs is not None and jobs < 1:
        raise InputError(f"jobs = {jobs}: must be >= 1")
    return jobs or os.cpu_count() or 1


def drive_all(
    cases: Sequence[Case], *, jobs: int | None = None, progress: Callable[[int, int], None] | None = None
) -> list[DrivenCase]:
    """Drive all cases in `jobs` processes, by default one a core; with one job in this process.

    `progress` is called with (done, in all). Raises InputError.
    """
    driven = []
    for outcome in in_processes(drive, cases, checked_jobs(jobs)):
        driven.append(outcome)
        if progress is not None:
            progress(len(driven), len(cases))
    return driven


def in_processes(work: Callable[[T], R], items: Sequence[T], jobs: int) -> Iterator[R]:
    """The results of the work on each item, in their order. Raises what the work raises."""
    library = joblib()
    with library.parallel_config("loky", n_jobs=min(jobs, max(len(items), 1)), inner_max_num_threads=1):
        parallel = library.Parallel(return_as="generator", batch_size=1)
        yield from parallel(library.delayed(work)(item) for item in items)


def joblib() -> Any:
    """The library joblib; loaded at the first call. Raises MissingExtraError without it."""
    check_extra("sim", "driving many runs needs", "joblib")
    import joblib

    return joblib
