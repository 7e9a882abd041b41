"""Speed and steering as measured, as commanded, and by the actuators' fit."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from estimation.actuator_fit import ActuatorFit, Drive
from rti_mpcc.recording.identify import Identified
from rti_mpcc.report import style
from rti_mpcc.report.axes import grid


def actuators_figure(title: str, found: Identified) -> Figure:
    """One strip chart for drive and steering each, over the whole drive."""
    figure = Figure(figsize=(9.0, 6.0), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True)
    rows = (
        (upper, found.speed, found.drive, "speed [m/s]"),
        (lower, found.steering_angle, found.steering, "steering [rad]"),
    )
    for axes, drive, fit, label in rows:
        axes.plot(drive.stamps, drive.measured, color=style.BLACK, label="measured")
        axes.plot(drive.stamps, drive.setpoints, color=style.SKY, linewidth=1.0, label="set-point")
        if fit is not None:
            axes.plot(drive.stamps, fit.predicted, color=style.RED, linestyle="--", label=_named(drive, fit))
        axes.set_ylabel(label)
        grid(axes)
        axes.legend(loc="best", fontsize="small")
    lower.set_xlabel("time [s]")
    upper.set_title(title, parse_math=False)
    return figure


def _named(drive: Drive, fit: ActuatorFit) -> str:
    share = fit.rms / max(float(np.ptp(drive.measured)), 1e-9)
    times = f"dead time {fit.dead_time:.3f} s, lag {fit.lag:.3f} s"
    return f"fit: {times}; residual (rms) {100.0 * share:.1f} % of the range"
