"""Dead time and lag of an actuator from a whole drive, by nonlinear least squares.

(A1) and (A2) of `estimation.actuator_bank` with T and tau as real numbers. The drive is cut into windows:
each has its own c0 and c1, as a slope does not last, all have the same c2. They follow from a linear least
squares for each T and tau. `scipy.optimize.least_squares` finds T and tau, from the best point of a grid.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from estimation.actuator_bank import Scale, answers
from estimation.types import Array

WINDOW = 6.0
"""Length of a window [s]: over it a slope is as good as constant."""
LONGEST = (1.0, 1.0)
"""Largest dead time and lag [s]."""
LEAST_MOTION = 20.0
"""Times `Scale.least`: what has to be commanded and measured at least to fit anything."""
_GRID: Final = (np.linspace(0.0, 0.6, 7), np.array((0.01, 0.1, 0.2, 0.4, 0.7)))
_OUTLIER = 3.0  # standard deviations from which on residuals count less


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Drive:
    """What was commanded and measured of one quantity.

    Attributes:
        stamps: (n,) of the cycles [s], each with one measurement and one command; measured: (n,) [m/s] or
            [rad]; rates: (n,) commanded [m/s²] or [rad/s]; setpoints: (n,) [m/s] or [rad].
    """

    stamps: Array
    measured: Array
    rates: Array
    setpoints: Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ActuatorFit:
    """The model of an actuator that explains a drive best.

    Attributes:
        dead_time, lag: [s]; stds: standard deviations of both [s]; gain: 1 + c2.
        by_setpoints: the actuator obeys set-points, not rates.
        rms: what the model leaves unexplained, root mean square [m/s] or [rad]; rms_without: the same without
            dead time and lag.
        predicted: (n,) the measured quantity by the model.
    """

    dead_time: float
    lag: float
    stds: tuple[float, float]
    gain: float
    by_setpoints: bool
    rms: float
    rms_without: float
    predicted: Array


def fitted(drive: Drive, scale: Scale) -> ActuatorFit | None:
    """The best model of a drive; None where too little was commanded or measured."""
    least = LEAST_MOTION * scale.least
    asked = np.cumsum(drive.rates[:-1] * np.diff(drive.stamps)) if len(drive.stamps) > 1 else np.zeros(1)
    if len(drive.stamps) < 20 or min(np.ptp(drive.measured), np.ptp(asked)) < least:
        return None
    return min((_fit(drive, by_setpoints) for by_setpoints in (False, True)), key=lambda each: each.rms)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def _detrended(values: Array, stamps: Array) -> Array:
    """Values without their mean and slope over time."""
    t = stamps - stamps.mean()
    centred = values - values.mean()
    return np.asarray(centred - (centred @ t) / (t @ t) * t)


def _fit(drive: Drive, by_setpoints: bool) -> ActuatorFit:
    """The best model of one interface."""
    from scipy.optimize import least_squares  # here: it takes long to import, and a control loop needs none

    m, t = drive.measured, drive.stamps
    sent = np.stack([t, drive.rates, drive.setpoints], axis=1)
    first = np.array([[0.0], drive.setpoints[:1], drive.rates[:1]])
    windows = ((t - t[0]) // WINDOW).astype(int)
    parts = [np.flatnonzero(windows == each) for each in np.unique(windows)]
    parts = [each for each in parts if len(each) > 4]

    def explained(model: Array) -> tuple[Array, float]:
        """(n,) what (A2) with (T, tau) leaves of the windows, and 1 + c2."""
        y = np.interp(t - model[0], t, answers(sent, first, model[1:])[:, int(by_setpoints), 0])
        pairs = [(_detrended(m[part], t[part]), _detrended(y[part], t[part])) for part in parts]
        ms, ys = (np.concatenate(each) for each in zip(*pairs, strict=True))
        gain = float(ms @ ys) / max(float(ys @ ys), 1e-12)
        return ms - gain * ys, gain

    def left(model: Array) -> Array:
        return explained(model)[0]

    grid = [np.array((dead, lag)) for dead in _GRID[0] for lag in _GRID[1]]
    start = min(grid, key=lambda each: float(np.square(left(each)).sum()))
    found = least_squares(
        left,
        start,
        bounds=((0.0, 1e-3), LONGEST),
        loss="soft_l1",
        f_scale=_OUTLIER * (_rms(left(start)) + 1e-9),
        diff_step=(1e-3, 1e-3),
        x_scale=(0.1, 0.1),
    )
    residuals, gain = explained(found.x)
    jacobian = np.asarray(found.jac, dtype=np.float64)
    information = jacobian.T @ jacobian / max(float(np.mean(np.square(residuals))), 1e-18)
    dead_time_std, lag_std = np.sqrt(np.diag(np.linalg.pinv(information)).clip(0.0)).tolist()
    predicted = m.copy()
    predicted[np.concatenate(parts)] -= residuals
    return ActuatorFit(
        dead_time=float(found.x[0]),
        lag=float(found.x[1]),
        stds=(dead_time_std, lag_std),
        gain=gain,
        by_setpoints=by_setpoints,
        rms=_rms(residuals),
        rms_without=_rms(left(np.array((0.0, 1e-3)))),
        predicted=predicted,
    )
