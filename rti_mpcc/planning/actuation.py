"""How drive and steering are found to answer their commands, in place of what was given."""

from __future__ import annotations

import logging
from dataclasses import replace

from estimation.actuators import DRIVE, STEERING, commanded, compared, observed
from rti_mpcc.config import ControllerConfig
from rti_mpcc.model.actuators import Actuator, Actuators, answered_by, going_out
from rti_mpcc.model.delay import still_acting
from rti_mpcc.model.layout import DELTA, V
from rti_mpcc.planning.plausibility import StateMonitor
from rti_mpcc.planning.state import ControllerState

_log = logging.getLogger(__name__)


def learnt(
    s: ControllerState, monitor: StateMonitor, now: float, config: ControllerConfig
) -> tuple[ControllerState, str]:
    """The state with the actuators as they are found after this cycle's measurement, and a remark if changed.

    `s`: of the last cycle; `monitor`: with this measurement, at `now` [s].
    """
    if not config.disturbance.enabled or monitor.measured is None:
        return s, ""
    vehicle, present = s.vehicle, s.vehicle.actuators
    if not s.sent or monitor.found or monitor.why or now - s.now > config.longest_cycle:
        # Of this time it is not known what was driven.
        drive, steering = vehicle.records
        return replace(s, vehicle=replace(vehicle, records=(drive.restarted(), steering.restarted()))), ""
    out = going_out(s.sent, present, config.cycle)
    drive, wheels = (out[0].acceleration, out[0].speed), (out[1].steering_rate, out[1].steering)
    inputs = (drive, float(monitor.measured[V]), DRIVE, s.is_stationary)
    turning = (wheels, float(monitor.measured[DELTA]), STEERING, False)
    records, actuators = [], []
    for record, actuator, (command, value, scale, at_rest) in zip(
        vehicle.records, present, (inputs, turning), strict=True
    ):
        seen = observed(commanded(record, *command, s.now), value, now, at_rest=at_rest)
        seen, model = compared(seen, actuator, now, scale)
        records.append(seen)
        actuators.append(actuator if model is None else Actuator(*model))
    found = Actuators(*actuators)
    vehicle = replace(vehicle, records=(records[0], records[1]))
    if found == present:
        return replace(s, vehicle=vehicle), ""
    remark = "; ".join(
        _remark(name, *each)
        for name, *each in zip(Actuators._fields, present, found, strict=True)
        if each[0] != each[1]
    )
    _log.info("%s", remark)
    sent, disturbance = s.sent, vehicle.disturbance
    if found.drive != present.drive and records[0].obeys_setpoints:
        # What was commanded against a disturbance is not in the set-points.
        sent = tuple(replace(each, acceleration=disturbance.acting(each.acceleration)) for each in sent)
    sent = answered_by(sent, present, found, config.cycle)
    queue = tuple(each.queued(found, config.cycle) for each in sent)
    # What seemed to act beside the commands was the lag.
    vehicle = replace(vehicle, actuators=found, offsets=None)
    return replace(s, vehicle=vehicle, sent=sent, queue=still_acting(queue, s.now)), remark


def _remark(name: str, assumed: Actuator, found: Actuator) -> str:
    return (
        f"the {name} answers its commands with a dead time of {found.dead_time:.2f} s and a lag of "
        f"{found.lag:.2f} s, not with {assumed.dead_time:.2f} s and {assumed.lag:.2f} s: corrected"
    )
