"""Optimal control problems frozen out of runs, and the real-time iteration repeated on them.

A cycle's problem moves with every cycle: the horizon shifts, weights follow the plan, half-planes follow
the body. Here all of that stands still as it was in one cycle, so that repeated steps solve one nonlinear
program, which `nonlinear_program.py` writes down independently.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pytest

from geometry import Corridor, PathPart, PathReference, lift
from geometry.shape_grid import POINT
from rti_mpcc.config import ControllerConfig, SolverSettings
from rti_mpcc.controller import RtiMpcc
from rti_mpcc.course import context
from rti_mpcc.iteration import DAMPING, DAMPING_SHARE, Linearisation, Solution
from rti_mpcc.model.bicycle import linearised_step
from rti_mpcc.model.footprint import PIECES, body_of
from rti_mpcc.model.layout import DELTA, PHI, POSE, THETA, THETA_DOT, V, X, Y
from rti_mpcc.ocp.bounds import StageBounds, stage_bounds
from rti_mpcc.ocp.corridor_rows import NEAR, NO_ROWS, corridor_rows
from rti_mpcc.ocp.frenet import LocalFrame, frenet_errors, pose_in, reference_in, world_to_local
from rti_mpcc.ocp.horizon import PlanStages
from rti_mpcc.ocp.objectives import CONTOURING, ComfortWeights, StageWeights, Target
from rti_mpcc.ocp.side_clearance import OUTWARD
from rti_mpcc.ocp.stage_cost import FIXED_END, QuadraticCost, add_goal, end_time, quadratic_cost
from rti_mpcc.paper import PaperObjective
from rti_mpcc.paper.terms import SPEED_REACH, PaperWeights, SoftWalls, add_paper_terms, add_weight_slopes
from rti_mpcc.qp.filling import (
    IDLE_WEIGHT,
    ROW_SCALING_FROM,
    FillOptions,
    HorizonProblem,
    QpValues,
    empty_values,
    fill,
    fill_curvature,
    fill_initial,
)
from rti_mpcc.qp.pattern import BOUNDED, QpPattern, build_pattern
from rti_mpcc.qp.solver import QpSolution, QpSolver
from rti_mpcc.simulation import Scenario, changed, simulate
from rti_mpcc.types import Array, Complex
from tests.geometry.sides import Contacts, contacts_of

TIGHT = SolverSettings(tolerance=1e-7)
"""By which nearly all QPs are the interior point's."""

AT_REST = 1e-5
"""Steps below this have come to rest, in scaled units."""
NOISE = 1e-6
"""Steps below this say nothing about the contraction: tolerances move the soft directions so much."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FrozenPlanes:
    """Half-planes normal . (p + R(phi) o) >= offset that stay where they are, each for one point o of the
    body, p and phi being the vehicle's pose; those that do not act have normal 0."""

    normal: Array
    """(n, pieces, s, 2) unit, in the problem's frame."""
    offset: Array
    """(n, pieces, s) [m]."""
    point: Array
    """(n, pieces, s, 2) o, in the vehicle's frame [m]."""

    @classmethod
    def of(cls, contacts: Contacts, states: Array) -> FrozenPlanes:
        """From contacts at `states` (n, 6) in the problem's frame; those that are far away are dropped."""
        acts = np.isfinite(contacts.apart)
        turn = np.exp(1j * states[:, PHI])[:, None, None]
        normal = contacts.normal * turn * acts
        place = (states[:, X] + 1j * states[:, Y])[:, None, None] + contacts.at * turn
        offset = _dot(normal, place) - np.where(acts, contacts.apart, 0.0)
        return cls(normal=_pairs(normal), offset=offset, point=_pairs(contacts.at))

    def at(self, states: Array) -> Contacts:
        """What the package's functions take, for `states` (n, 6) in the problem's frame."""
        turn = np.exp(1j * states[:, PHI])[:, None, None]
        normal, point = (each[..., 0] + 1j * each[..., 1] for each in (self.normal, self.point))
        place = (states[:, X] + 1j * states[:, Y])[:, None, None] + point * turn
        apart = np.where(np.abs(normal) > 0.0, _dot(normal, place) - self.offset, np.inf)
        seen = normal / turn
        return Contacts(np.stack((apart, seen.real, seen.imag, point.real, point.imag), axis=-1))


def _dot(one: Complex, other: Complex) -> Array:
    return np.asarray(one.real * other.real + one.imag * other.imag)


def _pairs(points: Complex) -> Array:
    return np.stack((points.real, points.imag), axis=-1)


@dataclass(frozen=True, slots=True, kw_only=True)
class FrozenPath:
    """For each stage the piece of constant curvature that it was on, prolonged behind both ends.

    Where the curvature jumps the slopes of the Frenet errors jump with it, so the cost has a kink in
    theta there: which piece a stage is on is a switch, and frozen like the others.
    """

    begin: Array
    """(n,) theta of a point on the piece [m]."""
    pose: Array
    """(n, 3) x, y, phi there, in the problem's frame."""
    slope: Array
    """(n,) dphi/dtheta = d kappa [rad/m]."""
    direction: int

    @classmethod
    def of(cls, part: PathPart, theta: Array, frame: LocalFrame) -> FrozenPath:
        at = part.reference(theta)
        pose = world_to_local(frame, np.stack([at.x, at.y, at.phi], axis=-1))
        return cls(begin=theta.copy(), pose=pose, slope=at.slope, direction=part.direction)

    def reference(self, theta: Array) -> PathReference:
        """What the package's functions take, for theta (n,) [m]."""
        s = theta - self.begin
        half = 0.5 * self.slope * s
        chord = self.direction * s * np.sinc(half / np.pi)
        x, y, phi = self.pose.T
        return PathReference(
            x=x + chord * np.cos(phi + half),
            y=y + chord * np.sin(phi + half),
            phi=phi + 2.0 * half,
            slope=self.slope,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class FrozenProblem:
    """One optimal control problem in the coordinates of its frame.

    Attributes:
        name: which run and time it is from.
        states (N+1, 6), controls (N, 3): the plan that the cycle linearised about.
        measured: (6,) state at the horizon's begin.
        lengths: (N,) [s]; weights, bounds (widened as the measured state needs), planes of the body's pieces
            at stages 1..N, walls of the rear axle at stages 0..N: as they were in the cycle.
        nearing: (N+1,) what the cost gains by progress as the weights change with it [1/m]; `weights` itself
            does not change.
        path: the piece of each stage; damping: of the cycle's step; it moves no fixed point.
        solution: what the controller made of it in its one step.
    """

    name: str
    config: ControllerConfig
    part: PathPart
    target: Target
    path: FrozenPath
    frame: LocalFrame
    states: Array
    controls: Array
    measured: Array
    lengths: Array
    weights: StageWeights
    nearing: Array
    bounds: StageBounds
    planes: FrozenPlanes | None
    walls: FrozenPlanes | None
    damping: float
    solution: Solution

    def build_pattern(self) -> QpPattern:
        pieces, sides = (0, 0) if self.planes is None else self.planes.offset.shape[1:]
        return build_pattern(len(self.lengths), pieces, sides, free_end=self.weights.time > 0.0)

    def fill(self, values: QpValues, pattern: QpPattern, states: Array, controls: Array, dual: Array) -> None:
        """The QP about states (N+1, 6), controls (N, 3) and multipliers (m,), as the package fills it."""
        config, wheelbase = self.config, self.config.vehicle.wheelbase
        reference = self.path.reference(states[:, THETA])
        goal = pose_in(self.frame, self.target.pose)
        cost = modelled(states, controls, self.weights, self.part, reference, self.walls, goal, config)
        cost.state_gradient[:, THETA] += self.nearing
        step, rows = linearised_step(states, controls, self.lengths, wheelbase), None
        if self.planes is not None:
            planes, margin = self.planes.at(states[1:]), config.clearance.wanted
            rows = corridor_rows(states[1:, PHI].copy(), planes.values, margin, near=1e12)
        stages, end = PlanStages(states, controls, self.lengths), FIXED_END
        if self.weights.time > 0.0:
            end = end_time(stages, step.state, self.weights, config.comfort, wheelbase, latest=np.inf)
        problem = HorizonProblem(stages, cost, step, self.bounds, rows or NO_ROWS, end)
        of_cost = self.weights.slack, self.weights.scale
        fill(values, pattern, problem, FillOptions(*of_cost, self.damping, IDLE_WEIGHT, ROW_SCALING_FROM))
        back = states[:-1, :PHI] - step.state[:, :PHI]
        fill_curvature(values.cost, pattern.hessians, pattern.dynamics_rows, back, dual, 1.0)
        fill_initial(values, pattern, self.measured - states[0])

    def stretched(self, change: float) -> FrozenProblem:
        """The problem whose plans end later by so much [s]: all stages but the first are longer, and count as
        much more."""
        factor = np.full(len(self.lengths) + 1, 1.0 + change / float(self.lengths[1:].sum()))
        factor[0] = 1.0
        weights, beyond = self.weights, self.weights.comfort
        weights = replace(
            weights,
            acceleration=weights.acceleration * factor[:-1],
            steering_rate=weights.steering_rate * factor[:-1],
            comfort=ComfortWeights(
                beyond.acceleration * factor[:-1],
                beyond.lateral_acceleration * factor,
                beyond.steering_rate * factor[:-1],
            ),
        )
        return replace(self, lengths=self.lengths * factor[:-1], weights=weights)


@dataclass(frozen=True, slots=True, kw_only=True)
class Iterates:
    """What repeated steps came to: the last iterate, and the size of each step in scaled units."""

    states: Array
    controls: Array
    slack: Array
    lengths: Array
    steps: tuple[float, ...]

    @property
    def converged_after(self) -> int | None:
        """Steps until they had come to rest; None if they had not."""
        small = np.array(self.steps) < AT_REST
        if not small[-1]:
            return None
        large = np.flatnonzero(~small)
        return int(large[-1]) + 2 if len(large) else 1

    @property
    def contraction(self) -> float:
        """Geometric mean ratio of a step to the one before, over the steps above the solver's noise."""
        steps = np.array([size for size in self.steps if size > NOISE])
        return float((steps[-1] / steps[0]) ** (1.0 / (len(steps) - 1))) if len(steps) > 1 else 0.0


def iterate(problem: FrozenProblem, *, most: int = 200, settings: SolverSettings = TIGHT) -> Iterates:
    """Repeat full real-time-iteration steps about the last iterate until they come to rest; what a first
    guess is damped by fades, as it does from cycle to cycle."""
    pattern = problem.build_pattern()
    values, solver = empty_values(pattern), QpSolver(pattern, settings)
    states, controls = problem.states, problem.controls
    dual, primal = (np.zeros(count) for count in pattern.shape)
    steps: list[float] = []
    damping = problem.damping
    for _ in range(most):
        replace(problem, damping=damping).fill(values, pattern, states, controls, dual)
        damping = max(DAMPING_SHARE * damping, min(DAMPING, problem.damping))
        refused = solver.update(values)
        assert refused == "", refused
        result = solver.solve(values, primal, dual)
        assert result.solved, f"{problem.name}, step {len(steps)}: {result.status}"
        dual, primal = result.dual, np.zeros_like(primal)
        primal[pattern.slack_columns] = result.primal[pattern.slack_columns]
        change = result.primal * pattern.column_units
        states = states + change[pattern.state_columns]
        controls = controls + change[pattern.control_columns]
        if problem.weights.time > 0.0:
            before, problem = problem.lengths, problem.stretched(float(change[pattern.time_column[0]]))
            controls[:, THETA_DOT] *= before / problem.lengths
        steps.append(_size(result, pattern, problem))
        if len(steps) >= 3 and max(steps[-2:]) < AT_REST:
            break
    return Iterates(
        states=states,
        controls=controls,
        slack=np.maximum(change[pattern.slack_columns], 0.0),
        lengths=problem.lengths,
        steps=tuple(steps),
    )


def _size(result: QpSolution, pattern: QpPattern, problem: FrozenProblem) -> float:
    """Largest change, scaled, of states, controls and T; of progress only where a Frenet cost holds it."""
    states = np.abs(result.primal[pattern.state_columns])
    controls = np.abs(result.primal[pattern.control_columns])
    states[:, THETA] *= problem.weights.lag > 0.0
    controls[:, 2] *= problem.weights.lag[1:] > 0.0
    end = np.abs(result.primal[pattern.time_column]).max(initial=0.0)
    return float(max(states.max(), controls.max(), end))


@dataclass(kw_only=True)
class Taker:
    """Takes the problems of chosen times out of a run: the first cycle that begins at or after each."""

    name: str
    times: list[float]
    taken: list[FrozenProblem] = field(default_factory=list)

    def due(self, at: float) -> bool:
        return bool(self.times) and at >= self.times[0] - 1e-9

    def core(self) -> type[RtiMpcc]:
        """An RtiMpcc that hands its problems to this taker."""
        taker = self

        class Recorded(RtiMpcc):
            def __init__(
                self, part: PathPart, corridor: Corridor, config: ControllerConfig, **index: Any
            ) -> None:
                # With the published code's slopes the iteration has no optimum of the cost to come to.
                if isinstance(config.objective, PaperObjective):
                    config = config.changed(objective={"reference_turns": True})
                super().__init__(part, corridor, config, **index)
                self.corridor = corridor

            def set_obstacles(self, corridor: Corridor) -> None:
                super().set_obstacles(corridor)
                self.corridor = corridor

            def prepare(self, at: float, **options: Any) -> Linearisation:
                self.options = options
                self.linear = super().prepare(at, **options)
                return self.linear

            def feedback(self, state: Array, at: float, **options: Any) -> Solution:
                solution = super().feedback(state, at, **options)
                if taker.due(at):
                    taker.times.pop(0)
                    name = f"{taker.name} at {at:.2f} s"
                    taker.taken.append(
                        _freeze(self, self.linear, self.corridor, self.options, state, solution, name)
                    )
                return solution

        return Recorded


def take(
    scenario: Scenario, preset: str, times: Sequence[float], monkeypatch: pytest.MonkeyPatch, **options: Any
) -> list[FrozenProblem]:
    """Problems of a run at `times` [s] (begin of the horizon), ascending."""
    taker = Taker(name=f"{scenario.name} ({preset})", times=sorted(times))
    short = changed(scenario, {"simulation.duration": max(times) + 0.2})
    with monkeypatch.context() as patch:
        patch.setattr(context, "RtiMpcc", taker.core())
        simulate(short, preset=preset, **options)
    return taker.taken


def _freeze(
    mpcc: RtiMpcc,
    linear: Linearisation,
    corridor: Corridor,
    options: dict[str, Any],
    state: Array,
    solution: Solution,
    name: str,
) -> FrozenProblem:
    config, frame, target = mpcc.config, linear.frame, mpcc.target
    measured = world_to_local(frame, state[None])[0]
    measured[PHI] = lift(float(measured[PHI]), float(linear.stages.states[0, PHI]))
    measured[THETA] = min(measured[THETA], target.farthest)
    theta = linear.stages.states[:, THETA]
    bounds = stage_bounds(config, mpcc.part.direction, target.farthest)
    objective = config.objective.on_horizon(options.get("objective", CONTOURING))
    objective.bound(bounds, target, theta, mpcc.part.direction, config)
    planes, walls = None, None
    world = linear.trajectory.states
    if linear.rows is not None:
        body, within = body_of(config.vehicle, PIECES), config.clearance.wanted + NEAR
        near = contacts_of(corridor, mpcc.index, body, world[1:, :POSE], within, OUTWARD)
        planes = FrozenPlanes.of(near, linear.stages.states[1:])
    weights = linear.weights
    if isinstance(weights, PaperWeights) and weights.bound_distance.any():
        near = contacts_of(corridor, mpcc.index, POINT, world[:, :POSE], SPEED_REACH)
        walls = FrozenPlanes.of(near, linear.stages.states)
    return FrozenProblem(
        name=name,
        config=config,
        part=mpcc.part,
        path=FrozenPath.of(mpcc.part, theta, frame),
        target=target,
        frame=frame,
        states=linear.stages.states,
        controls=linear.trajectory.controls,
        measured=measured,
        lengths=linear.stages.lengths,
        weights=_unchanging(weights),
        nearing=_nearing(mpcc, linear, walls),
        bounds=_widened(bounds, measured, linear.stages.lengths, config),
        planes=planes,
        walls=walls,
        damping=options.get("damping", 0.0),
        solution=solution,
    )


def modelled(
    states: Array,
    controls: Array,
    weights: StageWeights,
    part: PathPart,
    reference: PathReference,
    walls: FrozenPlanes | None,
    goal: Array,
    config: ControllerConfig,
) -> QuadraticCost:
    """The model of the cost about states (N+1, 6), controls (N, 3), as the package makes it."""
    errors, wheelbase = frenet_errors(states, reference, part.direction), config.vehicle.wheelbase
    cost = quadratic_cost(states, controls, weights, errors, config.comfort, wheelbase)
    if isinstance(weights, PaperWeights):
        near = soft_walls(walls, states)
        add_paper_terms(states, weights, near, wheelbase, cost.state_hessian, cost.state_gradient)
        add_weight_slopes(errors, controls, near, weights, cost.state_gradient)
    add_goal(cost, weights, states[-1], goal)
    return cost


def soft_walls(walls: FrozenPlanes | None, states: Array) -> SoftWalls:
    """The half-planes of the rear axle at `states` (n, 6) as the cost takes them."""
    if walls is None:
        return SoftWalls(np.full((len(states), 2), np.inf), np.zeros((len(states), 2, 2)))
    distance = np.ascontiguousarray(walls.at(states).apart[:, 0, :2])
    return SoftWalls(distance=distance, normal=np.ascontiguousarray(walls.normal[:, 0, :2]))


def _unchanging(weights: StageWeights) -> StageWeights:
    return replace(weights, by_progress=None) if isinstance(weights, PaperWeights) else weights


def _nearing(mpcc: RtiMpcc, linear: Linearisation, walls: FrozenPlanes | None) -> Array:
    """The gradient of the cycle's cost in theta, less that of weights that do not change."""
    states, controls = linear.stages.states, linear.trajectory.controls
    reference = reference_in(linear.frame, mpcc.part.reference(states[:, THETA]))
    goal = pose_in(linear.frame, mpcc.target.pose)
    whole, same = (
        modelled(states, controls, weights, mpcc.part, reference, walls, goal, mpcc.config)
        for weights in (linear.weights, _unchanging(linear.weights))
    )
    gained: Array = (whole.state_gradient - same.state_gradient)[:, THETA]
    return gained


def _widened(bounds: StageBounds, measured: Array, lengths: Array, config: ControllerConfig) -> StageBounds:
    """Bounds on v and delta as far out as a measured state outside them needs to come back."""
    states, elapsed = bounds.states.copy(), np.cumsum(lengths)
    for quantity, rate in ((V, config.comfort_acceleration), (DELTA, config.comfort_steering_rate)):
        column = int(np.flatnonzero(quantity == BOUNDED)[0])
        back = rate * elapsed
        states[:, 0, column] = np.minimum(states[:, 0, column], measured[quantity] + back)
        states[:, 1, column] = np.maximum(states[:, 1, column], measured[quantity] - back)
    return bounds._replace(states=states)
