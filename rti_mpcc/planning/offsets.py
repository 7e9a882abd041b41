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
    """The estimate after this cycle's measurement: nothing is learnt from one whose speed is doubted.

    A vehicle that is measured elsewhere than it should be is braked until it stands: what acts beside its
    commands by then may be something else than before.

    `s`: of the last cycle, with the commands sent up to then; `monitor`: with this measurement.
    """
    if monitor.measured is None or not config.disturbance.enabled:
        return s.vehicle.offsets
    before = s.vehicle.offsets or first_estimate(config.disturbance)
    if monitor.found or (monitor.why and not _moves_as_measured(monitor)):
        return unseated(before)
    state, now = monitor.measured, monitor.at
    if before.at is not None and now - before.at > config.longest_cycle:
        before = unseated(before)  # a watchdog may have driven
    asked = 0.0 if before.at is None else mean_acceleration(s.queue, before.at, now)
    motion = Motion(v=float(state[V]), phi=float(state[PHI]), delta=float(state[DELTA]))
    return updated(before, motion, now, asked, config.vehicle.wheelbase, config.disturbance)


def _moves_as_measured(monitor: StateMonitor) -> bool:
    """Whether of a doubted measurement the place is doubted alone."""
    measured, state = monitor.measured, monitor.state
    if measured is None or state is None or monitor.steering_fault or monitor.odd_since is not None:
        return False
    return monitor.reckoned is measured and bool((state[[V, DELTA]] == measured[[V, DELTA]]).all())
