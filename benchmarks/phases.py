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
from pkgutil import resolve_name
from time import perf_counter
from typing import Any
from unittest.mock import patch

import osqp

from rti_mpcc.controller import RtiMpcc

PHASES: dict[str, tuple[str, ...]] = {
    "measurement": ("rti_mpcc.world.perception.validate_measurement",),
    "projection": ("geometry.part.PathPart.project",),
    "context, arrival time": ("rti_mpcc.course.context.Workspace.context",),
    "shift of the last plan": ("rti_mpcc.controller.shift",),
    "path, weights and cost": (
        "geometry.part.PathPart.reference",
        "rti_mpcc.ocp.objectives.Contouring.weights",
        "rti_mpcc.ocp.objectives.ArrivalAtRest.weights",
        "rti_mpcc.controller.frenet_errors",
        "rti_mpcc.controller.quadratic_cost",
        "rti_mpcc.controller.add_goal",
        "rti_mpcc.controller.stage_bounds",
    ),
    "linearisation": ("rti_mpcc.controller.linearised_step",),
    "corridor": ("rti_mpcc.controller.stage_contacts", "rti_mpcc.controller.corridor_rows"),
    "filling": (
        "rti_mpcc.controller.fill",
        "rti_mpcc.controller.fill_curvature",
        "rti_mpcc.controller.fill_initial",
    ),
    "OSQP update": ("rti_mpcc.qp.solver.QpSolver.update",),
    "prepare, rest": ("rti_mpcc.controller.RtiMpcc.prepare",),
    "QP solve": ("rti_mpcc.qp.solver.QpSolver.solve",),
    "extraction": ("rti_mpcc.controller.RtiMpcc._read",),
    "feedback, rest": ("rti_mpcc.controller.RtiMpcc.feedback",),
    "check of the plan": ("rti_mpcc.drive.search.rejection_reason",),
    "check of the body": (
        "rti_mpcc.course.collision_check.distance_to_contact",
        "rti_mpcc.course.collision_check.overlap",
    ),
    "command": ("rti_mpcc.docking.command",),
    "the rest of the cycle": ("rti_mpcc.docking.DockingController.step",),
}
"""Phases in the order of a cycle, and the functions that they consist of, by the names by which their callers
look them up. Where a function moves or gets another name, this is the place to say so."""
EXTENSION: Any = osqp.OSQP().ext.OSQPSolver
"""What all of OSQP goes through, whichever way it is called."""


@dataclass(slots=True)
class Watches:
    """Exclusive seconds of each phase since `read` was called last."""

    seconds: dict[str, float] = field(default_factory=lambda: dict.fromkeys(PHASES, 0.0))
    _inner: list[float] = field(default_factory=lambda: [0.0])

    def read(self) -> dict[str, float]:
        """Seconds of each phase in the order of `PHASES`, and begin again from 0."""
        seconds, self.seconds = self.seconds, dict.fromkeys(self.seconds, 0.0)
        return seconds

    def around(self, phase: str, function: Callable[..., Any]) -> Callable[..., Any]:
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
    """Wrap the functions of all phases for as long as this lasts. Raises AttributeError where one is gone."""
    watches = Watches()
    with ExitStack() as stack:
        for phase, names in PHASES.items():
            for name in names:
                stack.enter_context(patch(name, watches.around(phase, resolve_name(name))))
        yield watches


@dataclass(slots=True)
class SolverCounts:
    """What OSQP was asked to do.

    Attributes:
        matrix_updates: updates of numbers in P or A.
        late_matrix_updates: those of them after a measurement was inserted, within the feedback phase.
        feedback_phases: how many; iterations: of all of them, of OSQP.
        interior_points: QPs that OSQP had not finished.
    """

    matrix_updates: int = 0
    late_matrix_updates: int = 0
    feedback_phases: int = 0
    iterations: int = 0
    interior_points: int = 0
    inside: bool = False

    def check(self) -> None:
        """Raise LookupError where nothing was counted: OSQP is called in another way."""
        if not (self.matrix_updates and self.iterations):
            raise LookupError(
                "OSQP was not seen at work: it is called in another way; see benchmarks/phases.py"
            )


@contextmanager
def counted() -> Iterator[SolverCounts]:
    """Count what OSQP does, in its extension and so however it is called."""
    counts = SolverCounts()
    update, solve, feedback = EXTENSION.update_data_mat, EXTENSION.solve, RtiMpcc.feedback

    def updating(solver: Any, *args: Any, **kwargs: Any) -> Any:
        counts.matrix_updates += 1
        counts.late_matrix_updates += counts.inside
        return update(solver, *args, **kwargs)

    def solving(solver: Any, *args: Any, **kwargs: Any) -> Any:
        done = solve(solver, *args, **kwargs)
        if counts.inside:
            counts.iterations += int(solver.info.iter)
        return done

    @wraps(feedback)
    def entering(*args: Any, **kwargs: Any) -> Any:
        counts.feedback_phases += 1
        counts.inside = True
        try:
            solution = feedback(*args, **kwargs)
        finally:
            counts.inside = False
        counts.interior_points += solution.interior_point
        return solution

    with (
        patch.object(EXTENSION, "update_data_mat", updating),
        patch.object(EXTENSION, "solve", solving),
        patch.object(RtiMpcc, "feedback", entering),
    ):
        yield counts
