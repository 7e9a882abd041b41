"""How drive and steering are found to answer their commands, in place of what was given."""

from __future__ import annotations

import logging
from dataclasses import replace

from estimation.actuator_bank import DRIVE, STEERING
from estimation.actuators import (
    ActuatorRecord,
    Measurement,
    SentCommand,
    compare_models,
    with_cycle,
)
from rti_mpcc.config import ControllerConfig
from rti_mpcc.model.actuators import Actuator, Actuators, answered_by, going_out
from rti_mpcc.model.delay import mean_rates, still_acting
from rti_mpcc.world.monitor import StateMonitor
from rti_mpcc.world.standstill import AxisMotion
from rti_mpcc.world.world import VehicleEstimate, W, World

Records = tuple[ActuatorRecord, ActuatorRecord]
"""Of drive and steering."""

_log = logging.getLogger(__name__)


def compare_actuators(s: World, monitor: StateMonitor, config: ControllerConfig) -> tuple[Records, Actuators]:
    """What is learnt of drive and steering by this cycle's measurement, and how they are found to answer.

    `s`: of the last cycle; `monitor`: with the measurement.
    """
    (drive, steering), present, now = s.vehicle.records, s.vehicle.actuators, monitor.at
    if not config.disturbance.enabled or monitor.measured is None:
        return s.vehicle.records, present
    if not s.sent or monitor.relocalised or monitor.doubt or now - s.clock.now > config.longest_cycle:
        # Of this time it is not known what was driven.
        return (drive.restarted(), steering.restarted()), present
    driven, turned = going_out(s.sent, present, config.cycle)
    _, _, heading, speed, delta, _ = monitor.measured.tolist()
    accelerated = SentCommand(s.clock.now, driven.acceleration, driven.speed)
    drive = with_cycle(drive, accelerated, Measurement(now, speed, heading))
    drive, by_drive = compare_models(drive, present.drive, now, DRIVE)
    steered = SentCommand(s.clock.now, turned.steering_rate, turned.steering)
    steering = with_cycle(steering, steered, Measurement(now, delta, heading))
    steering, by_steering = compare_models(steering, present.steering, now, STEERING)
    if by_drive is None and by_steering is None:
        return (drive, steering), present
    found = Actuators(Actuator(*(by_drive or present.drive)), Actuator(*(by_steering or present.steering)))
    return (drive, steering), found


def correct_actuators(
    s: W, monitor: StateMonitor, records: Records, found: Actuators, config: ControllerConfig
) -> tuple[W, StateMonitor, str]:
    """State and monitor with other actuators, and a remark: the commands under way, and those that the
    sensors were compared with, act as these answer."""
    remark = "; ".join(_remarks(s.vehicle, records, found))
    present, disturbance, drive = s.vehicle.actuators, s.vehicle.disturbance, records[0]
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
    s = replace(s, vehicle=vehicle, sent=sent, queue=still_acting(acted, s.clock.now))
    return s, monitor.with_commands(lambda begin, end: mean_rates(acted, begin, end)), remark


def _remarks(before: VehicleEstimate, records: Records, found: Actuators) -> list[str]:
    """What is told, and logged, of actuators that are corrected."""
    told = [
        f"the {name} answers its commands with a dead time of {now.dead_time:.2f} s and a lag of "
        f"{now.lag:.2f} s, not with {then.dead_time:.2f} s and {then.lag:.2f} s: corrected"
        for name, then, now, old, new in zip(
            Actuators._fields, before.actuators, found, before.records, records, strict=True
        )
        if new.corrected != old.corrected
    ]
    for each in told:
        _log.info("%s", each)
    return told
