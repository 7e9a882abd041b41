"""A way made drivable without standing still to steer: sequential quadratic programming on its curvature.

Each stretch of one direction has a length S and curvatures at evenly spaced knots, linear in between. So the
steering is continuous within it, and changes by no more than a setting per metre. The variables are the
changes of these; a pose is where the arcs up to it lead, exactly, and it changes by

(R1)  dp = sum over pieces j before it of  d h R (p - m_j) dkappa_j  +  (t_j + kappa_j d R (p - m_j)) dh_j

with the pieces' lengths h, midpoints m, tangents t and direction d, and R a turn by 90 degrees to the left;
the heading changes by d (h dkappa + kappa dh). The QP asks for

(R2)  min  w_k sum (dkappa/ds)² + w_c (jump at a change of direction)² + w_S S + w_m (lack of margin)²

so that the last pose is the goal, and curvature and slope keep to their limits. Half-planes to all that is
near come from geometry.flanks. What is near is looked at anew in each iteration; at the end a Newton step
of least norm takes away what is left of the error at the goal.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil, cos, inf, sin

import numpy as np

from geometry.arrays import Array, Index
from geometry.compiled import Array1, Index1, Out2, Out3, inner, kernel
from geometry.contacts import ACROSS, ALONG, APART, AT_X, AT_Y
from geometry.flanks import flank_contacts
from geometry.shape_grid import Body, ShapeGrid
from rti_mpcc.qp.solver import solve_once
from rti_mpcc.route_planner.hybrid_astar import after

_NEWTON_STEPS = 6
_ROUNDING = 1e-9
_NEAR = 0.15  # [m] beyond the margin what is near is looked at: so far one step may go
_ACCURACY, _ITERATIONS = 1e-4, 300  # of a QP: its step is judged by what it does
_BEYOND = 0.02  # share of the largest curvature by which the last steps may pass it: there is a reserve


@dataclass(frozen=True, slots=True, kw_only=True)
class SmoothingTerms:
    """What smoothing keeps to.

    Attributes:
        curvature: at most [1/m]; slope: change of the steering, at most [rad/m]; wheelbase: [m].
        margin: of the body, wanted [m]; spacing: of knots [m]; piece: length of an arc [m].
        look: distance of the poses whose surroundings are looked at [m].
        slopes, jump, length, lack: weights w_k, w_c, w_S, w_m of (R2); damping: on all changes;
            goal: on the error at the goal, and on slopes beyond the limit, where steps are judged; steeper:
            share of such a slope that is to go in one iteration; trust: largest change in one iteration, of a
            curvature as a share of the largest one, of a length in its radius.
    """

    curvature: float
    slope: float
    wheelbase: float
    margin: float
    spacing: float
    piece: float
    look: float
    slopes: float = 0.05
    jump: float = 0.05
    length: float = 0.02
    lack: float = 10.0
    damping: float = 0.05
    goal: float = 10.0
    steeper: float = 0.3
    trust: float = 0.25


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Stretches:
    """Stretches of one direction each.

    Attributes:
        direction: (m,) +1 or -1; length: (m,) [m]; first: (m + 1,) where the knots of each begin;
        knots: (k,) curvatures [1/m].
        pieces: (m + 1,) where the arcs of each begin.
    """

    direction: Array
    length: Array
    first: Index
    knots: Array
    pieces: Index

    @classmethod
    def of(cls, way: Array, terms: SmoothingTerms) -> Stretches:
        """Build from a way (n, 2) of signed lengths [m] and curvatures [1/m]: means around the knots."""
        turns = np.flatnonzero(way[1:, 0] * way[:-1, 0] < 0.0) + 1
        direction, length, knots, counts, pieces = [], [], [], [], []
        for some in np.split(way, turns):
            whole = float(np.abs(some[:, 0]).sum())
            count = max(ceil(whole / terms.spacing), 2) + 1
            ends = np.concatenate(([0.0], np.cumsum(np.abs(some[:, 0]))))
            turned = np.concatenate(([0.0], np.cumsum(np.abs(some[:, 0]) * some[:, 1])))
            at = np.linspace(0.0, whole, count)
            half = 0.5 * whole / (count - 1)
            low, high = np.maximum(at - half, 0.0), np.minimum(at + half, whole)
            mean = (np.interp(high, ends, turned) - np.interp(low, ends, turned)) / (high - low)
            direction.append(float(np.sign(some[0, 0])))
            length.append(whole)
            counts.append(count)
            knots.append(mean)
            pieces.append(max(ceil(whole / terms.piece), 2))
        return cls(
            direction=np.array(direction),
            length=np.array(length),
            first=np.concatenate(([0], np.cumsum(counts))),
            knots=np.concatenate(knots),
            pieces=np.concatenate(([0], np.cumsum(pieces))),
        )

    def way(self) -> Array:
        """Signed lengths [m] and curvatures [1/m] of the arcs (n, 2)."""
        found = np.empty((int(self.pieces[-1]), 2))
        _arcs(self.direction, self.length, self.first, self.knots, self.pieces, found)
        return found


@kernel
def _arcs(
    direction: Array1, length: Array1, first: Index1, knots: Array1, pieces: Index1, found: Out2
) -> None:
    for m in range(len(direction)):
        count = pieces[m + 1] - pieces[m]
        for j in range(count):
            k, share = _between(j, count, first[m + 1] - first[m])
            at = first[m] + k
            found[pieces[m] + j, 0] = direction[m] * length[m] / count
            found[pieces[m] + j, 1] = (1.0 - share) * knots[at] + share * knots[at + 1]


@inner
def _between(j: int, count: int, knots: int) -> tuple[int, float]:
    """Before which knot the middle of the j-th piece is, and by which share of the way to the next one."""
    at = (j + 0.5) / count * (knots - 1)
    k = min(int(at), knots - 2)
    return k, at - k


@kernel
def _poses_and_slopes(
    start: Array1,
    direction: Array1,
    length: Array1,
    first: Index1,
    knots: Array1,
    pieces: Index1,
    rows: Index1,
    poses: Out2,
    slopes: Out3,
) -> None:
    """Poses after all pieces, and of those with the indices `rows` how they change, equation (R1)."""
    total = pieces[-1]
    middle, tangent = np.empty((total, 2)), np.empty((total, 2))
    knot, share = np.empty(total, np.int64), np.empty(total)
    x, y, phi = start[0], start[1], start[2]
    for m in range(len(direction)):
        count = pieces[m + 1] - pieces[m]
        h = length[m] / count
        for j in range(count):
            i = pieces[m] + j
            k, share[i] = _between(j, count, first[m + 1] - first[m])
            knot[i] = first[m] + k
            curvature = (1.0 - share[i]) * knots[knot[i]] + share[i] * knots[knot[i] + 1]
            half_x, half_y, half_phi = after(x, y, phi, 0.5 * direction[m] * h, curvature)
            x, y, phi = after(x, y, phi, direction[m] * h, curvature)
            middle[i, 0], middle[i, 1] = half_x, half_y
            tangent[i, 0], tangent[i, 1] = direction[m] * cos(half_phi), direction[m] * sin(half_phi)
            poses[i, 0], poses[i, 1], poses[i, 2] = x, y, phi
    slopes[:] = 0.0
    many = len(knots)
    for r in range(len(rows)):
        at_x, at_y = poses[rows[r], 0], poses[rows[r], 1]
        for m in range(len(direction)):
            count = pieces[m + 1] - pieces[m]
            h, d = length[m] / count, direction[m]
            for i in range(pieces[m], min(pieces[m + 1], rows[r] + 1)):
                across_x, across_y = -(at_y - middle[i, 1]), at_x - middle[i, 0]
                k = knot[i]
                curvature = (1.0 - share[i]) * knots[k] + share[i] * knots[k + 1]
                for each in range(2):
                    part = d * h * (share[i] if each == 1 else 1.0 - share[i])
                    slopes[r, 0, k + each] += part * across_x
                    slopes[r, 1, k + each] += part * across_y
                    slopes[r, 2, k + each] += part
                slopes[r, 0, many + m] += (tangent[i, 0] + curvature * d * across_x) / count
                slopes[r, 1, many + m] += (tangent[i, 1] + curvature * d * across_y) / count
                slopes[r, 2, many + m] += curvature * d / count


@dataclass(frozen=True, slots=True, eq=False)
class _Linearised:
    """What stretches lead to: the error at the goal (3,), how the last pose changes with the variables
    (3, many), what is lacking of the margin (n,) [m], and how that changes (n, many)."""

    error: Array
    goal: Array
    lacking: Array
    normals: Array


class Smoothing:
    """The iterations, one a call of `iterate`: a trust-region method, no step is taken that makes it worse.

    Args:
        start, goal: (3,) poses, the goal's heading on the branch on which the way ends.
        body, grid: of the vehicle, and all that is solid; terms: see there.
        way: (n, 2) signed lengths [m] and curvatures [1/m], to begin with.
        begin, end: curvatures [1/m] that it is to begin and end with; None: any.

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
    ) -> None:
        self._start, self._goal, self._body, self._grid = start, goal, body, grid
        self.terms = terms
        self.stretches = Stretches.of(way, terms)
        self._fixed = [
            (k, bend) for k, bend in ((0, begin), (len(self.stretches.knots) - 1, end)) if bend is not None
        ]
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
        new = _changed(self.stretches, change)
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

    def _linearised(self, now: Stretches) -> _Linearised:
        terms = self.terms
        arcs, many = int(now.pieces[-1]), len(now.knots) + len(now.length)
        every = max(round(terms.look / terms.piece), 1)
        rows = np.unique(np.append(np.arange(every - 1, arcs, every), [*(now.pieces[1:-1] - 1), arcs - 1]))
        poses, slopes = np.empty((arcs, 3)), np.empty((len(rows), 3, many))
        _poses_and_slopes(
            self._start, now.direction, now.length, now.first, now.knots, now.pieces, rows, poses, slopes
        )
        lacking, normals = self._half_planes(poses[rows[:-1]], slopes[:-1])
        return _Linearised(self._goal - poses[-1], slopes[-1], lacking, normals)

    def _merit(self, now: Stretches, at: _Linearised) -> float:
        """What the QP makes less, and the error at the goal."""
        terms, radius = self.terms, 1.0 / self.terms.curvature
        changes, _, limits = _slopes(now, terms)
        bends = now.knots / terms.curvature
        lacking = np.maximum(at.lacking, 0.0) / terms.margin
        cost = 0.5 * terms.slopes * float(((changes @ bends) ** 2).sum())
        cost += 0.5 * terms.jump * float(((_jumps(now) @ bends) ** 2).sum())
        cost += terms.length * float(now.length.sum()) / radius + 0.5 * terms.lack * float((lacking**2).sum())
        cost -= terms.goal * float(np.minimum(limits, 0.0).sum())
        return cost + terms.goal * float(np.abs(at.error / (radius, radius, 1.0)).sum())

    def settled(self) -> Array | None:
        """Arcs (n, 2), signed lengths [m] and curvatures [1/m], that end at the goal but for rounding, by
        Newton steps of least norm from where the iterations are; None if there are none within the limits."""
        now = self.stretches
        for _ in range(_NEWTON_STEPS):
            arcs, many = int(now.pieces[-1]), len(now.knots) + len(now.length)
            poses, slopes = np.empty((arcs, 3)), np.empty((1, 3, many))
            _poses_and_slopes(
                self._start, now.direction, now.length, now.first, now.knots, now.pieces,
                np.array([arcs - 1]), poses, slopes,
            )  # fmt: skip
            error = self._goal - poses[-1]
            if np.abs(error).max() < _ROUNDING:
                inside = np.abs(now.knots).max() <= self.terms.curvature * (1.0 + _BEYOND)
                return now.way() if inside and float(_slopes(now, self.terms)[2].min()) > -_BEYOND else None
            for k, _ in self._fixed:
                slopes[:, :, k] = 0.0
            now = _changed(now, np.linalg.lstsq(slopes[0], error, rcond=None)[0])
        return None

    def _half_planes(self, poses: Array, slopes: Array) -> tuple[Array, Array]:
        """What is lacking of the margin (n,) [m], and how the variables (n, many) make up for it."""
        margin, within = self.terms.margin, self.terms.margin + _NEAR
        found = flank_contacts(self._body, poses, (self._grid,), within=within, outward=0.0)
        pose, piece, side = np.nonzero(found[..., APART] < within)
        contact = found[pose, piece, side]
        c, s = np.cos(poses[pose, 2]), np.sin(poses[pose, 2])
        along, across = contact[:, ALONG], contact[:, ACROSS]
        turning = contact[:, AT_X] * across - contact[:, AT_Y] * along
        normal = np.stack([c * along - s * across, s * along + c * across, turning], axis=1)
        return margin - contact[:, APART], np.einsum("ni,nij->nj", normal, slopes[pose])

    def _solved(self, at: _Linearised) -> Array:
        """The change (many,) of knots and lengths that the QP asks for; none where it has no solution.

        Curvatures count in units of the largest one, lengths in its radius, lack of margin in `margin`.
        """
        now, terms, trust = self.stretches, self.terms, self._trust
        knots, stretches, planes = len(now.knots), len(now.length), len(at.lacking)
        many, radius = knots + stretches, 1.0 / terms.curvature
        units = np.concatenate((np.full(knots, terms.curvature), np.full(stretches, radius)))
        bends = now.knots / terms.curvature

        changes, rises, limits = _slopes(now, terms)
        jumps = _jumps(now)
        rows = np.vstack((np.sqrt(terms.slopes) * changes, np.sqrt(terms.jump) * jumps))
        hessian = np.zeros((many + planes, many + planes))
        hessian[:knots, :knots] = rows.T @ rows
        hessian[np.arange(many), np.arange(many)] += terms.damping
        hessian[np.arange(many, many + planes), np.arange(many, many + planes)] = terms.lack
        linear = np.concatenate((rows.T @ (rows @ bends), np.full(stretches, terms.length), np.zeros(planes)))

        # Along the row of the goal as far as trust lets it.
        goal = at.goal * units / np.array([[radius], [radius], [1.0]])
        error = at.error / (radius, radius, 1.0)
        error = error * min(1.0, trust / max(float(np.abs(error).max()), 1e-12))
        wanted = np.zeros((planes, many + planes))
        wanted[:, :many] = at.normals * units / terms.margin
        wanted[np.arange(planes), many + np.arange(planes)] = 1.0
        matrix = np.vstack((
            np.eye(many + planes),
            np.hstack((rises, np.zeros((len(rises), planes)))),
            np.hstack((goal, np.zeros((3, planes)))),
            wanted,
        ))  # fmt: skip
        length = now.length / radius
        shorter = -np.minimum(0.5 * length, trust)
        low = np.concatenate((np.maximum(-1.0 - bends, -trust), shorter, np.zeros(planes)))
        high = np.concatenate(
            (np.minimum(1.0 - bends, trust), np.full(stretches, trust), np.full(planes, np.inf))
        )
        low, high = np.minimum(low, 0.0), np.maximum(high, 0.0)
        for k, bend in self._fixed:
            low[k] = high[k] = min(max(bend / terms.curvature - bends[k], -trust), trust)
        # What is beyond the limit of the slope comes back step by step.
        limits = np.maximum(limits, terms.steeper * np.minimum(limits, 0.0))
        low = np.concatenate((low, np.full(len(limits), -np.inf), error, at.lacking / terms.margin))
        high = np.concatenate((high, limits, error, np.full(planes, np.inf)))
        answer = solve_once(hessian, linear, matrix, low, high, accuracy=_ACCURACY, iterations=_ITERATIONS)
        return np.zeros(many) if answer is None else answer[:many] * units


def _slopes(now: Stretches, terms: SmoothingTerms) -> tuple[Array, Array, Array]:
    """Rows of dkappa/ds, weighted by their stretch, and rows and upper bounds of its limit; in the units of
    the QP."""
    radius, knots = 1.0 / terms.curvature, len(now.knots)
    counts = np.diff(now.first) - 1
    stretch = np.repeat(np.arange(len(counts)), counts)
    first = np.concatenate([np.arange(now.first[m], now.first[m + 1] - 1) for m in range(len(counts))])
    step = (now.length / counts)[stretch]
    place = np.arange(len(first))
    rise = np.zeros((len(first), knots + len(counts)))
    rise[place, first], rise[place, first + 1] = -1.0, 1.0
    changes = rise[:, :knots] / np.sqrt(step / radius)[:, None]
    middle = 0.5 * (now.knots[first] + now.knots[first + 1])
    # Change of kappa in units per metre.
    most = terms.slope * (1.0 + (terms.wheelbase * middle) ** 2) / terms.wheelbase * radius
    present = (now.knots[first + 1] - now.knots[first]) * radius
    longer = np.zeros_like(rise)
    longer[place, knots + stretch] = most * radius / counts[stretch]
    limits = np.concatenate((most * step - present, most * step + present))
    return changes, np.vstack((rise - longer, -rise - longer)), limits


def _jumps(now: Stretches) -> Array:
    """Rows of the jumps of the curvature where the direction changes."""
    ends = now.first[1:-1]
    rows = np.zeros((len(ends), len(now.knots)))
    rows[np.arange(len(ends)), ends - 1], rows[np.arange(len(ends)), ends] = -1.0, 1.0
    return rows


def _changed(now: Stretches, change: Array) -> Stretches:
    knots = len(now.knots)
    length = np.maximum(now.length + change[knots:], 0.02)
    return replace(now, knots=now.knots + change[:knots], length=length)
