"""RtiMpcc: the real-time iteration on one one-direction part of a route (paper Eq. 1, (R1))."""

from __future__ import annotations

from math import inf
from time import perf_counter

import numpy as np

from geometry import Corridor, InputError, PathPart, Pose2, wrap
from geometry.corridor import space_around
from geometry.validation import validated
from rti_mpcc.config import ControllerConfig
from rti_mpcc.config.mpc import CONTACT_TOLERANCE
from rti_mpcc.iteration import Linearisation, Solution
from rti_mpcc.model.actuators import UNDISTURBED, Disturbance
from rti_mpcc.model.bicycle import linearised_step
from rti_mpcc.model.footprint import PIECES, body_of
from rti_mpcc.model.layout import DELTA, PHI, POSE, THETA, THETA_DOT, V
from rti_mpcc.ocp.bounds import Change, stage_bounds
from rti_mpcc.ocp.corridor_rows import (
    MEASURED,
    NO_ROWS,
    CorridorRows,
    Deficit,
    Trailing,
    corridor_rows,
    free_response,
    margin_deficit,
    relaxed_bounds,
    stage_contacts,
)
from rti_mpcc.ocp.frenet import (
    LocalFrame,
    frenet_errors,
    local_to_world,
    pose_in,
    reference_in,
    world_to_local,
)
from rti_mpcc.ocp.horizon import Grid, PlanStages, distances, read_only, shift
from rti_mpcc.ocp.objectives import CONTOURING, HorizonObjective, Linearised, Target, goal_on, path_end
from rti_mpcc.ocp.side_clearance import SideClearance
from rti_mpcc.ocp.stage_cost import (
    FIXED_END,
    LEAST_TIME,
    add_goal,
    add_residual,
    end_time,
    quadratic_cost,
    stretched_times,
)
from rti_mpcc.qp.filling import (
    IDLE_WEIGHT,
    ROW_SCALING_FROM,
    FillOptions,
    HorizonProblem,
    empty_values,
    fill,
    fill_corridor_bounds,
    fill_curvature,
    fill_initial,
    fill_motion_bounds,
)
from rti_mpcc.qp.pattern import SLACK_UNIT, STATE_UNITS, build_pattern
from rti_mpcc.qp.problem import QpProblem, problem_of
from rti_mpcc.qp.solver import Ends, QpSolution, QpSolver
from rti_mpcc.types import Array, Objective, Trajectory


class RtiMpcc:
    """Real-time-iteration MPCC on one part of a route.

    `prepare` does all that needs no measurement: it shifts the last plan, linearises, fills and
    factorises the QP. `feedback` inserts the measured state and solves. Each pair is one Newton-type
    step of the optimal control problem, taken in full.

    Args:
        part: the one-direction part.
        corridor: its boundaries and obstacles.
        config: settings.
        index: of the part in its route, which is how the corridor knows it.
    """

    @validated()
    def __init__(
        self, part: PathPart, corridor: Corridor, config: ControllerConfig, *, index: int = 0
    ) -> None:
        self.part = part
        self.index = index
        self.config = config
        self._corridor, self._space = corridor, space_around(corridor, index)
        self._body = body_of(config.vehicle, PIECES)
        behind = config.vehicle.rear if part.direction > 0 else config.vehicle.front
        self._trails = Trailing(self._body.trailing(part.direction), behind)
        self._last: Solution | None = None
        self.side_clearance: SideClearance | None = None
        self.target = path_end(part)
        self._allocate()

    def _allocate(self) -> None:
        """Pattern, buffers and solver, with half-planes for obstacles if there are any."""
        config = self.config
        of_body = self._body.pieces, self._space.sides
        self._pattern = build_pattern(config.stages, *of_body, free_end=config.arrival)
        self._values = empty_values(self._pattern)
        self._solver = QpSolver(self._pattern, config.solver)
        self._solver.update(self._values)  # sets OSQP up, which need not wait for the first cycle
        self._linearisation: Linearisation | None = None
        self._guess = (np.zeros_like(self._values.gradient), np.zeros_like(self._values.lower))

    @validated()
    def set_goal(self, goal: Pose2 | None) -> None:
        """The pose to end in; None for the part's own end. Its heading may be on any branch."""
        self.target = path_end(self.part) if goal is None else goal_on(self.part, goal, self.target)

    @validated()
    def set_obstacles(self, corridor: Corridor) -> None:
        """The same boundaries with other obstacles. The first ones cost a new pattern, which then stays."""
        self._corridor, self._space = corridor, space_around(corridor, self.index)
        if self._space.sides > self._pattern.corridor_rows.shape[2]:
            self._allocate()

    @validated(late=True)
    def prepare(
        self,
        at: float,
        *,
        target: Target | None = None,
        last: Solution | None = None,
        plan: Trajectory | None = None,
        objective: HorizonObjective = CONTOURING,
        damping: float = 0.0,
        disturbance: Disturbance = UNDISTURBED,
        before: float | None = None,
        first: bool = True,
    ) -> Linearisation:
        """Preparation phase: everything about the QP that needs no measurement.

        Args:
            at: when the plan begins [s], that is when its first control begins to act.
            target: what it is to end in; None: the last one.
            last: the solution to continue from; default: this object's last one.
            plan: a trajectory to start afresh from, with nothing kept of the last solution.
            objective: what is asked for, if `DockingObjective.on_horizon` has nothing in its place.
            damping: how little one iteration is trusted, see `fill`; it moves no fixed point.
            disturbance: what acts beside the commands. States and controls are with it, see (O4).
            before: acceleration that acts until then [m/s²]; None: any.
            first: nothing is driven yet: without a `last` solution the wheels may turn as fast as they can,
                unless the end is free.
        """
        started = perf_counter()
        config, wheelbase = self.config, self.config.vehicle.wheelbase
        objective = config.objective.on_horizon(objective)
        self.target = target = target or self.target
        last = (last or self._last) if plan is None else None
        plan = last.trajectory if last is not None else plan
        if plan is None:
            raise InputError("plan = None: the first prepare needs a trajectory to linearise about")

        horizon = objective.horizon(at, config)
        if horizon is None:
            horizon = max(float(plan.times[-1]) - at, LEAST_TIME)
        grid = Grid(at, horizon, config.cycle, config.stages)
        times, moved, controls, lengths = shift(plan.times, plan.states, plan.controls, grid, wheelbase)
        shifted = Trajectory(times=times, states=moved, controls=controls)
        frame = LocalFrame(*moved[0, :POSE].tolist())
        states = world_to_local(frame, moved)
        stages = PlanStages(states, controls, lengths)
        theta = states[:, THETA].copy()

        weights = objective.weights(config, target, theta, lengths)
        errors = None
        if weights.follows_path:
            reference = reference_in(frame, objective.reference(self.part, theta, config))
            errors = frenet_errors(states, reference, self.part.direction)
        here = Linearised(
            shifted.states, states, controls, lengths, errors, weights, self._corridor, self.index, config
        )
        cost = quadratic_cost(states, controls, weights, errors, config.comfort, wheelbase)
        objective.add_terms(here, cost.state_hessian, cost.state_gradient)
        add_goal(cost, weights, states[-1], pose_in(frame, target.pose), target.wheels or 0.0)
        for term in config.objective.terms:
            add_residual(cost, term.residual(here))
        step = linearised_step(states, controls, lengths, wheelbase)
        along_path, change = objective.along_path, None
        if before is not None:
            # A plan whose end is free takes the time that the wheels need.
            at_first = first and weights.time == 0.0
            pressed = at_first if last is None else self._pressed(last, states[0])
            left = target.theta - float(theta[0]) if objective.kind is Objective.ARRIVAL else inf
            change = Change(before, stages, left, pressed)
        direction, most = (self.part.direction, self._speeds(shifted)) if along_path else (0, None)
        farthest = target.farthest if objective.ends else inf
        bounds = stage_bounds(config, direction, farthest, most, disturbance, change)
        objective.bound(bounds, target, theta, self.part.direction, config)

        values, pattern = self._values, self._pattern
        rows = self._rows(shifted, states) if along_path else None
        drift = None if rows is None else free_response(states, lengths, wheelbase)
        end = FIXED_END
        if weights.time > 0.0:
            latest = objective.latest - at
            end = end_time(stages, step.state, weights, config.comfort, wheelbase, latest)
        problem = HorizonProblem(stages, cost, step, bounds, rows or NO_ROWS, end)
        options = FillOptions(weights.slack, weights.scale, damping, IDLE_WEIGHT, ROW_SCALING_FROM)
        fill(values, pattern, problem, options)
        if last is not None and len(last.dual) == len(values.lower):
            grown, back = weights.scale / last.weights.scale, states[:-1, :PHI] - step.state[:, :PHI]
            fill_curvature(values.cost, pattern.hessians, pattern.dynamics_rows, back, last.dual, grown)
        self._last = last
        self._linearisation = Linearisation(
            trajectory=shifted,
            frame=frame,
            stages=stages,
            weights=weights,
            damping=damping,
            rows=rows,
            drift=drift,
            bounds=bounds,
            refused=self._solver.update(values),
            seconds=perf_counter() - started,
        )
        return self._linearisation

    @validated(late=True)
    def feedback(self, state: Array, at: float, *, ends: Ends | None = None) -> Solution:
        """Feedback phase: insert the state and solve.

        Args:
            state: (6,) x, y, phi, v, delta, theta measured for, or rolled forward to, `at`.
            at: as in the last `prepare`, which is done here if it was for another time [s].
            ends: see `QpSolver.solve`.
        """
        if self._linearisation is None or self._linearisation.trajectory.times[0] != at:
            self.prepare(at)
        started = perf_counter()
        linear = self._linearisation
        assert linear is not None
        measured = world_to_local(linear.frame, state[None])[0]
        measured[PHI] = wrap(float(measured[PHI]))  # the plan's heading is 0 there
        measured[THETA] = min(measured[THETA], self.target.farthest)
        change = measured - linear.stages.states[0]
        fill_initial(self._values, self._pattern, change)
        self._admit(measured, change, linear)
        self._guess = self._first_iterate(change)
        if linear.refused:
            result = QpSolution.none(self._pattern, linear.refused)
        else:
            result = self._solver.solve(self._values, *self._guess, ends)
        solution = self._read(linear, result, started)
        if solution.solved:
            self._last = solution
        return solution

    def problem(self) -> QpProblem:
        """The QP as it is now, after `feedback` the one that was solved last: for study off line."""
        return problem_of(self._pattern, self._values, *self._guess)

    def _speeds(self, plan: Trajectory) -> Array | None:
        """Speeds (N,) that the room allows at stages 1..N [m/s]."""
        if self.side_clearance is None:
            return None
        elapsed, speed = plan.times[1:] - plan.times[0], abs(float(plan.states[0, V]))
        return self.side_clearance.bounds(plan.states[1:, THETA], elapsed, speed, self.config)

    def _rows(self, plan: Trajectory, local: Array) -> CorridorRows | None:
        """Corridor rows of stages 1..N of a plan, whose states are `local` (N+1, 6) in the QP's frame."""
        if not self._pattern.corridor_rows.size:
            return None
        config, margin = self.config, self.config.clearance.wanted
        wheelbase = config.vehicle.wheelbase
        found = stage_contacts(self._space, self._body, plan, margin, wheelbase)
        return corridor_rows(local[1:, PHI].copy(), found, margin, config.planned_minimum)

    def _pressed(self, last: Solution, start: Array) -> bool:
        """Whether the last plan had to leave its margin by what is on top of the least, or the vehicle is
        beyond a limit at the `start` (6,)."""
        config, limits = self.config, self.config.limits
        spare = max(config.clearance.wanted - config.planned_minimum, 0.0)
        beyond = abs(start[V]) > limits.speed or abs(start[DELTA]) > limits.steering
        return bool(beyond) or last.most_slack > spare

    def _admit(self, measured: Array, change: Array, linear: Linearisation) -> None:
        """Widen bounds on v and delta, and the corridor, as far as a measured state (6,) needs it, which is a
        `change` (6,) off the one linearised about."""
        values, pattern, stages = self._values, self._pattern, linear.stages
        bound_rows, comfort = (pattern.bound_rows, pattern.bound_units), self.config.comfort
        fill_motion_bounds(values, bound_rows, stages, linear.bounds, measured, comfort)
        if linear.rows is None or linear.drift is None:
            return
        margin = self.config.clearance.wanted
        missing = margin_deficit(linear.rows, linear.drift, change[:MEASURED])
        if not missing.any():
            return
        lack = missing[0].max(axis=0)
        most = np.minimum(np.maximum(lack, margin - self.config.planned_minimum), margin)
        deficit = Deficit(margin, missing, most, np.maximum(lack - margin, 0.0))
        elapsed, travelled = np.add.accumulate(stages.lengths), distances(stages.states)[1:]
        bounds = relaxed_bounds(
            linear.rows.lower, deficit, elapsed, travelled, self._trails, CONTACT_TOLERANCE
        )
        fill_corridor_bounds(values, pattern, bounds)

    def _first_iterate(self, change: Array) -> tuple[Array, Array]:
        """What the solver starts from: the measured state, and slack and multipliers of the last solution."""
        pattern = self._pattern
        primal, dual = np.zeros_like(self._values.gradient), np.zeros_like(self._values.lower)
        primal[pattern.state_columns[0]] = change / STATE_UNITS
        if self._last is not None:
            primal[pattern.slack_columns] = self._last.slack / SLACK_UNIT
            if len(self._last.dual) == len(dual):
                dual = self._last.dual * self._values.row_scaling
        return primal, dual

    def _read(self, linear: Linearisation, result: QpSolution, started: float) -> Solution:
        pattern, shifted = self._pattern, linear.trajectory
        if result.solved:
            change, dual = result.primal * pattern.column_units, result.dual / self._values.row_scaling
        else:
            change, dual = np.zeros(len(result.primal)), np.zeros(len(result.dual))
        states = local_to_world(linear.frame, linear.stages.states + change[pattern.state_columns])
        controls, times = shifted.controls + change[pattern.control_columns], shifted.times
        if linear.weights.time > 0.0:  # the progress keeps to its stages
            longer = float(change[pattern.time_column[0]])
            later = stretched_times(float(times[0]), linear.stages.lengths, longer)
            controls[:, THETA_DOT] *= (times[1:] - times[:-1]) / (later[1:] - later[:-1])
            times = later
        slack = np.maximum(change[pattern.slack_columns], 0.0)
        read_only(states, controls, times)
        return Solution(
            solved=result.solved,
            trajectory=Trajectory(times=times, states=states, controls=controls),
            slack=slack,
            most_slack=float(slack.max()),
            weights=linear.weights,
            damping=linear.damping,
            dual=dual,
            status=result.status,
            iterations=result.iterations,
            interior_point=result.interior_point,
            residuals=result.residuals,
            stopped=result.stopped,
            prepare_seconds=linear.seconds,
            solve_seconds=result.seconds,
            feedback_seconds=perf_counter() - started,
        )
