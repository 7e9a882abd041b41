"""The simulated truth: a kinematic bicycle behind actuators with dead time.

Plant and controller share no code. The plant cuts time wherever an actuator switches (a command takes effect,
the steering reaches its stop, a fault comes or goes, weak brakes have done their work); between cuts
acceleration a and steering rate r are constant, so that

    v(t) = v0 + (a + d) t,    delta(t) = delta0 + r t                               (1)

hold in closed form (d is a constant offset, a slope say, that always acts), and heading and position are
integrals of known functions, one after the other:

    phi(t) = phi0 + integral of v tan(delta + offset) / L                           (2)
    x(t) = x0 + integral of v cos(phi),    y(t) = y0 + integral of v sin(phi)       (3)

Both are taken by Gauss-Legendre collocation with three nodes (order 6), explicit here because (3) needs (2)
at the nodes only.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import copysign, exp, inf, isfinite, prod
from typing import Any

import numpy as np

from geometry import Pose2
from rti_mpcc.config import Limits, Vehicle
from rti_mpcc.errors import InputError
from rti_mpcc.types import VehicleState

_ROOT = np.sqrt(15.0)
_NODES = np.array([0.5 - _ROOT / 10.0, 0.5, 0.5 + _ROOT / 10.0])
_WEIGHTS = np.array([5.0, 8.0, 5.0]) / 18.0
# Integrals of the Lagrange polynomials on the nodes from 0 to each node.
_TO_NODES = np.array(
    [
        [5.0 / 36.0, 2.0 / 9.0 - _ROOT / 15.0, 5.0 / 36.0 - _ROOT / 30.0],
        [5.0 / 36.0 + _ROOT / 24.0, 2.0 / 9.0, 5.0 / 36.0 - _ROOT / 24.0],
        [5.0 / 36.0 + _ROOT / 30.0, 2.0 / 9.0 + _ROOT / 15.0, 5.0 / 36.0],
    ]
)
_LONGEST_STEP = 0.05  # of integration [s]; at 10 m/s and full steering its error is below 1e-9 m
_LAG_STEP = 0.005  # the same where actuators lag: over it acceleration and steering rate are constant
SAME_TIME = 1e-9
"""Instants nearer than this [s] are the same: products of cycle and step counts differ by rounding."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlantFault:
    """Actuators that do less than commanded from `begin` until before `end` [s]; shares multiply."""

    begin: float
    end: float
    steering_share: float = 1.0  # of the steering rate; 0: the steering is stuck
    braking_share: float = 1.0  # of an acceleration against the motion, > 0; at a standstill all of it acts


@dataclass(frozen=True, slots=True, kw_only=True)
class PlantParameters:
    """The true vehicle; the controller knows neither the errors nor the gain."""

    wheelbase: float  # [m]
    steering_limit: float  # mechanical stop of the measured steering angle [rad]
    steering_rate_limit: float  # the actuators saturate there [rad/s]
    acceleration_limit: float  # likewise [m/s²]
    dead_time: float = 0.0  # of both actuators [s]
    drive_lag: float = 0.0  # of first order [s]
    steering_lag: float = 0.0  # likewise
    steering_offset: float = 0.0  # the wheels stand at delta + offset [rad]
    acceleration_gain: float = 1.0  # true over commanded acceleration
    acceleration_offset: float = 0.0  # is added to the acceleration [m/s²]
    faults: tuple[PlantFault, ...] = ()

    @classmethod
    def of(
        cls, vehicle: Vehicle, limits: Limits, *, wheelbase_error: float = 0.0, **others: Any
    ) -> PlantParameters:
        """The plant of a vehicle; `wheelbase_error` is relative, `others` are attributes."""
        return cls(
            wheelbase=vehicle.wheelbase * (1.0 + wheelbase_error),
            steering_limit=limits.steering,
            steering_rate_limit=limits.steering_rate,
            acceleration_limit=limits.acceleration,
            **others,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class PlantState:
    """The truth at one instant."""

    time: float = 0.0  # [s]
    x: float  # of the rear axle [m]
    y: float  # likewise [m]
    phi: float  # heading, continuous [rad]
    v: float = 0.0  # speed [m/s]
    delta: float = 0.0  # steering angle as measured [rad]
    acceleration: float = 0.0  # that acts [m/s²]
    steering_rate: float = 0.0  # that acts [rad/s]
    wanted: tuple[float, float] | None = None  # both as commanded; None: as they act
    # (From time [s], both as commanded), in order.
    pending: tuple[tuple[float, tuple[float, float]], ...] = ()

    @property
    def pose(self) -> Pose2:
        """Of the rear axle."""
        return Pose2(self.x, self.y, self.phi)

    @property
    def measured(self) -> VehicleState:
        """The state by sensors without noise."""
        return VehicleState(x=self.x, y=self.y, phi=self.phi, v=self.v, delta=self.delta)


def issue(
    plant: PlantState,
    parameters: PlantParameters,
    *,
    acceleration: float,
    steering_rate: float,
    delay: float = 0.0,
) -> PlantState:
    """Send a command [m/s²], [rad/s] at the plant's present time; it takes effect one dead time later.

    A command `delay` [s] late may arrive after younger ones. Raises InputError if a value is not finite.
    """
    for name, value in (("acceleration", acceleration), ("steering_rate", steering_rate)):
        if not isfinite(value):
            raise InputError(f"command.{name} = {value}: must be a finite number")
    acceleration = _clip(acceleration, parameters.acceleration_limit) * parameters.acceleration_gain
    steering_rate = _clip(steering_rate, parameters.steering_rate_limit)
    begin = plant.time + parameters.dead_time + delay
    place = sum(time <= begin + SAME_TIME for time, _ in plant.pending)
    queued = begin, (acceleration, steering_rate)
    return replace(plant, pending=(*plant.pending[:place], queued, *plant.pending[place:]))


def advance(plant: PlantState, parameters: PlantParameters, until: float) -> PlantState:
    """The plant at time `until` [s] (not before its own time), cut wherever an actuator switches."""
    longest = _LAG_STEP if parameters.drive_lag or parameters.steering_lag else _LONGEST_STEP
    while True:
        if due := [wanted for time, wanted in plant.pending if time <= plant.time + SAME_TIME]:
            plant = replace(plant, wanted=due[-1], pending=plant.pending[len(due) :])
        if until - plant.time <= SAME_TIME:
            return _following(plant, parameters, 0.0)
        switch = plant.pending[0][0] if plant.pending else inf
        steering_share, braking_share, change = _shares(plant, parameters)
        acting, offset = _following(plant, parameters, 0.5 * longest), parameters.acceleration_offset
        acceleration, standstill = _acceleration_until_standstill(acting, offset, braking_share)
        rate, stop = _steering_until_stop(acting, parameters, steering_share)
        end = min(until, switch, change, standstill, stop, plant.time + longest)
        plant = _following(plant, parameters, end - plant.time)
        plant = _integrate(plant, parameters, acceleration, rate, end, at_stop=end == stop)


def _following(plant: PlantState, parameters: PlantParameters, seconds: float) -> PlantState:
    """Acceleration and steering rate so much later, at the same place: they follow the command."""
    if plant.wanted is None:
        return plant
    acceleration = _lagged(plant.acceleration, plant.wanted[0], seconds, parameters.drive_lag)
    rate = _lagged(plant.steering_rate, plant.wanted[1], seconds, parameters.steering_lag)
    return replace(plant, acceleration=acceleration, steering_rate=rate)


def _lagged(value: float, towards: float, seconds: float, lag: float) -> float:
    return towards if lag <= 0.0 else towards + (value - towards) * exp(-seconds / lag)


def _shares(plant: PlantState, parameters: PlantParameters) -> tuple[float, float, float]:
    """Shares of steering rate and braking that act, and until when [s]."""
    now = plant.time + SAME_TIME
    acting = [fault for fault in parameters.faults if fault.begin <= now < fault.end]
    edges = [edge for fault in parameters.faults for edge in (fault.begin, fault.end) if edge > now]
    return (
        prod(fault.steering_share for fault in acting),
        prod(fault.braking_share for fault in acting),
        min(edges, default=inf),
    )


def _acceleration_until_standstill(plant: PlantState, offset: float, share: float) -> tuple[float, float]:
    """The acceleration really done [m/s²], and until when it is that [s].

    Of what brakes only a `share` does, until the vehicle stands; the `offset` [m/s²] always acts.
    """
    a = plant.acceleration
    if share == 1.0 or plant.v * a >= 0.0:
        return a + offset, inf
    weak = share * a + offset
    if plant.v * weak >= 0.0:
        return weak, inf
    left = -plant.v / weak
    return (weak, plant.time + left) if left > SAME_TIME else (a + offset, inf)


def _steering_until_stop(plant: PlantState, parameters: PlantParameters, share: float) -> tuple[float, float]:
    """The rate the steering really does [rad/s] and the time at which it reaches its stop [s]."""
    rate = share * plant.steering_rate
    if rate == 0.0:
        return 0.0, inf
    stop = copysign(parameters.steering_limit, rate)
    left = (stop - plant.delta) / rate
    # At (or, by a start beyond it, outside) the stop the steering only moves back.
    return (rate, plant.time + left) if left > SAME_TIME else (0.0, inf)


def _integrate(
    plant: PlantState, parameters: PlantParameters, a: float, rate: float, end: float, *, at_stop: bool
) -> PlantState:
    """Equations (1) to (3) over an interval of constant acceleration and steering rate."""
    h = end - plant.time
    v = plant.v + a * h * _NODES
    delta = plant.delta + rate * h * _NODES
    turn = v * np.tan(delta + parameters.steering_offset) / parameters.wheelbase
    phi = plant.phi + h * (_TO_NODES @ turn)
    return replace(
        plant,
        time=end,
        x=plant.x + h * float(_WEIGHTS @ (v * np.cos(phi))),
        y=plant.y + h * float(_WEIGHTS @ (v * np.sin(phi))),
        phi=plant.phi + h * float(_WEIGHTS @ turn),
        v=plant.v + a * h,
        delta=copysign(parameters.steering_limit, rate) if at_stop else plant.delta + rate * h,
    )


def _clip(value: float, limit: float) -> float:
    return min(max(value, -limit), limit)
