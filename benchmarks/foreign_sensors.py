"""Sensors with faults, for `benchmarks.foreign`.

A `Faulty` sensor measures the truth with noise, and changes it from `begin` on.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from math import cos, inf, sin

import numpy as np

from benchmarks.foreign import Array, at_time, state_of
from rti_mpcc import VehicleState

Fault = Callable[[VehicleState, Array, Array], VehicleState]
"""Measurement, true states so far (k, 6), true row (6,) when the fault began: gives what is measured."""
NOISE = (0.01, 0.01, 0.002, 0.01, 0.002)
"""Standard deviations of x, y [m], heading [rad], speed [m/s] and steering [rad] of a noisy sensor."""


NAMES = ("x", "y", "phi", "v", "delta")
VISIBLE = (0.05, 0.05, 0.02, 0.03, 0.04)
"""A measurement farther off than this shows its fault. Of a pose only what has changed within `SEEN_OVER`
counts: an offset that stays as it is cannot be seen."""
SEEN_OVER = 40  # cycles


@dataclass(slots=True)
class Faulty:
    """A sensor with a fault from `begin` [s] on; `noise`: standard deviations (5,), or None.

    One ride, one sensor: it keeps the true row of the fault's begin, and for each cycle whether the fault can
    be seen, `wrong`.
    """

    fault: Fault
    begin: float = 0.0
    noise: tuple[float, ...] | None = None
    row: Array | None = None
    last: VehicleState | None = None
    wrong: list[bool] = field(default_factory=list)
    off: list[Array] = field(default_factory=list)

    def __call__(self, history: Array, rng: np.random.Generator) -> VehicleState:
        """As a `benchmarks.foreign.Sensor`."""
        measured = state_of(history[-1])
        if history[-1, 0] >= self.begin - 1e-9:
            self.row = history[-1] if self.row is None else self.row
            measured = self.fault(measured, history, self.row)
        true = state_of(history[-1])
        self.off.append(np.array([getattr(measured, name) - getattr(true, name) for name in NAMES]))
        off = self.off[-1].copy()
        off[:3] -= self.off[-SEEN_OVER:][0][:3]
        self.wrong.append(bool((np.abs(off) > VISIBLE).any()))
        if self.noise is None:
            return measured
        if self.fault is frozen and self.row is not None and self.last is not None:
            return self.last  # to the last bit
        noise = rng.normal(0.0, self.noise).tolist()
        changed = {n: getattr(measured, n) + e for n, e in zip(NAMES, noise, strict=True)}
        self.last = replace(measured, **changed)
        return self.last


def healthy(measured: VehicleState, history: Array, began: Array) -> VehicleState:
    """No fault."""
    return measured


def frozen(measured: VehicleState, history: Array, began: Array) -> VehicleState:
    """The whole state as it was at the fault's begin."""
    return state_of(began)


def misread(**fields: Callable[[VehicleState, VehicleState], float]) -> Fault:
    """Some fields by what is measured, and by the true state at the fault's begin."""

    def fault(measured: VehicleState, history: Array, began: Array) -> VehicleState:
        before = state_of(began)
        return replace(measured, **{name: value(measured, before) for name, value in fields.items()})

    return fault


unsigned_speed = misread(v=lambda measured, _: abs(measured.v))
dead_speed = misread(v=lambda *_: 0.0)
stuck_speed = misread(v=lambda _, before: before.v)
frozen_motion = misread(
    x=lambda _, before: before.x, y=lambda _, before: before.y, v=lambda _, before: before.v
)
inverted_steering = misread(delta=lambda measured, _: -measured.delta)
stuck_steering = misread(delta=lambda _, before: before.delta)


def scaled_speed(share: float) -> Fault:
    """Speed times a share."""
    return misread(v=lambda measured, _: share * measured.v)


def dead_band(least: float) -> Fault:
    """Speed 0 below the least that is measured [m/s]."""
    return misread(v=lambda measured, _: measured.v * (abs(measured.v) >= least))


def offset_steering(angle: float) -> Fault:
    """Steering with an offset [rad]."""
    return misread(delta=lambda measured, _: measured.delta + angle)


def pose_of(ahead: float) -> Fault:
    """The pose of a point so far ahead of the rear axle [m]."""
    return misread(
        x=lambda measured, _: measured.x + ahead * cos(measured.phi),
        y=lambda measured, _: measured.y + ahead * sin(measured.phi),
    )


def late_speed(seconds: float) -> Fault:
    """Speed some time ago [s]."""
    return lambda measured, history, began: replace(measured, v=float(at_time(history, seconds)[4]))


def late_pose(seconds: float) -> Fault:
    """The pose some time ago [s]."""

    def fault(measured: VehicleState, history: Array, began: Array) -> VehicleState:
        _, x, y, phi, _, _ = map(float, at_time(history, seconds))
        return replace(measured, x=x, y=y, phi=phi)

    return fault


def jumping_pose(distance: float, period: float = 4.0, share: float = 0.25) -> Fault:
    """A position that is off by a distance [m] to one side for a share of each period [s]."""

    def fault(measured: VehicleState, history: Array, began: Array) -> VehicleState:
        now = float(history[-1, 0] - began[0])
        if now % period < (1.0 - share) * period:
            return measured
        angle = 2.4 * (now // period)
        return replace(measured, x=measured.x + distance * cos(angle), y=measured.y + distance * sin(angle))

    return fault


def drifting_pose(speed: float, angle: float, seconds: float = inf) -> Fault:
    """A position that drifts at a speed [m/s] in a direction of the world [rad], for a time [s]."""

    def fault(measured: VehicleState, history: Array, began: Array) -> VehicleState:
        far = speed * min(float(history[-1, 0] - began[0]), seconds)
        return replace(measured, x=measured.x + far * cos(angle), y=measured.y + far * sin(angle))

    return fault
