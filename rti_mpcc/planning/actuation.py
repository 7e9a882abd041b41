"""How drive and steering are found to answer their commands, in place of what was given."""

from __future__ import annotations

import logging
from dataclasses import replace

from estimation.actuators import DRIVE, STEERING, commanded, compare_models, with_measurement
from rti_mpcc.config import ControllerConfig
from rti_mpcc.model.actuators import Actuator, Actuators, answered_by, going_out
from rti_mpcc.model.delay import mean_rates, still_acting
from rti_mpcc.model.layout import DELTA, PHI, V
from rti_mpcc.planning.plausibility import StateMonitor
from rti_mpcc.planning.standstill import AxisMotion
from rti_mpcc.planning.state import ControllerState, VehicleEstimate

_log = logging.getLogger(__name__)


def correct_actuators(
    s: ControllerState, monitor: StateMonitor, now: float, config: ControllerConfig
) -> tuple[ControllerState, StateMonitor, str]:
    """State and monitor with the actuators as this cycle's measurement shows them, and a remark on what is
    corrected.

    `s`: of the last cycle; `monitor`: with this measurement, at `now` [s].
    """
    if not config.disturbance.enabled or monitor.measured is None:
        return s, monitor, ""
    vehicle, present = s.vehicle, s.vehicle.actuators
    drive, steering = vehicle.records
    if not s.sent or monitor.found or monitor.why or now - s.now > config.longest_cycle:
        # Of this time it is not known what was driven.
        return (
            replace(s, vehicle=replace(vehicle, records=(drive.restarted(), steering.restarted()))),
            monitor,
            "",
        )
    out = going_out(s.sent, present, config.cycle)
    heading, speed, delta = monitor.measured[[PHI, V, DELTA]].tolist()
    drive = commanded(drive, out[0].acceleration, out[0].speed, s.now)
    steering = commanded(steering, out[1].steering_rate, out[1].steering, s.now)
    drive, by_drive = compare_models(
        with_measurement(drive, speed, now, heading, s.is_stationary), present.drive, now, DRIVE
    )
    steering, by_steering = compare_models(
        with_measurement(steering, delta, now), present.steering, now, STEERING
    )
    found = Actuators(Actuator(*(by_drive or present.drive)), Actuator(*(by_steering or present.steering)))
    after = replace(s, vehicle=replace(vehicle, records=(drive, steering)))
    if found == present:
        return after, monitor, ""
    remarks = "; ".join(_remarks(vehicle, after.vehicle, found))
    return *_corrected(after, monitor, found, config), remarks


def _corrected(
    s: ControllerState, monitor: StateMonitor, found: Actuators, config: ControllerConfig
) -> tuple[ControllerState, StateMonitor]:
    """With other actuators: the commands under way, and those that the sensors were compared with, act as
    these answer."""
    present, disturbance, (drive, _) = s.vehicle.actuators, s.vehicle.disturbance, s.vehicle.records
    sent, offsets = s.sent, s.vehicle.offsets
    if found.drive != present.drive:
        if drive.obeys_setpoints:  # in which there is nothing against the disturbance
            sent = tuple(replace(each, acceleration=disturbance.acting(each.acceleration)) for each in sent)
        if drive.corrected == found.drive:
            offsets = None  # what seemed to act beside the commands was the lag
    sent = answered_by(sent, present, found, config.cycle)
    acted = [each.queued(found, config.cycle) for each in sent]
    # The motion of the last moments was told by other commands.
    vehicle = replace(s.vehicle, actuators=found, offsets=offsets, motion=AxisMotion())
    s = replace(s, vehicle=vehicle, sent=sent, queue=still_acting(acted, s.now))
    return s, monitor.commanded_anew(lambda begin, end: mean_rates(acted, begin, end))


def _remarks(before: VehicleEstimate, after: VehicleEstimate, found: Actuators) -> list[str]:
    """What is told, and logged, of actuators that are corrected."""
    told = [
        f"the {name} answers its commands with a dead time of {now.dead_time:.2f} s and a lag of "
        f"{now.lag:.2f} s, not with {then.dead_time:.2f} s and {then.lag:.2f} s: corrected"
        for name, then, now, old, new in zip(
            Actuators._fields, before.actuators, found, before.records, after.records, strict=True
        )
        if new.corrected != old.corrected
    ]
    for each in told:
        _log.info("%s", each)
    return told
