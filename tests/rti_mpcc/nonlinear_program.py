"""A frozen problem as one nonlinear program in casadi, written from the equations alone, for IPOPT.

Nothing but numbers is taken from the package: the path by its arcs, the dynamics Eq. (M1) under
a textbook Runge-Kutta step, the cost Eq. (C1)-(C3) with Huber's goal term, half-planes Eq. (H1).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from rti_mpcc.model.layout import CONTROLS, DELTA, DELTA_DOT, PHI, STATES, THETA, THETA_DOT, A, V, X, Y
from rti_mpcc.ocp.frenet import pose_in
from rti_mpcc.ocp.stage_cost import LEAST_TIME
from rti_mpcc.paper.terms import PaperWeights
from rti_mpcc.qp.pattern import BOUNDED
from rti_mpcc.types import Array
from tests.rti_mpcc.frozen import FrozenPlanes, FrozenProblem

IPOPT: dict[str, Any] = {
    "print_level": 0,
    "sb": "yes",
    "tol": 1e-9,
    "constr_viol_tol": 1e-9,
    "dual_inf_tol": 1e-7,
    "compl_inf_tol": 1e-9,
    "acceptable_tol": 1e-8,
    "max_iter": 1000,
    "bound_relax_factor": 0.0,
    "mu_strategy": "adaptive",
}
NEARBY = {
    "mu_strategy": "monotone",
    "mu_init": 1e-7,
    "bound_push": 1e-9,
    "bound_frac": 1e-9,
    "slack_bound_push": 1e-9,
    "slack_bound_frac": 1e-9,
}
"""Options that keep IPOPT's first steps near its start."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Optimum:
    """Where IPOPT ended: cost in the units of the weights, states (N+1, 6), controls (N, 3), slack (N,), and
    `span`, how long the plan is [s]."""

    success: bool
    status: str
    iterations: int
    cost: float
    states: Array
    controls: Array
    slack: Array
    span: float


class NonlinearProgram:
    """Variables: states of stages 0..N, controls, slacks of stages 1..N, and how long the plan is, one after
    another. Where the problem has no price on time its end is fixed."""

    def __init__(self, problem: FrozenProblem) -> None:
        self._problem = problem
        stages = len(problem.lengths)
        z, u, s = ca.SX.sym("z", STATES, stages + 1), ca.SX.sym("u", CONTROLS, stages), ca.SX.sym("s", stages)
        span = ca.SX.sym("T")
        # All stages but the first are stretched alike.
        first, total = problem.lengths[0], problem.lengths.sum()
        stretch = ca.vertcat(1.0, ca.repmat((span - first) / (total - first), stages, 1))
        self._variables = ca.veccat(z, u, s, span)
        self._cost = _cost(problem, z, u, s, stretch) + problem.weights.time * span
        self._evaluate = ca.Function("cost", [self._variables], [self._cost])
        rows, self._rows_lower, self._rows_upper = _rows(problem, z, u, s, stretch)
        self._rows = rows
        self._lower, self._upper = _bounds(problem)

    def cost(self, states: Array, controls: Array, slack: Array, span: float | None = None) -> float:
        """J of a trajectory that lasts `span` [s] (None: as the problem's plan), in the units of weights."""
        return float(self._evaluate(_stacked(states, controls, slack, span or self._problem.lengths.sum())))

    def solve(
        self, states: Array, controls: Array, slack: Array, span: float | None = None, *, nearby: bool
    ) -> Optimum:
        """IPOPT from a start; `nearby` keeps its first steps small."""
        options: dict[str, Any] = {"print_time": False, "ipopt": {**IPOPT, **(NEARBY if nearby else {})}}
        program = {"x": self._variables, "f": self._problem.weights.scale * self._cost, "g": self._rows}
        solver = ca.nlpsol("solver", "ipopt", program, options)
        answer = solver(
            x0=_stacked(states, controls, slack, span or self._problem.lengths.sum()),
            lbx=self._lower,
            ubx=self._upper,
            lbg=self._rows_lower,
            ubg=self._rows_upper,
        )
        found = np.array(answer["x"]).ravel()
        stages = len(self._problem.lengths)
        split = np.cumsum([STATES * (stages + 1), CONTROLS * stages])
        z, u, s = np.split(found[:-1], split)
        return Optimum(
            success=bool(solver.stats()["success"]),
            status=str(solver.stats()["return_status"]),
            iterations=int(solver.stats()["iter_count"]),
            cost=float(answer["f"]) / self._problem.weights.scale,
            states=z.reshape(-1, STATES),
            controls=u.reshape(-1, CONTROLS),
            slack=s,
            span=float(found[-1]),
        )


def roll_out(problem: FrozenProblem, controls: Array) -> Array:
    """States (N+1, 6) from the measured state under controls (N, 3)."""
    z, u, h = ca.SX.sym("z", STATES), ca.SX.sym("u", CONTROLS), ca.SX.sym("h")
    step = ca.Function("step", [z, u, h], [_step(z, u, h, problem.config.vehicle.wheelbase)])
    states = [problem.measured]
    for control, length in zip(controls, problem.lengths, strict=True):
        states.append(np.array(step(states[-1], control, length)).ravel())
    return np.array(states)


def _stacked(states: Array, controls: Array, slack: Array, span: float) -> Array:
    return np.concatenate([states.ravel(), controls.ravel(), slack, [span]])


def _rates(z: Any, u: Any, wheelbase: float) -> Any:
    return ca.vertcat(
        z[V] * ca.cos(z[PHI]),
        z[V] * ca.sin(z[PHI]),
        z[V] * ca.tan(z[DELTA]) / wheelbase,
        u[A],
        u[DELTA_DOT],
        u[THETA_DOT],
    )


def _step(z: Any, u: Any, h: Any, wheelbase: float) -> Any:
    k_1 = _rates(z, u, wheelbase)
    k_2 = _rates(z + h / 2 * k_1, u, wheelbase)
    k_3 = _rates(z + h / 2 * k_2, u, wheelbase)
    k_4 = _rates(z + h * k_3, u, wheelbase)
    return z + h / 6 * (k_1 + 2 * k_2 + 2 * k_3 + k_4)


def _path_pose(problem: FrozenProblem, k: int, theta: Any) -> tuple[Any, Any, Any]:
    """Path pose at theta on the piece of stage k: dx/dtheta = d cos(phi), dphi/dtheta = slope, integrated."""
    path = problem.path
    x, y, phi = (float(number) for number in path.pose[k])
    d, slope, s = path.direction, float(path.slope[k]), theta - path.begin[k]
    if slope == 0.0:
        return x + d * s * np.cos(phi), y + d * s * np.sin(phi), phi
    turned = phi + slope * s
    return (
        x + d / slope * (ca.sin(turned) - np.sin(phi)),
        y - d / slope * (ca.cos(turned) - np.cos(phi)),
        turned,
    )


def _cost(problem: FrozenProblem, z: Any, u: Any, s: Any, stretch: Any) -> Any:
    """What is counted over time counts in proportion to the length of its stage."""
    w, stages, comfort = problem.weights, len(problem.lengths), problem.config.comfort
    total: Any = w.slack * ca.sum1(s)
    for k in range(stages + 1):
        total += problem.nearing[k] * (z[THETA, k] - problem.states[k, THETA])
        v, tangent = z[V, k], ca.tan(z[DELTA, k])
        lateral = v**2 * tangent / problem.config.vehicle.wheelbase
        on_lateral = stretch[k] * w.comfort.lateral_acceleration[k]
        total += on_lateral * _discomfort(lateral, comfort.lateral_acceleration)
        if isinstance(w, PaperWeights):
            total += w.lateral_acceleration[k] * lateral**2
            for normal, offset, _ in _acting(problem.walls, k, sides=2):
                distance = normal[0] * z[X, k] + normal[1] * z[Y, k] - offset
                total += w.bound_distance[k] * ca.fmax(2.0 - distance, 0) ** 2
                total += w.bound_speed[k] * (v * ca.fmax(2.5 - distance, 0)) ** 2
        if w.lag[k] or w.contouring[k] or w.heading[k]:
            x_r, y_r, phi_r = _path_pose(problem, k, z[THETA, k])
            dx, dy = z[X, k] - x_r, z[Y, k] - y_r
            total += w.lag[k] * (ca.cos(phi_r) * dx + ca.sin(phi_r) * dy) ** 2
            total += w.contouring[k] * (-ca.sin(phi_r) * dx + ca.cos(phi_r) * dy) ** 2
            total += w.heading[k] * (z[PHI, k] - phi_r) ** 2
    for k in range(stages):
        effort = w.acceleration[k] * u[A, k] ** 2 + w.steering_rate[k] * u[DELTA_DOT, k] ** 2
        effort += w.virtual_speed[k] * u[THETA_DOT, k] ** 2 - w.progress_reward[k] * u[THETA_DOT, k]
        effort += w.comfort.acceleration[k] * _discomfort(u[A, k], comfort.acceleration)
        effort += w.comfort.steering_rate[k] * _discomfort(u[DELTA_DOT, k], comfort.steering_rate)
        total += stretch[k] * effort
    return total + _goal_cost(problem, z[:, stages])


def _goal_cost(problem: FrozenProblem, last: Any) -> Any:
    w, goal = problem.weights, pose_in(problem.frame, problem.target.pose)
    dx, dy, dphi = last[X] - goal[X], last[Y] - goal[Y], last[PHI] - goal[PHI]
    speed, clip = w.goal_speed * last[V] ** 2, (0.5, 0.3)
    if not w.goal_clipped:
        return w.goal[0] * dx**2 + w.goal[1] * dy**2 + w.goal[2] * dphi**2 + speed
    assert w.goal[0] == w.goal[1], "Huber's cost of a distance needs one weight on x and y"
    return w.goal[0] * _huber(dx**2 + dy**2, clip[0]) + w.goal[2] * _huber(dphi**2, clip[1]) + speed


def _discomfort(value: Any, most: float) -> Any:
    """Square, beyond the clip linear, of max(0, |value| - most) rounded off by the logarithm."""
    ease = 0.05 * most
    beyond = (ca.fabs(value) - most) / ease
    return _huber((ease * (ca.fmax(beyond, 0) + ca.log1p(ca.exp(-ca.fabs(beyond))))) ** 2, 0.1)


def _huber(square: Any, clip: float) -> Any:
    """square below the clip, the tangent 2 clip |e| - clip² beyond it."""
    return ca.if_else(square <= clip**2, square, 2 * clip * ca.sqrt(ca.fmax(square, clip**2)) - clip**2)


def _acting(
    planes: FrozenPlanes | None, k: int, sides: int | None = None
) -> list[tuple[Array, float, Array]]:
    """Normal, offset and point of the body of the half-planes of the k-th stage that there are, of the first
    `sides` only: left, right, obstacles."""
    if planes is None:
        return []
    normals, points = (each[k, :, :sides].reshape(-1, 2) for each in (planes.normal, planes.point))
    every = zip(normals, planes.offset[k, :, :sides].reshape(-1), points, strict=True)
    return [(normal, float(offset), point) for normal, offset, point in every if normal.any()]


def _rows(problem: FrozenProblem, z: Any, u: Any, s: Any, stretch: Any) -> tuple[Any, Array, Array]:
    """Dynamics = 0, and acting half-planes with their slack >= 0."""
    config, stages = problem.config, len(problem.lengths)
    equal, above = [], []
    for k in range(stages):
        h = stretch[k] * problem.lengths[k]
        equal.append(z[:, k + 1] - _step(z[:, k], u[:, k], h, config.vehicle.wheelbase))
        c, sine = ca.cos(z[PHI, k + 1]), ca.sin(z[PHI, k + 1])
        for normal, offset, point in _acting(problem.planes, k):
            x = z[X, k + 1] + c * point[0] - sine * point[1]
            y = z[Y, k + 1] + sine * point[0] + c * point[1]
            above.append(normal[0] * x + normal[1] * y - offset - config.clearance.wanted + s[k])
    zeros = np.zeros(STATES * stages + len(above))
    upper = np.concatenate([np.zeros(STATES * stages), np.full(len(above), np.inf)])
    return ca.vertcat(*equal, *above), zeros, upper


def _bounds(problem: FrozenProblem) -> tuple[Array, Array]:
    stages, limits, span = len(problem.lengths), [], problem.lengths.sum()
    for side, infinite in ((0, -np.inf), (1, np.inf)):
        z = np.full((stages + 1, STATES), infinite)
        z[0] = problem.measured
        z[1:, BOUNDED] = problem.bounds.states[:, side]
        slack = np.full(stages, 0.0 if side == 0 else np.inf)
        ends = span if problem.weights.time == 0.0 else (LEAST_TIME, np.inf)[side]
        limits.append(_stacked(z, problem.bounds.controls[:, side], slack, ends))
    return limits[0], limits[1]
