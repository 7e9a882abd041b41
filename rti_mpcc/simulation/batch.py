"""Many runs, spread over the cores."""

from __future__ import annotations

import os
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import closing, contextmanager
from dataclasses import dataclass
from multiprocessing import get_context
from signal import SIG_DFL, SIGINT, signal
from typing import Any, TypeVar

from rti_mpcc.errors import InputError
from rti_mpcc.process import prepare_process
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
    """What became of a case: the run, and its `summary`."""

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

    Workers are processes that import the caller's main module: a script has to call this from under
    `if __name__ == "__main__":`. With one job everything runs in this process.

    Args:
        jobs: so many at a time; default: as many as there are cores.
        progress: told (done, in all) after each case.

    Raises InputError for an unknown method or preset, or jobs < 1.
    """
    if jobs is not None and jobs < 1:
        raise InputError(f"jobs = {jobs}: must be >= 1")
    jobs = min(jobs or os.cpu_count() or 1, max(len(cases), 1))
    tell = progress or (lambda done, total: None)
    if jobs == 1:
        found = []
        for case in cases:
            found.append(drive(case))
            tell(len(found), len(cases))
        return found
    outcomes: dict[int, Outcome] = {}
    with closing(spread(drive, cases, jobs)) as driven:
        for place, outcome in driven:
            outcomes[place] = outcome
            tell(len(outcomes), len(cases))
    return [outcomes[place] for place in range(len(cases))]


def spread(work: Callable[[T], R], items: Sequence[T], jobs: int) -> Generator[tuple[int, R]]:
    """Place and result of each item's work in `jobs` processes, as they come. To be closed, see `closing`.

    Raises what the work raises; what is not begun by then, or when it is closed, is not done any more.
    """
    with (
        one_thread_each(),
        ProcessPoolExecutor(jobs, mp_context=get_context("spawn"), initializer=end_when_interrupted) as pool,
    ):
        futures = {pool.submit(work, item): place for place, item in enumerate(items)}
        try:
            for future in as_completed(futures):
                yield futures[future], future.result()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)  # else all the rest is done first
            raise


def end_when_interrupted() -> None:
    """A worker would take an interrupt for what became of its run, and begin the next one."""
    signal(SIGINT, SIG_DFL)


@contextmanager
def one_thread_each() -> Iterator[None]:
    """Processes that are begun meanwhile have one thread each; what was set before stays."""
    missing = [name for name in THREADS if name not in os.environ]
    os.environ.update(dict.fromkeys(missing, "1"))
    try:
        yield
    finally:
        for name in missing:
            del os.environ[name]
