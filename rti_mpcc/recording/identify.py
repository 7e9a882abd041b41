"""Dead times and lags of drive and steering from a recording."""

from __future__ import annotations

from dataclasses import dataclass
from operator import attrgetter
from typing import Any

import numpy as np

from estimation.actuator_bank import DRIVE, STEERING
from estimation.actuator_fit import ActuatorFit, Drive, fitted
from rti_mpcc.config import ActuatorModel
from rti_mpcc.errors import InputError
from rti_mpcc.recording.contents import Recording


@dataclass(frozen=True, slots=True, kw_only=True)
class Identified:
    """The fits of drive and steering, and what they were made from; a fit is None where too little moved."""

    speed: Drive
    steering_angle: Drive
    drive: ActuatorFit | None
    steering: ActuatorFit | None

    @property
    def model(self) -> ActuatorModel:
        """The settings for `ControllerConfig.actuators`."""
        drive, steering = self.drive, self.steering
        return ActuatorModel(
            dead_time=0.0 if drive is None else round(drive.dead_time, 3),
            drive_lag=0.0 if drive is None else round(drive.lag, 3),
            steering_dead_time=None if steering is None else round(steering.dead_time, 3),
            steering_lag=0.0 if steering is None else round(steering.lag, 3),
        )

    def figures(self) -> dict[str, Any]:
        """As identified.json has them."""
        found: dict[str, Any] = {"actuators": self.model.model_dump()}
        for name, fit in (("drive", self.drive), ("steering", self.steering)):
            found[name] = fit and {
                "interface": "setpoints" if fit.by_setpoints else "rates",
                "dead_time_s": fit.dead_time,
                "dead_time_std_s": fit.stds[0],
                "lag_s": fit.lag,
                "lag_std_s": fit.stds[1],
                "gain": fit.gain,
                "rms": fit.rms,
                "rms_without_dead_time_and_lag": fit.rms_without,
            }
        return found


def identify(recording: Recording) -> Identified:
    """Fit drive and steering. Raises InputError where neither of them moved enough."""
    commanded: Any = attrgetter("acceleration", "steering_rate", "speed", "steering")
    rows = [
        (c.inputs.now, c.inputs.state.v, c.inputs.state.delta, *commanded(c.command))
        for c in recording.cycles
        if c.command is not None
    ]
    table = np.array(rows, dtype=np.float64).reshape(-1, 7)
    table = table[np.isfinite(table).all(axis=1)]
    table = table[np.append(True, np.diff(table[:, 0]) > 0.0)] if len(table) else table
    t, v, delta, a, rate, speed, angle = table.T
    drive = Drive(stamps=t, measured=v, rates=a, setpoints=speed)
    steering = Drive(stamps=t, measured=delta, rates=rate, setpoints=angle)
    fits = {"drive": fitted(drive, DRIVE), "steering": fitted(steering, STEERING)}
    if fits["drive"] is None and fits["steering"] is None:
        raise InputError("speed and steering change too little: nothing can be fitted to this recording")
    return Identified(speed=drive, steering_angle=steering, **fits)
