"""Models of an actuator with dead time T and lag tau: driven by commands, compared with measurements.

With the commands u, rates or set-points, and the measured quantity m, speed or steering:

(A1)  tau dw/dt = u(t - T) - w,   Y = integral of w, of set-points w itself
(A2)  m = c0 + c1 t + c B + (1 + c2) Y + noise,   least squares over the last seconds
(A3)  -2 ln p(m) = n ln(what (A2) leaves) + ln det(1 + A S A^T / s²),   but for a constant

c0 is where it starts, c1 what else acts evenly, c2 what the actuator answers too strongly, and B the courses
of what acts otherwise. On a drive these are a slope, by the heading phi, and a drag or a creep torque, by the
speed: the integrals of cos(phi), sin(phi) and m. On a steering it is an even change, t² / 2. None of that is
lag. Each coefficient has a prior: S are their variances, A the courses and Y, s² the variance of the noise.
The determinant is the price of what a model may explain by them: rates explain an uneven ride by slope and
drag, set-points hardly, as a control loop for them rejects both.
"""

from __future__ import annotations

from math import cos, exp, log, sin, sqrt
from typing import Final, NamedTuple

import numpy as np

from estimation.types import Array
from geometry.arrays import locked
from geometry.compiled import Array1, Array2, Array3, Out1, Out2, Out3, copy_row, copy_rows, inner, kernel

LAGS: Final = np.array((1e-3, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5, 0.6, 0.75))
"""Of the bank [s]; the first one stands for none, the last one for more."""
AT, RATE, SETPOINT = range(3)
"""Of a command: when it was sent [s], a rate [m/s²] or [rad/s], and a set-point [m/s] or [rad]."""
VALUE, HEADING = 1, 2
"""Of a measurement, after its time [s]: speed [m/s] or steering [rad], and the heading [rad] then."""
GAIN_STD = 0.07  # prior of c2
REJECTED = 0.1  # of a slope, what a control loop for set-points leaves
ANYWHERE = 100.0  # times the offset of set-points: rates say nothing of where the actuator is


class Scale(NamedTuple):
    """Of speed or steering: models that explain it better by `least` [m/s], [rad] only change nothing.

    `stds`: (2, 2 + len(c)) of c0, c1 and c, of rates and of set-points. `drives`: slope and drag act on it.
    """

    least: float
    stds: Array2
    drives: bool


def _stds(offset: float, others: tuple[float, ...]) -> Array:
    """Those of a `Scale`: `offset` of c0 [m/s], [rad] of set-points, `others` of c1 [m/s²], [rad/s] and c."""
    every = np.array(others)
    return locked(np.array(((ANYWHERE * offset, *every), (offset, *(REJECTED * every)))))


DRIVE: Final = Scale(0.002, _stds(0.01, (0.15, 0.15, 0.15, 0.1)), drives=True)
STEERING: Final = Scale(0.001, _stds(0.03, (0.02, 0.01)), drives=False)


@kernel
def answers(sent: Array2, first: Array2, lags: Array1) -> Out3:
    """(c, 3, lags) Y of (A1) of rates and of set-points, and w of the rates, without dead time.

    `sent`: (c, 3) commands; `first`: (3, lags) the answers at the first of them; `lags`: [s].
    """
    found = np.empty((len(sent), 3, len(lags)))
    copy_rows(first, found[0])
    for c in range(1, len(sent)):
        seconds, rate, setpoint = sent[c, AT] - sent[c - 1, AT], sent[c - 1, RATE], sent[c - 1, SETPOINT]
        for i in range(len(lags)):
            left = exp(-seconds / lags[i])
            over = found[c - 1, 2, i] - rate
            found[c, 0, i] = found[c - 1, 0, i] + rate * seconds + over * lags[i] * (1.0 - left)
            found[c, 1, i] = setpoint + (found[c - 1, 1, i] - setpoint) * left
            found[c, 2, i] = rate + over * left
    return found


@kernel
def residuals(
    stamps: Array1, answers: Array3, measured: Array2, dead_times: Array1, variance: float, scale: Scale
) -> tuple[Out3, Out3, Out1]:
    """(2, dead times, lags) mean squares of what (A2) leaves, of rates and set-points, with priors, and the
    ln det of (A3); and (2,) of what (A2) leaves without Y, where nothing answers.

    By its normal equations: the courses first, then what they leave of m and of each Y.
    `stamps`: (c,) of the `answers` (c, 3, lags) [s]; `measured`: (m, 3); `variance`: of the noise.
    """
    lags = answers.shape[2]
    models = np.empty((2, len(dead_times), lags))
    prices, alone, price = np.empty_like(models), np.empty(2), np.zeros(2)
    stds = scale.stds
    count, k = len(measured), stds.shape[1]
    rows = np.empty((k + 1, count))  # the courses, and m
    _fill_courses(measured, scale.drives, rows)
    gram = np.zeros((k + 1, k + 1))
    for a in range(k + 1):
        for b in range(a + 1):
            for j in range(count):
                gram[a, b] += rows[a, j] * rows[b, j]
            gram[b, a] = gram[a, b]
    lower, products = np.empty((2, k, k)), np.empty((2 * lags, k + 2))
    along_m = np.empty((2, k))
    for of in range(2):
        copy_row(gram[k], along_m[of])
        copy_rows(gram, lower[of])
        for a in range(k):
            lower[of, a, a] += variance / stds[of, a] ** 2
        _decompose(lower[of])
        for a in range(k):
            price[of] += log((lower[of, a, a] * stds[of, a]) ** 2 / variance)
        alone[of] = (gram[k, k] - _solve(lower[of], along_m[of], along_m[of])) / count
    for d in range(len(dead_times)):
        _multiply(stamps, answers, measured, rows, dead_times[d], products)
        for of in range(2):
            for i in range(lags):
                along_y = products[of * lags + i]
                my = along_y[k] - _solve(lower[of], along_y, along_m[of])
                yy = along_y[k + 1]
                for a in range(k):
                    yy -= along_y[a] ** 2
                by_gain = (my - yy) ** 2 / (yy + variance / GAIN_STD**2)
                models[of, d, i] = alone[of] + (yy - 2.0 * my - by_gain) / count
                prices[of, d, i] = price[of] + log(1.0 + yy * GAIN_STD**2 / variance)
    return models, prices, alone


@inner
def _fill_courses(measured: Array2, drives: bool, rows: Out2) -> None:
    """The courses of c0, c1 and c of (A2), all but the first without their means, and m."""
    count = len(measured)
    for j in range(count):
        rows[0, j], rows[1, j], rows[-1, j] = 1.0, measured[j, AT], measured[j, VALUE]
    _centre(rows[1])
    if not drives:
        for j in range(count):
            rows[2, j] = 0.5 * rows[1, j] ** 2
        return
    for c in range(2, 5):
        rows[c, 0] = 0.0
    for j in range(1, count):
        half = 0.5 * (measured[j, AT] - measured[j - 1, AT])
        then, now = measured[j - 1, HEADING], measured[j, HEADING]
        rows[2, j] = rows[2, j - 1] + half * (cos(then) + cos(now))
        rows[3, j] = rows[3, j - 1] + half * (sin(then) + sin(now))
        rows[4, j] = rows[4, j - 1] + half * (measured[j - 1, VALUE] + measured[j, VALUE])
    for c in range(2, 5):
        _centre(rows[c])


@inner
def _centre(row: Out1) -> None:
    mean = row.mean()
    for j in range(len(row)):
        row[j] -= mean


@inner
def _decompose(matrix: Out2) -> None:
    """The lower triangle L of a positive definite matrix L L^T, in its place (Cholesky)."""
    for i in range(len(matrix)):
        for j in range(i + 1):
            for a in range(j):
                matrix[i, j] -= matrix[i, a] * matrix[j, a]
            matrix[i, j] = sqrt(matrix[i, i]) if i == j else matrix[i, j] / matrix[j, j]


@inner
def _solve(lower: Array2, b: Out1, other: Array1) -> float:
    """Puts L^-1 b in the place of b. Returns its scalar product with another one, which may be itself."""
    product = 0.0
    for i in range(len(lower)):
        for j in range(i):
            b[i] -= lower[i, j] * b[j]
        b[i] /= lower[i, i]
        product += b[i] * other[i]
    return product


@inner
def _multiply(
    stamps: Array1, answers: Array3, measured: Array2, rows: Array2, dead_time: float, products: Out2
) -> None:
    """Scalar products (models, k + 2) of Y of (A2) with the `rows` (k + 1, m), and with itself.

    The answers are those at the `stamps`, with straight lines in between.
    """
    sums = np.zeros((products.shape[1], len(products)))
    y = np.empty(len(products))
    after, lags = 1, answers.shape[2]
    for j in range(len(measured)):
        due = measured[j, AT] - dead_time
        while after < len(stamps) - 1 and stamps[after] < due:
            after += 1
        share = min(max((due - stamps[after - 1]) / (stamps[after] - stamps[after - 1]), 0.0), 1.0)
        for of in range(2):
            for i in range(lags):
                then, now = answers[after - 1, of, i], answers[after, of, i]
                y[of * lags + i] = then + share * (now - then)
        for row in range(len(rows)):
            for i in range(len(y)):
                sums[row, i] += rows[row, j] * y[i]
        for i in range(len(y)):
            sums[-1, i] += y[i] * y[i]
    for i in range(len(products)):
        for row in range(len(sums)):
            products[i, row] = sums[row, i]
