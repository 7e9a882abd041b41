"""What the two phases of a real-time iteration leave: `prepare` a linearisation, `feedback` a solution."""

from __future__ import annotations

from dataclasses import dataclass

from rti_mpcc.ocp.bounds import StageBounds
from rti_mpcc.ocp.corridor_rows import CorridorRows
from rti_mpcc.ocp.frenet import LocalFrame
from rti_mpcc.ocp.horizon import PlanStages
from rti_mpcc.ocp.objectives import StageWeights
from rti_mpcc.qp.solver import Stop
from rti_mpcc.types import Array, Trajectory

FIRST_DAMPING = 1e-2  # on the change, from a first guess on (docs/decisions/05-damping-and-curvature.md)
DAMPING = 1e-4  # from cycle to cycle, once it has come down to that
DAMPING_SHARE = 0.5  # of the last damping, until then


@dataclass(frozen=True, slots=True, kw_only=True)
class Linearisation:
    """The trajectory linearised about, and what acts on it: `prepare` leaves it for `feedback`.

    Attributes:
        trajectory: in the world; frame, stages: the same in local coordinates.
        damping: see `RtiMpcc.prepare`.
        rows: of the corridor at stages 1..N; drift: see `free_response`; both None where no row acts.
        refused: "" or why the solver refused the numbers; seconds: time that the preparation took.
    """

    trajectory: Trajectory
    frame: LocalFrame
    stages: PlanStages
    weights: StageWeights
    damping: float
    rows: CorridorRows | None
    drift: Array | None
    bounds: StageBounds
    refused: str
    seconds: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Solution:
    """What one real-time iteration gave.

    Attributes:
        solved: the QP was solved; otherwise `trajectory` is the one linearised about.
        trajectory: the plan in the world, headings on the route's branch.
        slack: (N,) corridor slack of stages 1..N [m]; most_slack: the largest one.
        damping: how little the iteration was trusted, see `RtiMpcc.prepare`.
        dual: multipliers in scaled units of rows that are not scaled down, the next QP's guess.
        status, iterations, interior_point, residuals, stopped: see `QpSolution`.
    """

    solved: bool
    trajectory: Trajectory
    slack: Array
    most_slack: float
    weights: StageWeights
    damping: float
    dual: Array
    status: str
    iterations: int
    interior_point: bool
    residuals: tuple[float, float]
    stopped: Stop | None
    prepare_seconds: float
    solve_seconds: float
    feedback_seconds: float
