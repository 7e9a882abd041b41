"""Times of the phases of a cycle, measured from outside: named functions are wrapped with a stop watch.

A wrapper costs about a microsecond a call, so phases are measured in a round of their own. Times are
exclusive: what a wrapped function spends in another wrapped one counts there only, so that all of them add up
to the cycle.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from functools import wraps
from importlib import import_module
from inspect import getattr_static, isroutine
from time import perf_counter
from typing import Any
from unittest.mock import patch

import osqp

STEP = "the rest of the cycle"
PHASES: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("measurement", ("rti_mpcc.world.perception:validate_measurement",)),
    ("projection", ("geometry.part:PathPart.project",)),
    (
        "context, arrival time",
        ("rti_mpcc.course.workspace:Workspace.context",),
    ),
    ("shift of the last plan", ("rti_mpcc.controller:resample",)),
    (
        "path, weights and cost",
        (
            "geometry.part:PathPart.reference",
            "rti_mpcc.ocp.objectives:Contouring.weights",
            "rti_mpcc.ocp.objectives:ArrivalAtRest.weights",
            "rti_mpcc.controller:frenet_errors",
            "rti_mpcc.controller:quadratic_cost",
            "rti_mpcc.controller:stage_bounds",
        ),
    ),
    ("linearisation", ("rti_mpcc.controller:linearised_step",)),
    ("corridor", ("geometry.corridor:Corridor.contacts", "rti_mpcc.controller:corridor_rows")),
    (
        "filling",
        tuple(f"rti_mpcc.controller:{name}" for name in ("fill", "fill_curvature", "fill_initial")),
    ),
    ("OSQP update", ("rti_mpcc.qp.solver:QpSolver.update",)),
    ("prepare, rest", ("rti_mpcc.controller:RtiMpcc.prepare",)),
    ("OSQP solve", ("rti_mpcc.qp.solver:QpSolver.solve",)),
    ("extraction", ("rti_mpcc.controller:RtiMpcc._read",)),
    ("feedback, rest", ("rti_mpcc.controller:RtiMpcc.feedback",)),
    ("check of the plan", ("rti_mpcc.drive.search:rejection_reason",)),
    (
        "check of the body",
        ("rti_mpcc.course.collision_check:distance_to_contact", "rti_mpcc.course.collision_check:overlap"),
    ),
    ("command", ("rti_mpcc.docking:command",)),
    (STEP, ("rti_mpcc.docking:DockingController.step",)),
)
"""Phases in the order of a cycle, and the functions that they consist of: `module:name` as the caller looks
it up. Where a function moves or gets another name, this is the place to say so."""
FEEDBACK = "rti_mpcc.controller:RtiMpcc.feedback"
EXTENSION: Any = osqp.OSQP().ext.OSQPSolver
"""What all of OSQP goes through, whichever way it is called."""


def found(name: str) -> tuple[Any, str, Callable[..., Any]]:
    """Owner, attribute and function of `module:name` or `module:Class.name`.

    Raises LookupError where there is no such function any more.
    """
    module, _, path = name.partition(":")
    *owners, attribute = path.split(".")
    try:
        owner: Any = import_module(module)
        for part in owners:
            owner = getattr(owner, part)
        function = getattr_static(owner, attribute)
    except (ImportError, AttributeError) as error:
        raise LookupError(f"{name}: is not there any more ({error}); see benchmarks/phases.py") from None
    if not isroutine(function):
        raise LookupError(f"{name}: is {function!r}, not a function; see benchmarks/phases.py")
    return owner, attribute, function


@dataclass(slots=True)
class Watches:
    """Exclusive seconds of each phase since `read` was called last."""

    seconds: list[float] = field(default_factory=lambda: [0.0] * len(PHASES))
    _inner: list[float] = field(default_factory=lambda: [0.0])

    def read(self) -> list[float]:
        """Seconds of each phase in the order of `PHASES`, and begin again from 0."""
        seconds, self.seconds = self.seconds, [0.0] * len(self.seconds)
        return seconds

    def around(self, phase: int, function: Callable[..., Any]) -> Callable[..., Any]:
        """The function with its time counted for a phase."""

        @wraps(function)
        def timed(*args: Any, **kwargs: Any) -> Any:
            self._inner.append(0.0)
            begun = perf_counter()
            try:
                return function(*args, **kwargs)
            finally:
                took = perf_counter() - begun
                self.seconds[phase] += took - self._inner.pop()
                self._inner[-1] += took

        return timed


@contextmanager
def watched() -> Iterator[Watches]:
    """Wrap the functions of all phases for as long as this lasts."""
    watches = Watches()
    with ExitStack() as stack:
        for phase, (_, names) in enumerate(PHASES):
            for name in names:
                owner, attribute, function = found(name)
                stack.enter_context(patch.object(owner, attribute, watches.around(phase, function)))
        yield watches


@dataclass(slots=True)
class SolverCounts:
    """What OSQP was asked to do.

    Attributes:
        matrix_updates: updates of numbers in P or A.
        late_matrix_updates: those of them after a measurement was inserted, within the feedback phase.
        refactorisations: by adaptive rho, one entry a feedback phase.
        iterations: one entry a feedback phase.
    """

    matrix_updates: int = 0
    late_matrix_updates: int = 0
    refactorisations: list[int] = field(default_factory=list)
    iterations: list[int] = field(default_factory=list)
    inside: bool = False

    def check(self) -> None:
        """Raise LookupError where nothing was counted: OSQP is called in another way."""
        if not (self.matrix_updates and self.iterations and sum(self.iterations)):
            raise LookupError(
                "OSQP was not seen at work: it is called in another way; see benchmarks/phases.py"
            )


@contextmanager
def counted() -> Iterator[SolverCounts]:
    """Count what OSQP does, in its extension and so however it is called, and within `FEEDBACK` apart."""
    counts = SolverCounts()
    update, solve = EXTENSION.update_data_mat, EXTENSION.solve
    owner, attribute, feedback = found(FEEDBACK)

    def updating(solver: Any, *args: Any, **kwargs: Any) -> Any:
        counts.matrix_updates += 1
        counts.late_matrix_updates += counts.inside
        return update(solver, *args, **kwargs)

    def solving(solver: Any, *args: Any, **kwargs: Any) -> Any:
        done = solve(solver, *args, **kwargs)
        if counts.inside:
            counts.refactorisations[-1] += int(solver.info.rho_updates)
            counts.iterations[-1] += int(solver.info.iter)
        return done

    def entering(*args: Any, **kwargs: Any) -> Any:
        counts.refactorisations.append(0)
        counts.iterations.append(0)
        counts.inside = True
        try:
            return feedback(*args, **kwargs)
        finally:
            counts.inside = False

    with (
        patch.object(EXTENSION, "update_data_mat", updating),
        patch.object(EXTENSION, "solve", solving),
        patch.object(owner, attribute, wraps(feedback)(entering)),
    ):
        yield counts
