"""The accuracy ledger: what the shipped solver settings lose against a solution to 1e-9.

Every QP of the workload that was accepted is solved again by PIQP to 1e-9, an interior-point method that has
nothing in common with OSQP, and by OSQP itself to 1e-9 with polishing: a sample, and what was PIQP's already.
Every scenario is driven in closed loop with tight settings beside the shipped ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from itertools import chain
from math import nan
from typing import Any
from unittest.mock import patch

import numpy as np
import osqp
import pandas as pd
import piqp
from scipy import sparse

from benchmarks.figures import relative_change
from benchmarks.workload import Drive, feed
from benchmarks.yardstick import Problem, quiet, set_up
from rti_mpcc.config import SolverSettings
from rti_mpcc.controller import RtiMpcc
from rti_mpcc.qp.pattern import CONTROL_UNITS
from rti_mpcc.qp.problem import QpProblem
from rti_mpcc.qp.solver import QpSolver
from rti_mpcc.simulation import load_scenario, simulate, summary
from rti_mpcc.simulation.closed_loop import controller_of
from rti_mpcc.types import Array, Index

REFERENCE = 1e-9
SAMPLED = 100
"""Every so many QPs is solved by OSQP to 1e-9 as well."""
FINAL_APPROACH = 5.0
"""An arrival is called final approach from so much time to go on [s]."""
TIGHT = SolverSettings(tolerance=1e-7)
KINDS = ("cruise", "arrival", "final approach", "not the last of its cycle")
"""Of QPs: by the objective of their cycle. Only the control of a cycle's last QP is driven."""


def entries_of(drive: Drive) -> list[dict[str, Any]]:
    """The ledger of one drive, fed to a fresh controller: `judged`, and the kind, of each accepted QP.

    QPs are judged once the cycle is over. Not before: what is raised within a cycle the controller takes for
    its own mistake, and brakes.
    """
    entries: list[dict[str, Any]] = []
    results: list[Any] = []
    fresh: list[tuple[QpProblem, Index, Any]] = []
    solve, feedback = QpSolver.solve, RtiMpcc.feedback

    def solving(*args: Any, **kwargs: Any) -> Any:
        results.append(solve(*args, **kwargs))
        return results[-1]

    def feeding(core: RtiMpcc, *args: Any, **kwargs: Any) -> Any:
        solution = feedback(core, *args, **kwargs)
        if solution.solved:
            fresh.append((core.problem(), core._pattern.control_columns[0, :2], results[-1]))
        return solution

    with patch.object(QpSolver, "solve", solving), patch.object(RtiMpcc, "feedback", feeding), quiet():
        for _, command, _ in feed(drive, drive.controller()):
            for left, one in enumerate(fresh, start=1 - len(fresh)):
                kind = KINDS[-1] if left else kind_of(command.diagnostics.time_to_go)
                entries.append({"kind": kind, **judged(*one, sampled=len(entries) % SAMPLED == 0)})
            results.clear()
            fresh.clear()
    return entries


def judged(problem: QpProblem, first: Index, result: Any, *, sampled: bool) -> dict[str, float]:
    """One QP against its reference; `sampled`: and that against another. `first`: columns of its control.

    acceleration, steering_rate: error of the first control [m/s²], [rad/s]. cost: error over its scale, the
    larger of 1 and the cost itself. iterations: of the solvers. spread: between the references of PIQP and
    OSQP, the largest of [m/s²], [rad/s]. nan: there is no reference, or no second one.
    """
    whole = Problem.of(problem.cost, problem.gradient, problem.constraints, problem.lower, problem.upper)
    by_piqp = solved_by_piqp(whole)
    by_osqp = solved_by_osqp(whole) if sampled or result.interior_point or by_piqp is None else None
    reference = by_osqp if by_piqp is None else by_piqp
    row = {"acceleration": nan, "steering_rate": nan, "cost": nan, "spread": nan}
    if reference is not None:
        units = CONTROL_UNITS[:2]
        error = np.abs(result.primal - reference)[first] * units
        row["acceleration"], row["steering_rate"] = error.tolist()
        best, reached = _cost(problem, reference), _cost(problem, result.primal)
        row["cost"] = abs(reached - best) / max(1.0, abs(best))
        if by_osqp is not None and by_piqp is not None:
            row["spread"] = float((np.abs(by_osqp - by_piqp)[first] * units).max())
    return {**row, "iterations": int(result.iterations)}


def kind_of(time_to_go: float | None) -> str:
    """The kind by the planned time to the arrival [s], None while contouring."""
    if time_to_go is None:
        return "cruise"
    return "arrival" if time_to_go > FINAL_APPROACH else "final approach"


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


def ledger(drives: Sequence[Drive], *, workers: int) -> pd.DataFrame:
    """The ledgers of drives, in processes of their own: none of it is timed."""
    with ProcessPoolExecutor(workers) as pool:
        return pd.DataFrame(chain.from_iterable(pool.map(entries_of, drives)))


# -- closed loop ------------------------------------------------------------------------------------


def driven(name: str, tight: bool) -> dict[str, Any]:
    """`summary` of a scenario with the shipped settings of the solver or with tight ones."""
    scenario = load_scenario(name)
    detections = scenario.goal.measurement is not None
    config = scenario.controller_config("default", method="dynamic", detections=detections)
    controller = controller_of(scenario, config.changed(solver=TIGHT)) if tight else None
    return summary(simulate(scenario, controller=controller))


def closed_loop(names: Sequence[str], *, workers: int) -> list[dict[str, Any]]:
    """T [s] and clearance [m] of each run with shipped and tight settings, and how far they are apart."""
    with ProcessPoolExecutor(workers) as pool:
        shipped, tight = (pool.map(driven, names, [each] * len(names)) for each in (False, True))
        return list(map(compared, shipped, tight))


def compared(shipped: dict[str, Any], tight: dict[str, Any]) -> dict[str, Any]:
    """One run's figures with both settings; a clearance of None is one of nothing near."""
    time, clearance = "time_to_tolerance_s", "min_clearance_m"
    apart = 0.0
    if shipped[clearance] is not None and tight[clearance] is not None:
        apart = abs(shipped[clearance] - tight[clearance])
    return {
        "scenario": shipped["scenario"],
        **{name: {"shipped": shipped[name], "tight": tight[name]} for name in ("docked", time, clearance)},
        "time_apart": relative_change(shipped[time], tight[time]),
        "clearance_apart_m": apart,
    }
