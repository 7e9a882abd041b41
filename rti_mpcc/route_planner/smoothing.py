"""A way made drivable without standing still to steer: sequential quadratic programming on its curvature.

The variables are changes of the curvatures and lengths of its stretches (`stretches`). The QP asks for

(R2)  min  w_k sum (dkappa/ds)² + w_c (jump at a change of direction)² + w_S S + w_m (lack of margin)²
           + w_b sum (distance beside a given line)²

so that the last pose, which changes by (R1), is the goal, and curvature and slope keep to their limits.
Half-planes to all that is near come from geometry.flanks. What is near is looked at anew in each iteration;
at the end Newton steps of least norm take away what is left of the error at the goal.
"""

from __future__ import annotations

from dataclasses import replace
from math import inf

import numpy as np
from scipy.spatial import cKDTree

from geometry.arrays import Array, Mask
from geometry.contacts import ACROSS, ALONG, APART, AT_X, AT_Y
from geometry.flanks import flank_contacts
from geometry.shape_grid import Body, ShapeGrid
from rti_mpcc.qp.solver import solve_once
from rti_mpcc.route_planner.smoothing_terms import Linearised, Slopes, SmoothingTerms
from rti_mpcc.route_planner.stretches import Stretches, Traced

_NEWTON_STEPS = 6
_ROUNDING = 1e-9
_NEAR = 0.15  # [m] beyond the margin what is near is looked at: so far one step may go
_ACCURACY, _ITERATIONS = 1e-4, 300  # of a QP: its step is judged by what it does
_BEYOND = 0.02  # share of the largest curvature by which a limit may be passed in the end: there is a reserve


class Smoothing:
    """The iterations, one a call of `iterate`: a trust-region method, no step is taken that makes it worse.

    Args:
        start, goal: (3,) poses, the goal's heading on the branch on which the way ends.
        body, grid: of the vehicle, and all that is solid; terms: see there.
        way: (n, 2) signed lengths [m] and curvatures [1/m], to begin with.
        begin, end: curvatures [1/m] that it is to begin and end with; None: any.
        line: (m, 3) poses that it is to stay near, closely spaced; None: none.

    Attributes:
        stretches: as they are now.
        error: at the goal, the largest of x, y [m] and heading [rad].
        moved: largest change of a curvature in the last iteration, as a share of the largest curvature.
    """

    def __init__(
        self,
        start: Array,
        goal: Array,
        body: Body,
        grid: ShapeGrid,
        terms: SmoothingTerms,
        way: Array,
        *,
        begin: float | None = None,
        end: float | None = None,
        line: Array | None = None,
    ) -> None:
        self._start, self._goal, self._body, self._grid = start, goal, body, grid
        self._line = None if line is None else (line, cKDTree(line[:, :2]))
        self.terms = terms
        given = Stretches.of(way, terms.spacing, terms.piece)
        bounded = given.bounded(terms.curvature)
        last = len(bounded.knots) - 1
        self._fixed = [(k, bend) for k, bend in ((0, begin), (last, end)) if bend is not None]
        # A step towards them would make it worse at first: they are there from the begin.
        knots = bounded.knots.copy()
        for k, bend in self._fixed:
            knots[k] = bend
        self.stretches = replace(bounded, knots=knots)
        self._trust = terms.trust
        self._at = self._linearised(self.stretches)
        self.moved = inf

    @property
    def error(self) -> float:
        """See above."""
        return float(np.abs(self._at.error).max())

    def iterate(self) -> None:
        """Solve one QP and take its step, if that makes it better."""
        change = self._solved(self._at)
        new = self.stretches.changed(change)
        there = self._linearised(new)
        self.moved = float(np.abs(change[: len(new.knots)]).max()) / self.terms.curvature
        if self._merit(new, there) < self._merit(self.stretches, self._at):
            self.stretches, self._at = new, there
            self._trust = min(2.0 * self._trust, self.terms.trust)
        else:
            self._trust *= 0.3

    def firmer(self, times: float) -> None:
        """Let what is lacking of the margin cost so many times as much."""
        self.terms = replace(self.terms, lack=times * self.terms.lack)
        self._trust, self.moved = self.terms.trust, inf

    def _linearised(self, now: Stretches) -> Linearised:
        at = now.traced(self._start)
        lacking, normals = self._half_planes(now, at)
        beside, across = self._offsets(now, at)
        return Linearised(
            error=self._goal - at.poses[-1],
            goal=now.slopes(at, np.array([len(at.poses) - 1]))[0],
            lacking=lacking,
            normals=normals,
            beside=beside,
            across=across,
            slopes=Slopes.of(now, self.terms),
        )

    def _merit(self, now: Stretches, at: Linearised) -> float:
        """What the QP makes less, and the error at the goal."""
        terms, radius = self.terms, 1.0 / self.terms.curvature
        bends = now.knots / terms.curvature
        lacking = np.maximum(at.lacking, 0.0) / terms.margin
        cost = 0.5 * terms.slopes * float(((at.slopes.changes @ bends) ** 2).sum())
        cost += 0.5 * terms.jump * float(((_jumps(now) @ bends) ** 2).sum())
        cost += terms.length * float(now.length.sum()) / radius + 0.5 * terms.lack * float((lacking**2).sum())
        cost += 0.5 * terms.beside * float(((at.beside / radius) ** 2).sum())
        cost -= terms.goal * float(np.minimum(at.slopes.limits, 0.0).sum())
        return cost + terms.goal * float(np.abs(at.error / (radius, radius, 1.0)).sum())

    def settled(self) -> Array | None:
        """Arcs (n, 2), signed lengths [m] and curvatures [1/m], that end at the goal but for rounding, by
        Newton steps of least norm from where the iterations are; None if there are none within the limits."""
        now = self.stretches
        for _ in range(_NEWTON_STEPS):
            at = now.traced(self._start)
            error = self._goal - at.poses[-1]
            if np.abs(error).max() < _ROUNDING:
                return now.way() if self._keeps_to_limits(now) else None
            slopes = now.slopes(at, np.array([len(at.poses) - 1]))
            for k, _ in self._fixed:
                slopes[:, :, k] = 0.0
            now = now.changed(np.linalg.lstsq(slopes[0], error, rcond=None)[0])
        return None

    def _keeps_to_limits(self, now: Stretches) -> bool:
        """Whether no limit, and no curvature that is fixed, is missed by more than `_BEYOND`."""
        terms = self.terms
        bent = float(np.abs(now.knots).max()) <= (1.0 + _BEYOND) * terms.curvature
        fixed = all(abs(now.knots[k] - bend) <= _BEYOND * terms.curvature for k, bend in self._fixed)
        return bent and fixed and float(Slopes.of(now, terms).limits.min()) > -_BEYOND

    def _looked(self, now: Stretches, count: int) -> Mask:
        """At which of so many poses it is looked round (count,)."""
        every = max(round(self.terms.look / self.terms.piece), 1)
        looked: Mask = np.arange(count) % every == every - 1
        looked[now.pieces[1:-1] - 1] = True
        return looked

    def _offsets(self, now: Stretches, at: Traced) -> tuple[Array, Array]:
        """How far some of the poses are beside the line (k,) [m], and how that changes (k, many)."""
        if self._line is None:
            return np.zeros(0), np.zeros((0, now.variables))
        line, tree = self._line
        rows = np.flatnonzero(self._looked(now, len(at.poses) - 1))
        nearest = line[tree.query(at.poses[rows, :2])[1]]
        across = np.stack([-np.sin(nearest[:, 2]), np.cos(nearest[:, 2])], axis=1)
        beside = ((at.poses[rows, :2] - nearest[:, :2]) * across).sum(axis=1)
        return beside, np.einsum("ki,kij->kj", across, now.slopes(at, rows)[:, :2])

    def _half_planes(self, now: Stretches, at: Traced) -> tuple[Array, Array]:
        """What is lacking of the margin (n,) [m], and how the variables (n, many) make up for it: at some of
        the poses, and at all where it is lacking, for a corner may be passed between those."""
        margin, within = self.terms.margin, self.terms.margin + _NEAR
        found = flank_contacts(self._body, at.poses[:-1], (self._grid,), within=within, outward=0.0)
        looked = self._looked(now, len(found))
        apart = found[..., APART]
        pose, piece, side = np.nonzero((apart < margin) | ((apart < within) & looked[:, None, None]))
        contact, rows = found[pose, piece, side], np.unique(pose)
        c, s = np.cos(at.poses[pose, 2]), np.sin(at.poses[pose, 2])
        along, across = contact[:, ALONG], contact[:, ACROSS]
        turning = contact[:, AT_X] * across - contact[:, AT_Y] * along
        normal = np.stack([c * along - s * across, s * along + c * across, turning], axis=1)
        slopes = now.slopes(at, rows)[np.searchsorted(rows, pose)]
        return margin - contact[:, APART], np.einsum("ni,nij->nj", normal, slopes)

    def _solved(self, at: Linearised) -> Array:
        """The change (many,) of knots and lengths that the QP asks for; none where it has no solution.

        Curvatures count in units of the largest one, lengths in its radius, lack of margin in `margin`. What
        is beyond a limit of the slope now may stay there, at the cost that `_merit` has for it: else the QP
        might have no solution, or one that `_merit` finds worse however short the step is.
        """
        now, terms = self.stretches, self.terms
        knots, many, planes = len(now.knots), now.variables, len(at.lacking)
        radius = 1.0 / terms.curvature
        units = np.concatenate((np.full(knots, terms.curvature), np.full(many - knots, radius)))
        beyond = np.flatnonzero(at.slopes.limits < 0.0)
        count, slopes = many + planes + len(beyond), len(at.slopes.rises)
        matrix = np.zeros((count + slopes + 3 + planes, count))
        np.fill_diagonal(matrix, 1.0)
        of_slopes, of_goal, of_planes = np.split(matrix[count:], (slopes, slopes + 3))
        of_slopes[:, :many] = at.slopes.rises
        of_slopes[beyond, many + planes + np.arange(len(beyond))] = -1.0
        of_goal[:, :many] = at.goal * units / np.array([[radius], [radius], [1.0]])
        of_planes[:, :many] = at.normals * units / terms.margin
        np.fill_diagonal(of_planes[:, many:], 1.0)
        (hessian, linear), (low, high) = self._cost(at, count), self._bounds(at, count)
        across = at.across * units / radius
        hessian[:many, :many] += terms.beside * across.T @ across
        linear[:many] += terms.beside * (at.beside / radius) @ across
        answer = solve_once(hessian, linear, matrix, low, high, accuracy=_ACCURACY, iterations=_ITERATIONS)
        if answer is None:
            return np.zeros(many)
        # What the solver is off by must not add up over the iterations.
        change: Array = np.clip(answer[:many], low[:many], high[:many]) * units
        return change

    def _cost(self, at: Linearised, count: int) -> tuple[Array, Array]:
        """The QP's cost of so many variables, (R2), and of slopes beyond their limit."""
        now, terms = self.stretches, self.terms
        knots, many, planes = len(now.knots), now.variables, len(at.lacking)
        rows = np.vstack((np.sqrt(terms.slopes) * at.slopes.changes, np.sqrt(terms.jump) * _jumps(now)))
        hessian, linear = np.zeros((count, count)), np.full(count, terms.goal)
        hessian[:knots, :knots] = rows.T @ rows
        diagonal = np.einsum("ii->i", hessian)
        diagonal[:many] += terms.damping
        diagonal[many : many + planes] = terms.lack
        linear[:knots] = rows.T @ (rows @ (now.knots / terms.curvature))
        linear[knots:many] = terms.length
        linear[many : many + planes] = 0.0
        return hessian, linear

    def _bounds(self, at: Linearised, count: int) -> tuple[Array, Array]:
        """Of the QP's rows: so many variables, the slopes, the goal and the half-planes."""
        now, terms, trust = self.stretches, self.terms, self._trust
        radius, bends = 1.0 / terms.curvature, now.knots / terms.curvature
        shorter, longer = -np.minimum(0.5 * now.length / radius, trust), np.full(len(now.length), trust)
        others = count - now.variables
        low = np.concatenate((np.maximum(-1.0 - bends, -trust), shorter, np.zeros(others)))
        high = np.concatenate((np.minimum(1.0 - bends, trust), longer, np.full(others, np.inf)))
        low, high = np.minimum(low, 0.0), np.maximum(high, 0.0)
        for k, _ in self._fixed:
            low[k] = high[k] = 0.0
        # Along the row of the goal as far as trust lets it.
        error, limits = at.error / (radius, radius, 1.0), at.slopes.limits
        error = error * min(1.0, trust / max(float(np.abs(error).max()), 1e-12))
        low = np.concatenate((low, np.full(len(limits), -np.inf), error, at.lacking / terms.margin))
        high = np.concatenate((high, limits, error, np.full(len(at.lacking), np.inf)))
        return low, high


def _jumps(now: Stretches) -> Array:
    """Rows of the jumps of the curvature where the direction changes."""
    ends = now.first[1:-1]
    rows = np.zeros((len(ends), len(now.knots)))
    rows[np.arange(len(ends)), ends - 1], rows[np.arange(len(ends)), ends] = -1.0, 1.0
    return rows
