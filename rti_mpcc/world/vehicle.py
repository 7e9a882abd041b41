"""What is learnt of the vehicle in a cycle: how its actuators answer, and what acts beside its commands."""

from __future__ import annotations

import logging
from dataclasses import replace
from math import radians

from estimation import DisturbanceEstimate
from estimation.actuator_bank import DRIVE, STEERING, VALUE
from estimation.actuators import (
    ActuatorRecord,
    Measurement,
    SentCommand,
    compare_models,
    is_due,
    mean_rate,
    noted,
)
from estimation.disturbance import Motion, first_estimate, unseated, updated
from estimation.odometry import with_commands
from rti_mpcc.config import ControllerConfig
from rti_mpcc.model.actuators import (
    Actuator,
    Actuators,
    answered_by,
    going_out,
    mean_rates,
    roll_forward,
    still_acting,
)
from rti_mpcc.model.layout import DELTA, PHI, V
from rti_mpcc.types import Array
from rti_mpcc.world.monitor import StateMonitor
from rti_mpcc.world.standstill import AxisMotion
from rti_mpcc.world.world import VehicleEstimate, W, World

OFFSET_REPORTED = radians(1.0)  # an offset of the steering larger by two standard deviations is told
Records = tuple[ActuatorRecord, ActuatorRecord]
"""Of drive and steering."""

_log = logging.getLogger(__name__)


def predicted(s: World, at: float, config: ControllerConfig) -> Array:
    """The estimate predicted to `at` [s] by the commands, with the steering that acts."""
    estimate, known = s.vehicle.monitor.state, s.vehicle.disturbance
    assert estimate is not None
    unseen = s.vehicle.motion.unseen
    if unseen:
        estimate = estimate.copy()
        estimate[V] += unseen
    return known.effective(roll_forward(estimate, s.queue, s.clock.now, at, config, known))


def compare_actuators(
    s: World, monitor: StateMonitor, moved: AxisMotion, holds: bool, config: ControllerConfig
) -> tuple[Records, Actuators]:
    """What is learnt of drive and steering by this cycle's measurement, and how they are found to answer.

    `s`: of the last cycle; `monitor`, `moved`: with the measurement; `holds`: the vehicle is held at its
    dock, where no other answer may change what holds it.
    """
    (drive, steering), present, now = s.vehicle.records, s.vehicle.actuators, monitor.at
    if not config.disturbance.enabled or monitor.measured is None:
        return s.vehicle.records, present
    missed = bool(s.sent) and now - s.clock.now > config.longest_cycle
    if holds or monitor.relocalised or monitor.doubt or missed:
        # Of this time it is not known what was driven.
        return (drive.restarted(), steering.restarted()), present
    _, _, heading, speed, delta, _ = monitor.measured.tolist()
    # Before the first command nothing acts.
    accelerated, steered = SentCommand(now, 0.0, speed), SentCommand(now, 0.0, delta)
    if s.sent:
        driven, turned = going_out(s.sent, present, config.cycle)
        accelerated = SentCommand(s.clock.now, driven.acceleration, driven.speed)
        steered = SentCommand(s.clock.now, turned.steering_rate, turned.steering)
    if moved.unseen and not drive.measured[:, VALUE].any():
        drive = drive.restarted()  # it was said to stand, and did not
    drive = noted(drive, accelerated, Measurement(now, speed + moved.unseen, heading))
    steering = noted(steering, steered, Measurement(now, delta, heading))
    # One of them in a cycle: no cycle is to take the time of both.
    if is_due(drive, now) and (drive.compared_at <= steering.compared_at or not is_due(steering, now)):
        drive, found = compare_models(drive, now, present.drive, DRIVE)
        present = present if found is None else present._replace(drive=Actuator(*found))
    elif is_due(steering, now):
        steering, found = compare_models(steering, now, present.steering, STEERING)
        present = present if found is None else present._replace(steering=Actuator(*found))
    return (drive, steering), present


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
    track = monitor.sensors.track
    if track is not None:
        track = with_commands(track, lambda begin, end: mean_rates(acted, begin, end))
        monitor = replace(monitor, sensors=monitor.sensors._replace(track=track))
    return s, monitor, remark


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


def learnt(
    s: World,
    monitor: StateMonitor,
    moved: AxisMotion,
    drive: ActuatorRecord,
    holds: bool,
    config: ControllerConfig,
) -> DisturbanceEstimate | None:
    """The disturbance after this cycle's measurement; nothing is learnt from one whose speed is doubted.

    A relocalised vehicle starts anew, as another disturbance may act there.
    `s`: of the last cycle, with the commands sent up to then; `monitor`, `moved`, `drive`: with this
    measurement; `holds`: the vehicle is held at its dock.
    """
    if monitor.measured is None or not config.disturbance.enabled:
        return s.vehicle.offsets
    before = s.vehicle.offsets or first_estimate(config.disturbance)
    if monitor.relocalised or (monitor.doubt and not _moves_as_measured(monitor)):
        return unseated(before)
    if holds:
        return s.vehicle.offsets  # (H1) balances what acts
    state, now = monitor.measured, monitor.at
    if before.at is not None and now - before.at > config.longest_cycle:
        before = unseated(before)  # a watchdog may have driven
    asked = 0.0 if before.at is None else _acted(s, drive, before.at, now)
    motion = Motion(v=float(state[V]) + moved.unseen, phi=float(state[PHI]), delta=float(state[DELTA]))
    turns = not monitor.sensors.speed.problem and moved.unseen == 0.0
    return updated(before, motion, now, asked, config.vehicle.wheelbase, config.disturbance, turns=turns)


def sensor_remarks(
    monitor: StateMonitor, moved: AxisMotion, known: DisturbanceEstimate | None
) -> tuple[str, ...]:
    """What is said of sensors that the estimate does without, or corrects."""
    offset = 0.0 if known is None else known.steering
    told = known is not None and abs(offset) > OFFSET_REPORTED + 2.0 * known.stds[1]
    beside = f"steering sensor is {-offset:+.2f} rad off: it is corrected" if told else ""
    unseen = ""
    if moved.unseen and not monitor.sensors.speed.problem:
        measured = moved.moments[-1].measured + 0.0  # no -0.00
        unseen = f"speed sensor says {measured:.2f} m/s, but the pose moves: speed from the pose is used"
    return (*monitor.sensors.remarks, unseen, beside)


def _acted(s: World, drive: ActuatorRecord, begin: float, end: float) -> float:
    """Mean of the acceleration that the commands made [m/s²], with a lag that is suspected."""
    suspected = None if drive.suspected is None else mean_rate(drive, drive.suspected, begin, end)
    return mean_rates(s.queue, begin, end)[0] if suspected is None else suspected


def _moves_as_measured(monitor: StateMonitor) -> bool:
    """Whether only the place of a doubted measurement is doubted."""
    measured, state = monitor.measured, monitor.state
    if measured is None or state is None or monitor.steering_fault or monitor.odd_since is not None:
        return False
    if monitor.sensors.pose:
        return False
    return monitor.dead_reckoned is measured and bool((state[[V, DELTA]] == measured[[V, DELTA]]).all())
