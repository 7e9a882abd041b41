"""The sparse QP against one put together densely, stage by stage, from the same numbers."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest

from rti_mpcc.model.bicycle import ModelStep, linearised_step
from rti_mpcc.model.layout import CONTROLS, DELTA, PHI, STATES, THETA, THETA_DOT, V, X, Y
from rti_mpcc.ocp.bounds import StageBounds
from rti_mpcc.ocp.corridor_rows import LOOSE, NO_ROWS, CorridorRows
from rti_mpcc.ocp.horizon import PlanStages
from rti_mpcc.ocp.stage_cost import FIXED_END, QuadraticCost
from rti_mpcc.qp.filling import (
    CHANGE_WEIGHT,
    IDLE_WEIGHT,
    ROW_SCALING_FROM,
    FillOptions,
    HorizonProblem,
    QpValues,
    empty_values,
    fill,
    fill_initial,
)
from rti_mpcc.qp.pattern import BOUND_UNIT, CONTROL_UNITS, SLACK_UNIT, STATE_UNITS, QpPattern, build_pattern
from rti_mpcc.types import Array
from tests.rti_mpcc.model_steps import by_control, by_state

N, PIECES, SIDES = 6, 3, 2
SLACK, SCALE = 700.0, 1e-3
BOUNDED = [V, DELTA, THETA]


class Parts(NamedTuple):
    states: Array
    controls: Array
    cost: QuadraticCost
    step: ModelStep
    lengths: Array
    bounds: StageBounds
    rows: CorridorRows
    initial: Array


def drawn(*, frenet: bool = True, seed: int = 9) -> Parts:
    random = np.random.default_rng(seed)
    states, controls = random.uniform(-0.5, 0.5, (N + 1, STATES)), random.uniform(-0.5, 0.5, (N, CONTROLS))
    states[:, V] += 2.0
    residuals = np.zeros((N + 1, 5, STATES))  # columns that a cost term of the product has
    residuals[:, :2, [X, Y, THETA]] = random.standard_normal((N + 1, 2, 3))
    residuals[:, 2, [PHI, THETA]] = random.standard_normal((N + 1, 2))
    residuals[:, 3, [V, DELTA]] = random.standard_normal((N + 1, 2))
    residuals[:, 4, [X, Y, V]] = random.standard_normal((N + 1, 3))
    if not frenet:
        residuals[:, :3] = 0.0
    hessian = np.einsum("kri,krj->kij", residuals, residuals) * 100.0
    lower = random.uniform(-2.0, -1.0, (2, N, 3))
    upper = random.uniform(1.0, 3.0, (2, N, 3))
    lengths = random.uniform(0.05, 0.4, N)
    return Parts(
        states,
        controls,
        QuadraticCost(
            hessian,
            random.standard_normal((N + 1, STATES)),
            random.uniform(0.0, 9.0, (N, CONTROLS)),
            random.standard_normal((N, CONTROLS)),
        ),
        linearised_step(states, controls, lengths, 2.875),
        lengths,
        StageBounds(
            states=np.stack([lower[0], upper[0]], axis=1),
            controls=np.stack([lower[1], upper[1]], axis=1),
            by_time=np.zeros(N),
        ),
        CorridorRows(
            random.standard_normal((N, PIECES, SIDES, 3)), random.standard_normal((N, PIECES, SIDES))
        ),
        random.standard_normal(STATES) * 0.1,
    )


def filled(
    pattern: QpPattern, parts: Parts, values: QpValues | None = None, *, rows_scaled: bool = False
) -> QpValues:
    values = values or empty_values(pattern)
    scaled_from = ROW_SCALING_FROM if rows_scaled else 1e9
    stages = PlanStages(parts.states, parts.controls, parts.lengths)
    problem = HorizonProblem(stages, parts.cost, parts.step, parts.bounds, parts.rows, FIXED_END)
    fill(values, pattern, problem, FillOptions(SLACK, SCALE, 0.0, IDLE_WEIGHT, scaled_from))
    fill_initial(values, pattern, parts.initial)
    return values


class Dense(NamedTuple):
    p: Array
    q: Array
    a: Array
    lower: Array
    upper: Array


def dense(parts: Parts) -> Dense:
    """Variables dz_0..dz_N, du_0..du_{N-1}, slacks; everything divided by its unit at the end."""
    z = [slice(6 * k, 6 * k + 6) for k in range(N + 1)]
    u = [slice(6 * (N + 1) + 3 * k, 6 * (N + 1) + 3 * k + 3) for k in range(N)]
    s = [6 * (N + 1) + 3 * N + k for k in range(N)]
    n = s[-1] + 1
    p, q = np.zeros((n, n)), np.zeros(n)
    for k in range(N + 1):
        p[z[k], z[k]], q[z[k]] = parts.cost.state_hessian[k], parts.cost.state_gradient[k]
    for k in range(N):
        p[u[k], u[k]], q[u[k]] = np.diag(parts.cost.control_hessian[k]), parts.cost.control_gradient[k]
        q[s[k]] = SLACK
    rows: list[tuple[Array, float, float, float]] = []  # row, lower, upper, unit

    def row(entries: list[tuple[slice | int, Array | float]], low: float, up: float, unit: float) -> None:
        line = np.zeros(n)
        for where, what in entries:
            line[where] += what
        rows.append((line, low, up, unit))

    one = np.eye(STATES)
    for i in range(STATES):
        row([(z[0], one[i])], parts.initial[i], parts.initial[i], STATE_UNITS[i])
    for k in range(N):
        for i in range(STATES):
            defect = parts.states[k + 1, i] - parts.step.state[k, i]
            slopes = [(z[k], by_state(parts.step)[k, i]), (u[k], by_control(parts.step, parts.lengths)[k, i])]
            row([*slopes, (z[k + 1], -one[i])], defect, defect, STATE_UNITS[i])
    for k in range(N):
        for j, i in enumerate(BOUNDED):
            low, up = parts.bounds.states[k, :, j] - parts.states[k + 1, i]
            row([(z[k + 1], one[i])], low, up, BOUND_UNIT * STATE_UNITS[i])
    for k in range(N):
        for i in range(CONTROLS):
            low, up = parts.bounds.controls[k, :, i] - parts.controls[k, i]
            row([(u[k], np.eye(CONTROLS)[i])], low, up, BOUND_UNIT * CONTROL_UNITS[i])
    for k in range(N):
        for piece in range(PIECES):
            for side in range(SIDES):
                pose = np.append(parts.rows.slopes[k, piece, side], np.zeros(3))
                row([(z[k + 1], pose), (s[k], 1.0)], parts.rows.lower[k, piece, side], np.inf, 1.0)
    for k in range(N):
        row([(s[k], 1.0)], 0.0, np.inf, SLACK_UNIT)

    units = np.concatenate([np.tile(STATE_UNITS, N + 1), np.tile(CONTROL_UNITS, N), np.full(N, SLACK_UNIT)])
    lines, low, up, unit = (np.array(column) for column in zip(*rows, strict=True))
    p = SCALE * p * units * units[:, None] + CHANGE_WEIGHT * np.eye(n)
    return Dense(p, SCALE * q * units, lines * units / unit[:, None], low / unit, up / unit)


def whole(pattern: QpPattern, values: QpValues) -> Array:
    upper = pattern.cost_matrix(values.cost).toarray()
    assert not np.tril(upper, -1).any(), "P holds its upper triangle only"
    return np.asarray(upper + np.triu(upper, 1).T)


@pytest.fixture
def pattern() -> QpPattern:
    return build_pattern(N, PIECES, SIDES)


def test_the_sparse_qp_is_the_dense_one(pattern: QpPattern) -> None:
    parts = drawn()
    values, expected = filled(pattern, parts), dense(parts)
    np.testing.assert_allclose(whole(pattern, values), expected.p, atol=1e-12)
    np.testing.assert_allclose(values.gradient, expected.q, atol=1e-12)
    np.testing.assert_allclose(
        pattern.constraint_matrix(values.constraints).toarray(), expected.a, atol=1e-12
    )
    np.testing.assert_allclose(values.lower, expected.lower, atol=1e-12)
    np.testing.assert_allclose(values.upper, expected.upper, atol=1e-12)


def test_rows_count_less_the_farther_their_bounds_are(pattern: QpPattern) -> None:
    """The same rows divided by their ease, which is 1 where a bound is near."""
    parts = drawn()
    plain, rows_scaled = filled(pattern, parts), filled(pattern, parts, rows_scaled=True)
    rows = [*pattern.bound_rows, pattern.corridor_rows]
    row_scaling = rows_scaled.row_scaling[np.concatenate([each.ravel() for each in rows])]
    assert row_scaling.min() == 1.0
    assert np.median(row_scaling) > 2.0
    for name in ("lower", "upper"):
        np.testing.assert_allclose(
            getattr(rows_scaled, name) * rows_scaled.row_scaling, getattr(plain, name), rtol=1e-12
        )
    matrices = [pattern.constraint_matrix(values.constraints).toarray() for values in (plain, rows_scaled)]
    np.testing.assert_allclose(matrices[1] * rows_scaled.row_scaling[:, None], matrices[0], atol=1e-12)
    beyond = np.minimum(-plain.lower, plain.upper)
    expected = np.where(beyond > ROW_SCALING_FROM, beyond / ROW_SCALING_FROM, 1.0)
    inequalities = np.isin(np.arange(len(beyond)), np.concatenate([each.ravel() for each in rows]))
    np.testing.assert_allclose(rows_scaled.row_scaling, np.where(inequalities, expected, 1.0))


def test_filling_again_leaves_nothing_of_the_last_numbers(pattern: QpPattern) -> None:
    values = filled(pattern, drawn(frenet=False, seed=1))
    refilled, fresh = filled(pattern, drawn(seed=2), values), filled(pattern, drawn(seed=2))
    for name in ("cost", "gradient", "constraints", "lower", "upper"):
        np.testing.assert_array_equal(getattr(refilled, name), getattr(fresh, name))


def test_where_no_frenet_cost_acts_progress_keeps_its_plan(pattern: QpPattern) -> None:
    parts = drawn(frenet=False)
    got, expected = whole(pattern, filled(pattern, parts)), dense(parts).p
    columns = [*pattern.state_columns[:, THETA], *pattern.control_columns[:, THETA_DOT]]
    expected[columns, columns] += IDLE_WEIGHT
    np.testing.assert_allclose(got, expected, atol=1e-12)


@pytest.mark.parametrize("left", range(SIDES))
@pytest.mark.parametrize("lower", [-0.5, -7.0])
def test_sides_without_half_planes_are_loose_and_slopeless(lower: float, left: int) -> None:
    """Also behind rows so far off that their scaled bounds are those of loose ones."""
    pattern, parts = build_pattern(N, PIECES, SIDES), drawn()
    before = parts.rows._replace(lower=np.full_like(parts.rows.lower, lower))
    after = CorridorRows(before.slopes[:, :, :left].copy(), before.lower[:, :, :left].copy())
    values = filled(pattern, parts._replace(rows=before), rows_scaled=True)
    parts = parts._replace(rows=after if left else NO_ROWS)
    values, fresh = (filled(pattern, parts, each, rows_scaled=True) for each in (values, None))
    for name in ("constraints", "lower", "row_scaling"):
        np.testing.assert_array_equal(getattr(values, name), getattr(fresh, name))
    rows = pattern.corridor_rows[:, :, left:]
    np.testing.assert_allclose((values.lower * values.row_scaling)[rows], LOOSE)
    slopes = pattern.constraint_matrix(values.constraints).toarray()[rows.ravel()]
    slopes[:, pattern.slack_columns] = 0.0
    assert not slopes.any()
