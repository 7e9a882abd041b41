"""(A1) by another integrator, (A2) by a dense least squares, (A3) by a dense determinant."""

from __future__ import annotations

import numpy as np
import pytest

from estimation.actuator_bank import DRIVE, GAIN_STD, LAGS, STEERING, Scale, answers, residuals
from estimation.types import Array

VARIANCE = 1e-5
DEAD_TIMES = np.array((0.0, 0.1, 0.25))


def commands(count: int = 60) -> Array:
    """(c, 3) times that are not even, rates and set-points."""
    rng = np.random.default_rng(7)
    stamps = np.cumsum(rng.uniform(0.03, 0.08, count))
    rates = np.where(np.arange(count) // 12 % 2, -0.4, 0.5) + 0.1 * rng.standard_normal(count)
    return np.column_stack((stamps, rates, np.cumsum(rates) * 0.05))


@pytest.mark.parametrize("column", [0, 1], ids=["rates", "set-points"])
def test_the_answer_of_a_lag_is_the_integrated_one(column: int) -> None:
    sent, steps = commands(), 400
    found = answers(sent, np.zeros((3, len(LAGS))), LAGS)
    for i in (3, 8):
        w, total = 0.0, 0.0
        for c in range(1, len(sent)):
            h = (sent[c, 0] - sent[c - 1, 0]) / steps
            for _ in range(steps):
                change = (sent[c - 1, 1 + column] - w) / LAGS[i]
                total += h * (w + 0.5 * h * change)
                w += h * change * (1.0 - 0.5 * h / LAGS[i])
            expected = w if column else total
            assert found[c, column, i] == pytest.approx(expected, rel=1e-4, abs=1e-6)


def dense(measured: Array, y: Array | None, stds: Array, drives: bool) -> tuple[float, float]:
    """Least mean square of (A2), the priors as rows of one least squares; ln det of (A3)."""
    stamps, m, heading = measured.T
    t = stamps - stamps.mean()
    courses = [np.ones(len(t)), t]
    if drives:
        acting = (np.cos(heading), np.sin(heading), m)
        steps = [0.5 * (a[1:] + a[:-1]) * np.diff(t) for a in acting]
        integrals = [np.concatenate(((0.0,), np.cumsum(step))) for step in steps]
        courses += [each - each.mean() for each in integrals]
    else:
        courses.append(0.5 * t**2)
    if y is not None:
        courses.append(y)
        m, stds = m - y, np.append(stds, GAIN_STD)
    unknowns = np.array(courses)
    rows = np.vstack((unknowns.T, np.diag(np.sqrt(VARIANCE) / stds)))
    right = np.append(m, np.zeros(len(stds)))
    solution = np.linalg.lstsq(rows, right)[0]
    scaled = stds[:, None] * unknowns
    spread = np.eye(len(stamps)) + scaled.T @ scaled / VARIANCE
    return float(np.square(right - rows @ solution).sum() / len(stamps)), float(np.linalg.slogdet(spread)[1])


@pytest.mark.parametrize("scale", [DRIVE, STEERING], ids=["drive", "steering"])
def test_what_a_model_leaves_is_that_of_a_dense_least_squares(scale: Scale) -> None:
    rng, sent = np.random.default_rng(3), commands()
    driven = answers(sent, np.zeros((3, len(LAGS))), LAGS)
    stamps = np.arange(sent[0, 0] + 0.4, sent[-1, 0], 0.05)
    moves = np.interp(stamps - 0.15, sent[:, 0], driven[:, 0, 4]) + 0.003 * rng.standard_normal(len(stamps))
    measured = np.column_stack((stamps, moves, 0.3 * np.sin(stamps)))
    found, prices, alone = residuals(sent[:, 0].copy(), driven, measured, DEAD_TIMES, VARIANCE, scale)
    for of in range(2):
        assert alone[of] == pytest.approx(dense(measured, None, scale.stds[of], scale.drives)[0], rel=1e-6)
        for d, dead_time in enumerate(DEAD_TIMES):
            for i in range(len(LAGS)):
                y = np.interp(stamps - dead_time, sent[:, 0], driven[:, of, i])
                expected = dense(measured, y, scale.stds[of], scale.drives)
                assert (found[of, d, i], prices[of, d, i]) == pytest.approx(expected, rel=1e-6)
