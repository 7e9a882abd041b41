"""The accuracy ledger: what the shipped solver settings lose against a solution to 1e-9.

Every QP of the workload that was accepted is solved again by PIQP to 1e-9, an interior-point method that has
nothing in common with OSQP, and on a sample by OSQP itself to 1e-9 with polishing. And every scenario is
driven in closed loop with tight settings beside the shipped ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from typing import Any
from unittest.mock import patch

import numpy as np
import osqp
import piqp
from scipy import sparse

from benchmarks.figures import relative_change
from benchmarks.phases import found
from benchmarks.workload import Drive, feed
from benchmarks.yardstick import Problem, quiet, set_up
from rti_mpcc.config import ControllerConfig, SolverSettings
from rti_mpcc.controller import RtiMpcc
from rti_mpcc.docking import DockingController
from rti_mpcc.model.footprint import PIECES, body_of
from rti_mpcc.qp.pattern import CONTROL_UNITS, build_pattern
from rti_mpcc.qp.problem import QpProblem
from rti_mpcc.simulation import load_scenario, simulate, summary
from rti_mpcc.types import Array, Command, Index

REFERENCE = 1e-9
SAMPLED = 100
"""Every so many QPs is solved by OSQP to 1e-9 as well."""
FINAL_APPROACH = 5.0
"""An arrival is called final approach from so much time to go on [s]."""
TIGHT = SolverSettings(tolerance=1e-7, max_iterations=20_000)
SOLVE = "rti_mpcc.qp.solver:QpSolver.solve"
FEEDBACK = "rti_mpcc.controller:RtiMpcc.feedback"
KINDS = ("cruise", "arrival", "final approach", "not the last of its cycle")
"""Of QPs: by the objective of their cycle. Only the control of a cycle's last QP is driven."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """One accepted QP.

    Attributes:
        kind: index in `KINDS`.
        acceleration, steering_rate: error of the first control [m/s²], [rad/s]; nan: there is no reference.
        cost: error of the cost over its scale, which is the larger of 1 and the cost itself.
        iterations: of OSQP.
        spread: between the references of PIQP and OSQP, the largest of [m/s²], [rad/s]; nan: not sampled.
    """

    kind: int
    acceleration: float
    steering_rate: float
    cost: float
    iterations: int
    spread: float


def entries_of(drive: Drive) -> list[Entry]:
    """The ledger of one drive, fed to a fresh controller."""
    ledger = _Ledger()
    solve, feedback = found(SOLVE), found(FEEDBACK)

    def solving(*args: Any, **kwargs: Any) -> Any:
        ledger.result = solve[2](*args, **kwargs)
        return ledger.result

    def feeding(core: RtiMpcc, *args: Any, **kwargs: Any) -> Any:
        solution = feedback[2](core, *args, **kwargs)
        if solution.solved:
            ledger.take(core.problem(), core.config, ledger.result)
        return solution

    with patch.object(solve[0], solve[1], solving), patch.object(feedback[0], feedback[1], feeding), quiet():
        feed(drive, ledger.label)
    return ledger.entries


class _Ledger:
    """Takes QPs as they are solved; they are judged, and their kind is known, once the cycle is over.

    Not before: what is raised within a cycle the controller takes for its own mistake, and brakes.
    """

    def __init__(self) -> None:
        self.entries: list[Entry] = []
        self.result: Any = None
        self._fresh: list[tuple[QpProblem, ControllerConfig, Any]] = []

    def take(self, problem: QpProblem, config: ControllerConfig, result: Any) -> None:
        """Keep one of the cycle's accepted QPs, and its solution."""
        self._fresh.append((problem, config, result))

    def label(self, _: int, command: Command) -> None:
        """Judge the QPs of the cycle that this command ends."""
        kind = kind_of(command.diagnostics.time_to_go)
        for place, one in enumerate(self._fresh, start=1):
            last = place == len(self._fresh)
            sampled = len(self.entries) % SAMPLED == 0
            self.entries.append(judged(*one, kind=kind if last else len(KINDS) - 1, sampled=sampled))
        self._fresh = []


def judged(problem: QpProblem, config: ControllerConfig, result: Any, *, kind: int, sampled: bool) -> Entry:
    """One QP against its reference; `sampled`: and that against another one."""
    whole = Problem.of(problem.cost, problem.gradient, problem.constraints, problem.lower, problem.upper)
    first, nan = _first_control(problem, config), float("nan")
    reference = solved_by_piqp(whole)
    by_piqp = reference is not None
    other = solved_by_osqp(whole) if sampled or not by_piqp else None
    if reference is None:
        reference = other
    if reference is None:
        return Entry(
            kind=kind, acceleration=nan, steering_rate=nan, cost=nan, iterations=result.iterations, spread=nan
        )
    error = np.abs(result.primal - reference)[first] * CONTROL_UNITS[:2]
    best, reached = _cost(problem, reference), _cost(problem, result.primal)
    spread = nan
    if by_piqp and other is not None:
        spread = float((np.abs(other - reference)[first] * CONTROL_UNITS[:2]).max())
    return Entry(
        kind=kind,
        acceleration=float(error[0]),
        steering_rate=float(error[1]),
        cost=abs(reached - best) / max(1.0, abs(best)),
        iterations=int(result.iterations),
        spread=spread,
    )


def kind_of(time_to_go: float | None) -> int:
    """Index in `KINDS` by the planned time to the arrival [s], None while contouring."""
    if time_to_go is None:
        return 0
    return 1 if time_to_go > FINAL_APPROACH else 2


def _first_control(problem: QpProblem, config: ControllerConfig) -> Index:
    """Columns of a and delta_dot of the first stage. Raises LookupError if the QP has another pattern."""
    pieces = body_of(config.vehicle, PIECES).pieces
    for sides in (2, 3):
        pattern = build_pattern(config.stages, pieces, sides)
        if pattern.shape == problem.constraints.shape:
            columns: Index = pattern.control_columns[0, :2]
            return columns
    raise LookupError(f"no pattern of {config.stages} stages has shape {problem.constraints.shape}")


def _cost(problem: QpProblem, primal: Array) -> float:
    upper = problem.cost
    curved = 2.0 * primal @ (upper @ primal) - primal @ (upper.diagonal() * primal)
    return float(0.5 * curved + problem.gradient @ primal)


def solved_by_piqp(problem: Problem) -> Array | None:
    """The reference, None where it is not reached; here variables do not come stage by stage."""
    solver = set_up(problem, REFERENCE, piqp.KKTSolver.sparse_ldlt)
    status = solver.solve()
    return np.array(solver.result.x) if status == piqp.PIQP_SOLVED else None


def solved_by_osqp(problem: Problem) -> Array | None:
    """The same by OSQP to the same tolerance, None where it is not reached."""
    solver = osqp.OSQP()
    solver.setup(
        P=sparse.triu(problem.cost, format="csc"),
        q=problem.gradient,
        A=problem.constraints,
        l=problem.lower,
        u=problem.upper,
        eps_abs=REFERENCE,
        eps_rel=REFERENCE,
        max_iter=200_000,
        polishing=True,
        verbose=False,
    )
    result = solver.solve(raise_error=False)
    return np.array(result.x) if result.info.status_val == osqp.SolverStatus.OSQP_SOLVED else None


def ledger(drives: Sequence[Drive], *, workers: int) -> list[Entry]:
    """The ledgers of drives, in processes of their own: none of it is timed."""
    with ProcessPoolExecutor(workers) as pool:
        return [entry for entries in pool.map(entries_of, drives) for entry in entries]


# -- closed loop ------------------------------------------------------------------------------------


def driven(name: str, *, preset: str, tight: bool) -> dict[str, Any]:
    """`summary` of a scenario with the shipped settings of the solver or with tight ones."""
    scenario = load_scenario(name)
    if not tight:
        return summary(simulate(scenario, preset=preset))
    detections = scenario.goal.measurement is not None
    config = scenario.controller_config(preset, method="dynamic", detections=detections).changed(solver=TIGHT)
    path = scenario.build_path()
    controller = DockingController(path, scenario.build_corridor(path), config)
    return summary(simulate(scenario, preset=preset, controller=controller))


def closed_loop(names: Sequence[str], *, presets: Sequence[str], workers: int) -> list[dict[str, Any]]:
    """T [s] and clearance [m] of each run with shipped and tight settings, and how far they are apart."""
    runs = [(name, preset) for preset in presets for name in names]
    with ProcessPoolExecutor(workers) as pool:
        rows = [
            [pool.submit(driven, name, preset=preset, tight=tight) for tight in (False, True)]
            for name, preset in runs
        ]
        return [
            compared(name, preset, *(job.result() for job in row))
            for (name, preset), row in zip(runs, rows, strict=True)
        ]


def compared(name: str, preset: str, shipped: dict[str, Any], tight: dict[str, Any]) -> dict[str, Any]:
    """One run's figures with both settings; a clearance of None is one of nothing near."""
    time, clearance = "time_to_tolerance_s", "min_clearance_m"
    apart = 0.0
    if shipped[clearance] is not None and tight[clearance] is not None:
        apart = abs(shipped[clearance] - tight[clearance])
    return {
        "scenario": name,
        "preset": preset,
        "shipped": {key: shipped[key] for key in ("docked", time, "time_to_dock_s", clearance)},
        "tight": {key: tight[key] for key in ("docked", time, "time_to_dock_s", clearance)},
        "iterations_p50": {
            "shipped": shipped["solver"]["iterations_p50"],
            "tight": tight["solver"]["iterations_p50"],
        },
        "failures": {"shipped": shipped["solver"]["failures"], "tight": tight["solver"]["failures"]},
        "time_apart": relative_change(shipped[time], tight[time]),
        "clearance_apart_m": apart,
    }
