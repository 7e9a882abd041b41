"""What is learnt in a cycle of what acts beside the commands: pure functions."""

from __future__ import annotations

from estimation import DisturbanceEstimate
from estimation.disturbance import Motion, first_estimate, unseated, updated
from rti_mpcc.config import ControllerConfig
from rti_mpcc.model.delay import mean_acceleration
from rti_mpcc.model.layout import DELTA, PHI, V
from rti_mpcc.planning.plausibility import StateMonitor
from rti_mpcc.planning.state import ControllerState


def learnt(s: ControllerState, monitor: StateMonitor, config: ControllerConfig) -> DisturbanceEstimate | None:
    """The estimate after this cycle's measurement: nothing is learnt from one that is doubted.

    `s`: of the last cycle, with the commands sent up to then; `monitor`: with this measurement.
    """
    if monitor.measured is None or not config.disturbance.enabled:
        return s.vehicle.offsets
    before = s.vehicle.offsets or first_estimate(config.disturbance)
    if monitor.why or monitor.found:
        return unseated(before)
    state, now = monitor.measured, monitor.at
    asked = 0.0 if before.at is None else mean_acceleration(s.queue, before.at, now)
    motion = Motion(v=float(state[V]), phi=float(state[PHI]), delta=float(state[DELTA]))
    return updated(before, motion, now, asked, config.vehicle.wheelbase, config.disturbance)
