"""A route made drivable without a stop to steer: sequential quadratic programming on its curvature.

The variables are changes of the curvatures and lengths of its segments (`curvature_profile`). The QP asks for

(R2)  min  w_k sum (dkappa/ds)² + w_c (jump at a change of direction)² + w_S S + w_m (lack of margin)²
           + w_b sum (distance from a given line)²

so that the last pose, which changes by (R3), is the goal, and curvature and slope keep to their limits.
Half-planes to all that is near come from geometry.contacts, anew in each iteration; at the end Newton steps
of least norm take away the remaining error at the goal.
"""

from __future__ import annotations

from math import inf
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from geometry.arrays import Array, Mask
from geometry.contacts import ACROSS, ALONG, APART, AT_X, AT_Y, FLANKS, no_contacts, solid_contacts
from rti_mpcc.qp.solver import solve_once
from rti_mpcc.route_planner.curvature_profile import CurvatureProfile, Traced, slopes_of, traced
from rti_mpcc.route_planner.problem import CHECK, RouteProblem

CURVATURE_SHARE = 0.9
"""Share of the vehicle's largest curvature that a smooth route uses: the rest is for control."""
_SPACING = 0.2  # of the knots, in radii of the sharpest bend
_ARC = 0.25 * _SPACING  # length of an arc, in the same
_LOOK_EVERY = 2  # arcs between two poses whose surroundings are always looked at
_SLOPES, _JUMP, _LENGTH, _LACK, _BESIDE = 0.05, 0.05, 0.02, 10.0, 1.0
"""Weights w_k, w_c, w_S, w_m, w_b of (R2)."""
_DAMPING = 0.05  # weight of all changes
_GOAL = 10.0  # weight of slopes beyond the limit, and in the merit of a step of the error at the goal
_TRUST = 0.25  # largest change in one iteration, in units of the QP
_NEWTON_STEPS = 6
_ROUNDING = 1e-9
_NEAR = 0.15  # [m] beyond the margin what is near is looked at: so far one step may go
_ACCURACY, _ITERATIONS = 1e-4, 300  # of a QP: its step is judged by its merit
_BEYOND = 0.02  # share of the largest curvature by which a limit may be passed in the end: there is a reserve


class _Linearised(NamedTuple):
    """End and surroundings of a profile, and how they change with its variables.

    Attributes:
        error: (3,) at the goal; goal: (3, many) change of the last pose.
        lacking: (n,) lack of margin [m]; normals: (n, many) how variables make up for it.
        beside: (k,) distance of poses from the line [m]; across: (k, many) change of that.
        changes: (i, k) rows of the slopes dkappa/ds between knots, in units of the QP, weighted by length.
        rises: (2 i, many) rows of their limits, both ways; limits: (2 i,) distance to these.
    """

    error: Array
    goal: Array
    lacking: Array
    normals: Array
    beside: Array
    across: Array
    changes: Array
    rises: Array
    limits: Array


class Smoothing:
    """The iterations, one a call of `iterate`: a trust-region method, no step is taken that makes it worse.

    Args:
        problem: vehicle, surroundings, settings, and the line to stay near.
        route: (n, 2) signed lengths [m] and curvatures [1/m], to start with.
        start, goal: (3,) poses, the goal's heading on the branch on which the route ends.
        ends: curvatures [1/m] at the start and the goal; None: any.

    Attributes:
        profile: as it is now.
        moved: largest change of a curvature in the last iteration, as a share of the largest curvature.
    """

    def __init__(
        self,
        problem: RouteProblem,
        route: Array,
        start: Array,
        goal: Array,
        ends: tuple[float | None, float | None],
    ) -> None:
        self._problem, self._start, self._goal = problem, start, goal
        config, settings, clearance = problem.config, problem.config.route, problem.config.clearance
        self._tree = None if problem.line is None else cKDTree(problem.line[:, :2])
        self._curvature = CURVATURE_SHARE * config.max_curvature
        self._margin = max(clearance.on_routes, clearance.least + settings.reserve, CHECK)
        radius = 1.0 / config.max_curvature
        self.profile = CurvatureProfile.of(route, _SPACING * radius, _ARC * radius).bounded(self._curvature)
        places = 0, len(self.profile.knots) - 1
        self._fixed = [(k, bend) for k, bend in zip(places, ends, strict=True) if bend is not None]
        # A step towards them would make it worse at first: they are there from the start.
        for k, bend in self._fixed:
            self.profile.knots[k] = bend
        self._lack, self._trust, self.moved = _LACK, _TRUST, inf
        self._at = self._linearised(self.profile)

    @property
    def error(self) -> float:
        """At the goal, the largest of x, y [m] and heading [rad]."""
        return float(np.abs(self._at.error).max())

    def iterate(self) -> None:
        """Solve one QP and take its step, if that makes it better."""
        change = self._solved(self._at)
        new = self.profile.changed(change)
        there = self._linearised(new)
        self.moved = float(np.abs(change[: len(new.knots)]).max()) / self._curvature
        if self._merit(new, there) < self._merit(self.profile, self._at):
            self.profile, self._at = new, there
            self._trust = min(2.0 * self._trust, _TRUST)
        else:
            self._trust *= 0.3

    def raise_margin_weight(self, times: float) -> None:
        """Let a lack of margin cost so many times as much."""
        self._lack *= times
        self._trust, self.moved = _TRUST, inf

    def settled(self) -> Array | None:
        """Arcs (n, 2), signed lengths [m] and curvatures [1/m], that end at the goal but for rounding, by
        Newton steps of least norm from the present profile; None if there are none within the limits."""
        now = self.profile
        for _ in range(_NEWTON_STEPS):
            at = traced(now, self._start)
            error = self._goal - at.poses[-1]
            if np.abs(error).max() < _ROUNDING:
                return now.route(at) if self._keeps_to_limits(now) else None
            slopes = slopes_of(now, at, np.array([len(at.poses) - 1]))
            for k, _ in self._fixed:
                slopes[:, :, k] = 0.0
            now = now.changed(np.linalg.lstsq(slopes[0], error, rcond=None)[0])
        return None

    def _keeps_to_limits(self, now: CurvatureProfile) -> bool:
        """Whether no limit, and no curvature that is fixed, is missed by more than `_BEYOND`."""
        most = self._curvature
        bent = float(np.abs(now.knots).max()) <= (1.0 + _BEYOND) * most
        fixed = all(abs(now.knots[k] - bend) <= _BEYOND * most for k, bend in self._fixed)
        _, _, limits = self._steering(now)
        return bent and fixed and float(limits.min()) > -_BEYOND

    # -- linearisation ---------------------------------------------------------------------------------

    def _linearised(self, now: CurvatureProfile) -> _Linearised:
        at = traced(now, self._start)
        slopes = slopes_of(now, at, np.array([len(at.poses) - 1]))[0]
        error = self._goal - at.poses[-1]
        return _Linearised(
            error, slopes, *self._half_planes(now, at), *self._offsets(now, at), *self._steering(now)
        )

    def _steering(self, now: CurvatureProfile) -> tuple[Array, Array, Array]:
        """`changes`, `rises` and `limits`, see `_Linearised`."""
        config, radius, knots = self._problem.config, 1.0 / self._curvature, len(now.knots)
        slope, wheelbase = config.route.steering_slope, config.vehicle.wheelbase
        counts = np.diff(now.first) - 1
        segment = np.repeat(np.arange(len(counts)), counts)
        first = np.delete(np.arange(knots), now.first[1:] - 1)
        step, place = (now.length / counts)[segment], np.arange(len(first))
        rise = np.zeros((len(first), now.variables))
        rise[place, first], rise[place, first + 1] = -1.0, 1.0
        middle = 0.5 * (now.knots[first] + now.knots[first + 1])
        # Change of kappa in units per metre.
        most = slope * (1.0 + (wheelbase * middle) ** 2) / wheelbase * radius
        present = (now.knots[first + 1] - now.knots[first]) * radius
        longer = np.zeros_like(rise)
        longer[place, knots + segment] = most * radius / counts[segment]
        changes = rise[:, :knots] / np.sqrt(step / radius)[:, None]
        limits = np.concatenate((most * step - present, most * step + present))
        return changes, np.vstack((rise - longer, -rise - longer)), limits

    def _looked_at(self, now: CurvatureProfile, count: int) -> Mask:
        """Which of the poses are always compared with their surroundings, (count,)."""
        looked: Mask = np.arange(count) % _LOOK_EVERY == _LOOK_EVERY - 1
        looked[now.arcs[1:-1] - 1] = True
        return looked

    def _offsets(self, now: CurvatureProfile, at: Traced) -> tuple[Array, Array]:
        """Distances of some of the poses from the line (k,) [m], and their changes (k, many)."""
        line = self._problem.line
        if line is None or self._tree is None:
            return np.zeros(0), np.zeros((0, now.variables))
        rows = np.flatnonzero(self._looked_at(now, len(at.poses) - 1))
        nearest = line[self._tree.query(at.poses[rows, :2])[1]]
        across = np.stack([-np.sin(nearest[:, 2]), np.cos(nearest[:, 2])], axis=1)
        beside = ((at.poses[rows, :2] - nearest[:, :2]) * across).sum(axis=1)
        return beside, np.einsum("ki,kij->kj", across, slopes_of(now, at, rows)[:, :2])

    def _half_planes(self, now: CurvatureProfile, at: Traced) -> tuple[Array, Array]:
        """Lack of margin (n,) [m], and how the variables (n, many) make up for it: at some of the poses, and
        at all where it is lacking, for a corner may be passed between those."""
        problem, margin, within = self._problem, self._margin, self._margin + _NEAR
        contacts = no_contacts(len(at.poses) - 1, problem.body.pieces, FLANKS)
        solid_contacts(problem.body, at.poses[:-1], problem.grid, within, 0.0, contacts)
        looked = self._looked_at(now, len(contacts))
        apart = contacts[..., APART]
        pose, piece, side = np.nonzero((apart < margin) | ((apart < within) & looked[:, None, None]))
        contact, rows = contacts[pose, piece, side], np.unique(pose)
        c, s = np.cos(at.poses[pose, 2]), np.sin(at.poses[pose, 2])
        along, across = contact[:, ALONG], contact[:, ACROSS]
        turning = contact[:, AT_X] * across - contact[:, AT_Y] * along
        normal = np.stack([c * along - s * across, s * along + c * across, turning], axis=1)
        slopes = slopes_of(now, at, rows)[np.searchsorted(rows, pose)]
        return margin - contact[:, APART], np.einsum("ni,nij->nj", normal, slopes)

    # -- the QP ----------------------------------------------------------------------------------------

    def _merit(self, now: CurvatureProfile, at: _Linearised) -> float:
        """The cost of the QP, and of the error at the goal."""
        radius, bends = 1.0 / self._curvature, now.knots / self._curvature
        lacking = np.maximum(at.lacking, 0.0) / self._margin
        cost = 0.5 * _SLOPES * float(((at.changes @ bends) ** 2).sum())
        cost += 0.5 * _JUMP * float(((_jumps(now) @ bends) ** 2).sum())
        cost += _LENGTH * float(now.length.sum()) / radius + 0.5 * self._lack * float((lacking**2).sum())
        cost += 0.5 * _BESIDE * float(((at.beside / radius) ** 2).sum())
        cost -= _GOAL * float(np.minimum(at.limits, 0.0).sum())
        return cost + _GOAL * float(np.abs(at.error / (radius, radius, 1.0)).sum())

    def _solved(self, at: _Linearised) -> Array:
        """The change (many,) of knots and lengths that the QP asks for; none where it has no solution.

        Curvatures count in units of the largest one, lengths in its radius, lack of margin in the margin. A
        slope that is beyond its limit now may stay there, at the cost that `_merit` has for it: else the QP
        might have no solution, or one that `_merit` finds worse however short the step is.
        """
        now, radius, planes = self.profile, 1.0 / self._curvature, len(at.lacking)
        knots, many, slopes = len(now.knots), now.variables, len(at.rises)
        units = np.concatenate((np.full(knots, self._curvature), np.full(many - knots, radius)))
        beyond = np.flatnonzero(at.limits < 0.0)
        count = many + planes + len(beyond)
        matrix = np.zeros((count + slopes + 3 + planes, count))
        np.fill_diagonal(matrix, 1.0)
        of_slopes, of_goal, of_planes = np.split(matrix[count:], (slopes, slopes + 3))
        of_slopes[:, :many] = at.rises
        of_slopes[beyond, many + planes + np.arange(len(beyond))] = -1.0
        of_goal[:, :many] = at.goal * units / np.array([[radius], [radius], [1.0]])
        of_planes[:, :many] = at.normals * units / self._margin
        np.fill_diagonal(of_planes[:, many:], 1.0)
        (hessian, linear), (low, high) = self._cost(at, count), self._bounds(at, count)
        across = at.across * units / radius
        hessian[:many, :many] += _BESIDE * across.T @ across
        linear[:many] += _BESIDE * (at.beside / radius) @ across
        answer = solve_once(hessian, linear, matrix, (low, high), accuracy=_ACCURACY, iterations=_ITERATIONS)
        if answer is None:
            return np.zeros(many)
        # The solver's errors must not add up over the iterations.
        change: Array = np.clip(answer[:many], low[:many], high[:many]) * units
        return change

    def _cost(self, at: _Linearised, count: int) -> tuple[Array, Array]:
        """The QP's cost of `count` variables, (R2), and of slopes beyond their limit."""
        now, knots, planes = self.profile, len(self.profile.knots), len(at.lacking)
        many = now.variables
        rows = np.vstack((np.sqrt(_SLOPES) * at.changes, np.sqrt(_JUMP) * _jumps(now)))
        hessian, linear = np.zeros((count, count)), np.full(count, _GOAL)
        hessian[:knots, :knots] = rows.T @ rows
        diagonal = np.einsum("ii->i", hessian)
        diagonal[:many] += _DAMPING
        diagonal[many : many + planes] = self._lack
        linear[:knots] = rows.T @ (rows @ (now.knots / self._curvature))
        linear[knots:many] = _LENGTH
        linear[many : many + planes] = 0.0
        return hessian, linear

    def _bounds(self, at: _Linearised, count: int) -> tuple[Array, Array]:
        """Of the QP's rows: `count` variables, the slopes, the goal and the half-planes."""
        now, trust = self.profile, self._trust
        radius, bends = 1.0 / self._curvature, now.knots / self._curvature
        shorter, longer = -np.minimum(0.5 * now.length / radius, trust), np.full(len(now.length), trust)
        others = count - now.variables
        low = np.concatenate((np.maximum(-1.0 - bends, -trust), shorter, np.zeros(others)))
        high = np.concatenate((np.minimum(1.0 - bends, trust), longer, np.full(others, np.inf)))
        low, high = np.minimum(low, 0.0), np.maximum(high, 0.0)
        for k, _ in self._fixed:
            low[k] = high[k] = 0.0
        # Along the row of the goal as far as trust allows.
        error, limits = at.error / (radius, radius, 1.0), at.limits
        error = error * min(1.0, trust / max(float(np.abs(error).max()), 1e-12))
        low = np.concatenate((low, np.full(len(limits), -np.inf), error, at.lacking / self._margin))
        high = np.concatenate((high, limits, error, np.full(len(at.lacking), np.inf)))
        return low, high


def _jumps(now: CurvatureProfile) -> Array:
    """Rows of the jumps of the curvature where the direction changes."""
    ends = now.first[1:-1]
    rows = np.zeros((len(ends), len(now.knots)))
    rows[np.arange(len(ends)), ends - 1], rows[np.arange(len(ends)), ends] = -1.0, 1.0
    return rows
